//! How far a bake is, written by its threads and read by the window without a lock.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::progress::{Progress, Stage};

/// Shortest time between two wake-ups of the window by progress.
const WAKE_EVERY: Duration = Duration::from_millis(50);

/// Stage and fraction in one word, so that they are read together: stage in the upper half, fraction × 2³¹ below.
#[derive(Debug, Default)]
pub(super) struct Meter {
    packed: AtomicU64,
}

const STAGES: [Stage; 5] = [
    Stage::Build,
    Stage::Plan,
    Stage::Caustic,
    Stage::Direct,
    Stage::Indirect,
];
const WHOLE: f64 = (1_u64 << 31) as f64;

impl Meter {
    fn write(&self, stage: Stage, fraction: f64) {
        let index = STAGES
            .iter()
            .position(|candidate| *candidate == stage)
            .unwrap_or(0) as u64;
        let part = (fraction.clamp(0.0, 1.0) * WHOLE) as u64;
        self.packed.store(index << 32 | part, Ordering::Relaxed);
    }

    pub(super) fn read(&self) -> (Stage, f64) {
        let packed = self.packed.load(Ordering::Relaxed);
        (
            STAGES[(packed >> 32) as usize],
            (packed & 0xffff_ffff) as f64 / WHOLE,
        )
    }
}

/// Progress of one bake; wakes the window now and then.
pub(super) struct Reporter<'a> {
    pub(super) meter: &'a Meter,
    pub(super) wake: &'a (dyn Fn() + Send + Sync),
    pub(super) start: Instant,
    /// When the window may be woken again [ms after `start`].
    pub(super) next_wake_ms: AtomicU64,
}

impl Progress for Reporter<'_> {
    fn advance(&self, stage: Stage, done: u64, total: u64) {
        self.meter.write(stage, done as f64 / total.max(1) as f64);
        let now_ms = self.start.elapsed().as_millis() as u64;
        let due_ms = self.next_wake_ms.load(Ordering::Relaxed);
        let next_ms = now_ms + WAKE_EVERY.as_millis() as u64;
        // Of several threads that come at once, one wakes.
        if now_ms >= due_ms
            && self
                .next_wake_ms
                .compare_exchange(due_ms, next_ms, Ordering::Relaxed, Ordering::Relaxed)
                .is_ok()
        {
            (self.wake)();
        }
    }
}
