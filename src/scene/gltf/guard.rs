//! Turns a panic in a library into `None`.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Whether a panic of this thread would be caught, so that a panic hook need not report it.
pub fn is_guarded() -> bool {
    GUARDED.get()
}

/// Runs `work`; `None` if it panics. Whatever a panic left half-changed must not be used afterwards.
pub fn without_panic<T>(work: impl FnOnce() -> T) -> Option<T> {
    let outer = GUARDED.replace(true);
    let result = panic::catch_unwind(AssertUnwindSafe(work));
    GUARDED.set(outer);
    result.ok()
}
