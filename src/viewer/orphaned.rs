//! Windows that somebody else destroys, as `xdotool windowclose` does: winit takes it that the X server always knows its
//! window, and panics where it does not.

use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Runs the window; `None` where winit panicked, without a word.
pub(super) fn run<T>(window: impl FnOnce() -> T) -> Option<T> {
    let is_orphaned = Arc::new(AtomicBool::new(false));
    let usual: Arc<dyn Fn(&PanicHookInfo<'_>) + Send + Sync> = Arc::from(panic::take_hook());
    let (found, tell) = (Arc::clone(&is_orphaned), Arc::clone(&usual));
    panic::set_hook(Box::new(move |info| {
        if is_of_winit(info) {
            found.store(true, Ordering::Relaxed);
        } else {
            tell(info);
        }
    }));
    let outcome = panic::catch_unwind(AssertUnwindSafe(window));
    panic::set_hook(Box::new(move |info| usual(info)));
    match outcome {
        Ok(outcome) => Some(outcome),
        Err(_) if is_orphaned.load(Ordering::Relaxed) => None,
        Err(panic) => panic::resume_unwind(panic),
    }
}

fn is_of_winit(info: &PanicHookInfo<'_>) -> bool {
    info.location()
        .is_some_and(|place| place.file().contains("/winit-") || place.file().contains("\\winit-"))
}
