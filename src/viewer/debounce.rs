//! Waits until a change has come to rest.

use std::time::{Duration, Instant};

/// Quiet time after the last change of a setting before it is baked.
pub const QUIET: Duration = Duration::from_millis(150);

/// When a change is to be acted upon.
#[derive(Clone, Copy, Debug, Default)]
pub struct Debounce {
    due: Option<Instant>,
}

impl Debounce {
    /// A change at `now`: the wait starts anew.
    pub fn change(&mut self, now: Instant) {
        self.due = Some(now + QUIET);
    }

    /// Forgets the change.
    pub fn clear(&mut self) {
        self.due = None;
    }

    /// When to ask again; `None` where nothing waits.
    pub fn due(&self) -> Option<Instant> {
        self.due
    }

    /// Whether a change has come to rest by `now`: true once per change.
    pub fn is_due(&mut self, now: Instant) -> bool {
        let is_due = self.due.is_some_and(|due| now >= due);
        if is_due {
            self.due = None;
        }
        is_due
    }
}
