//! Ends the program with one sentence when the system refuses memory. Only the binary does so: a library leaves that to
//! its user.

#![allow(
    unsafe_code,
    reason = "an allocator cannot be written without; each place says why it is sound"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The system's allocator, except that it never returns null.
#[derive(Debug)]
pub struct FirstSentence;

/// Set by the first thread that reports; all others wait.
static TOLD: AtomicBool = AtomicBool::new(false);

fn refused(bytes: usize) -> ! {
    while TOLD.swap(true, Ordering::Relaxed) {
        std::thread::sleep(Duration::from_secs(1));
    }
    // Standard error has no buffer, and this formatting does not allocate.
    let _ = writeln!(
        std::io::stderr(),
        "error: memory: the system refused {} bytes more; give less --map-resolution, less density or fewer --threads, \
         or more memory (ulimit -v)",
        bytes
    );
    // Exit cannot hang: stdout has nothing left to flush, and no thread that waits for memory holds its lock.
    std::process::exit(1)
}

fn checked(pointer: *mut u8, bytes: usize) -> *mut u8 {
    if pointer.is_null() {
        refused(bytes);
    }
    pointer
}

// SAFETY: every call is forwarded to `System` with its arguments, and its result is returned, except that the process
// ends on null. So this allocator keeps the contract of `GlobalAlloc` as `System` does.
unsafe impl GlobalAlloc for FirstSentence {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller guarantees the layout, as `System` requires.
        checked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller guarantees the layout, as `System` requires.
        checked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the pointer came from `System` through this allocator, with that layout; the caller guarantees the
        // size.
        checked(unsafe { System.realloc(pointer, layout, size) }, size)
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the pointer came from `System` through this allocator, with that layout.
        unsafe { System.dealloc(pointer, layout) }
    }
}
