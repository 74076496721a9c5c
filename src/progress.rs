//! What a running bake tells, and how it is stopped.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::illumination::IlluminationMap;

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
            Self::Picture => "picture",
        }
    }
}

/// Listens to a bake. Called from its threads; must return quickly.
pub trait Progress: Sync {
    /// `done` of `total` of a stage; totals of different stages are not comparable.
    fn advance(&self, _stage: Stage, _done: u64, _total: u64) {}

    /// A whole picture of lower quality, on the way to the final one.
    fn preview(&self, _maps: Vec<IlluminationMap>) {}
}

/// Hears nothing.
impl Progress for () {}

/// A request to stop, that any thread may set.
#[derive(Debug, Default)]
pub struct Control {
    cancelled: AtomicBool,
}

impl Control {
    /// Asks the bake to stop soon; what it has is still returned, marked partial.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether it was asked to stop.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}
