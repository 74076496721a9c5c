//! Progress reports of a running bake, and its cancellation.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

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
    /// Name for display.
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

/// Receives the progress of a bake. Called from its threads; must return quickly.
pub trait Progress: Sync {
    /// `done` of `total` of a stage are done. Totals of different stages are not comparable.
    fn advance(&self, _stage: Stage, _done: u64, _total: u64) {}

    /// Current forecast of the cost of the target, in one line; sent with every level.
    fn expect(&self, _line: &str) {}
}

/// Ignores all progress.
impl Progress for () {}

/// Receives stages only.
impl<F: Fn(Stage, u64, u64) + Sync> Progress for F {
    fn advance(&self, stage: Stage, done: u64, total: u64) {
        self(stage, done, total);
    }
}

/// A request to stop or to wait. Any thread may make it, or a deadline may be set.
#[derive(Debug, Default)]
pub struct Control {
    request: Arc<Request>,
    deadline: Option<Instant>,
}

#[derive(Debug)]
struct Request {
    cancelled: AtomicBool,
    made: Instant,
    /// The bake waits until then [ms since `made`].
    held_until_ms: AtomicU64,
    /// Nobody watches its levels until then [ms since `made`].
    unseen_until_ms: AtomicU64,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            cancelled: AtomicBool::new(false),
            made: Instant::now(),
            held_until_ms: AtomicU64::new(0),
            unseen_until_ms: AtomicU64::new(0),
        }
    }
}

impl Request {
    fn is_before(&self, until_ms: &AtomicU64) -> bool {
        let until_ms = until_ms.load(Ordering::Relaxed);
        until_ms > 0 && self.made.elapsed().as_millis() < u128::from(until_ms)
    }

    fn set_until(&self, until_ms: &AtomicU64, time: Duration) {
        let until = (self.made.elapsed() + time).as_millis();
        until_ms.store(until.try_into().unwrap_or(u64::MAX), Ordering::Relaxed);
    }
}

/// Polling interval of a bake that waits.
const LOOK_AGAIN: Duration = Duration::from_millis(5);

impl Control {
    /// The same request, which also takes effect at a deadline.
    #[must_use]
    pub fn with_deadline(&self, deadline: Instant) -> Self {
        Self {
            request: Arc::clone(&self.request),
            deadline: Some(deadline),
        }
    }

    /// The same request without a deadline.
    #[must_use]
    pub fn without_deadline(&self) -> Self {
        Self {
            request: Arc::clone(&self.request),
            deadline: None,
        }
    }

    /// Time until the deadline [s]; `None` without one.
    pub fn time_left_s(&self) -> Option<f64> {
        let deadline = self.deadline?;
        Some(deadline.saturating_duration_since(Instant::now()).as_secs_f64())
    }

    /// Asks the bake to stop soon; what it has is still returned, marked as partial.
    pub fn cancel(&self) {
        self.request.cancelled.store(true, Ordering::Relaxed);
    }

    /// Asks the bake to wait for this long, as something else needs the CPU.
    pub fn hold(&self, time: Duration) {
        self.request.set_until(&self.request.held_until_ms, time);
    }

    /// Tells the bake that nobody watches its levels for this long.
    pub fn look_away(&self, time: Duration) {
        self.request.set_until(&self.request.unseen_until_ms, time);
    }

    /// Whether somebody watches the levels of the bake.
    pub fn is_watched(&self) -> bool {
        !self.request.is_before(&self.request.unseen_until_ms)
    }

    /// Whether it was asked to stop, or the deadline has passed. Blocks as long as the bake is to wait.
    pub fn is_cancelled(&self) -> bool {
        let is_cancelled = || self.request.cancelled.load(Ordering::Relaxed);
        while self.request.is_before(&self.request.held_until_ms) && !is_cancelled() {
            std::thread::sleep(LOOK_AGAIN);
        }
        is_cancelled() || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}
