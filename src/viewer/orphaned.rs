//! Windows that somebody else destroys, as `xdotool windowclose` does: winit takes it that the X server always knows its
//! window, and panics where it does not.

use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether winit has panicked.
static IS_ORPHANED: AtomicBool = AtomicBool::new(false);

/// Notes a panic of winit, and tells whether it is one: then the window has gone, and [`run`](super::run) ends as if it
/// had been closed. For the program's panic hook, which need not report it; without that the panic goes on.
pub fn is_orphaned(info: &PanicHookInfo<'_>) -> bool {
    let is_of_winit = info
        .location()
        .is_some_and(|place| place.file().contains("/winit-") || place.file().contains("\\winit-"));
    IS_ORPHANED.fetch_or(is_of_winit, Ordering::Relaxed);
    is_of_winit
}

/// Runs the window; `None` where winit panicked.
pub(super) fn run<T>(window: impl FnOnce() -> T) -> Option<T> {
    match panic::catch_unwind(AssertUnwindSafe(window)) {
        Ok(outcome) => Some(outcome),
        Err(_) if IS_ORPHANED.load(Ordering::Relaxed) => None,
        Err(panic) => panic::resume_unwind(panic),
    }
}
