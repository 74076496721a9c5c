//! What a running bake tells, and how it is stopped.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// What a bake is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Building the bounding volume hierarchy.
    Build,
    /// Deciding effects, item buffers, map sizes.
    Plan,
    /// Tracing light rays and depositing their flux.
    Caustic,
    /// Shadow rays of the direct layer.
    Direct,
    /// Rays between diffuse surfaces.
    Indirect,
    /// The eye pass on the CPU.
    Picture,
}

impl Stage {
    /// A word for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Build => "build",
            Self::Plan => "plan",
            Self::Caustic => "caustic",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Picture => "picture",
        }
    }
}

/// Listens to a bake. Called from its threads; must return quickly.
pub trait Progress: Sync {
    /// `done` of `total` of a stage; totals of different stages are not comparable.
    fn advance(&self, _stage: Stage, _done: u64, _total: u64) {}

    /// What the target is expected to take by now, in one line; comes with every level.
    fn expect(&self, _line: &str) {}
}

/// Hears nothing.
impl Progress for () {}

/// Hears of stages alone.
impl<F: Fn(Stage, u64, u64) + Sync> Progress for F {
    fn advance(&self, stage: Stage, done: u64, total: u64) {
        self(stage, done, total);
    }
}

/// A request to stop: any thread may set it, or a time may be set for it.
#[derive(Debug, Default)]
pub struct Control {
    cancelled: Arc<AtomicBool>,
    deadline: Option<Instant>,
}

impl Control {
    /// The same request, that also comes by itself at a given time.
    #[must_use]
    pub fn with_deadline(&self, deadline: Instant) -> Self {
        Self {
            cancelled: Arc::clone(&self.cancelled),
            deadline: Some(deadline),
        }
    }

    /// The same request, whatever the time.
    #[must_use]
    pub fn without_deadline(&self) -> Self {
        Self {
            cancelled: Arc::clone(&self.cancelled),
            deadline: None,
        }
    }

    /// Until the time that was set for it [s]; `None` without one.
    pub fn time_left_s(&self) -> Option<f64> {
        let deadline = self.deadline?;
        Some(deadline.saturating_duration_since(Instant::now()).as_secs_f64())
    }

    /// Asks the bake to stop soon; what it has is still returned, marked partial.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether it was asked to stop.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
            || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}
