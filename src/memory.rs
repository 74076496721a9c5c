//! Memory that the system refuses ends the program with one sentence. It is the binary's alone: a library leaves it to
//! its user.

#![allow(
    unsafe_code,
    reason = "an allocator cannot be written without; each place says why it is sound"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The system's allocator, but for what it refuses.
#[derive(Debug)]
pub struct FirstSentence;

/// Set by the thread that tells of it: of several only the first does.
static TOLD: AtomicBool = AtomicBool::new(false);

fn refused(bytes: usize) -> ! {
    while TOLD.swap(true, Ordering::Relaxed) {
        std::thread::sleep(Duration::from_secs(1));
    }
    // Standard error has no buffer, and formats without asking for memory.
    let _ = writeln!(
        std::io::stderr(),
        "error: memory: the system refused {} bytes more; give less --map-resolution, less density or fewer --threads, \
         or more memory (ulimit -v)",
        bytes
    );
    // Neither buffered nor locked by a thread that waits for memory itself.
    std::process::exit(1)
}

fn checked(pointer: *mut u8, bytes: usize) -> *mut u8 {
    if pointer.is_null() {
        refused(bytes);
    }
    pointer
}

// SAFETY: every call goes to the system's allocator with the arguments that came, and its answer is handed on; where that
// is null, the process ends instead. So this allocator keeps `GlobalAlloc`'s contract as `System` does.
unsafe impl GlobalAlloc for FirstSentence {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller vouches for the layout, as `System` asks.
        checked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller vouches for the layout, as `System` asks.
        checked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the pointer came from `System` by way of this allocator, with that layout; the caller vouches for the
        // size.
        checked(unsafe { System.realloc(pointer, layout, size) }, size)
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the pointer came from `System` by way of this allocator, with that layout.
        unsafe { System.dealloc(pointer, layout) }
    }
}
