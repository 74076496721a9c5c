//! Turns a panic in a library into `None`.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Whether a panic of this thread would be caught: a program's panic hook need not tell of it.
pub fn is_guarded() -> bool {
    GUARDED.get()
}

/// Runs `work`; `None` where it panicked. Nothing that a panic left half-changed may be used afterwards.
pub fn without_panic<T>(work: impl FnOnce() -> T) -> Option<T> {
    let outer = GUARDED.replace(true);
    let result = panic::catch_unwind(AssertUnwindSafe(work));
    GUARDED.set(outer);
    result.ok()
}
