//! What the pass of one light reports: its ledger, counts, footprints and time.

use std::time::Instant;

use cpu_time::ProcessTime;

use super::footprint_statistics::FootprintStatistics;
use super::ledger_sum::LedgerSum;
use crate::progress::{Control, Progress};

/// Result of the pass of one light.
#[derive(Clone, Debug, Default)]
pub struct PassReport {
    pub ledger: LedgerSum,
    /// Rays launched.
    pub rays: u64,
    /// Closest-hit queries.
    pub segments: u64,
    /// Kernels deposited.
    pub splats: u64,
    /// Squares of the launch domain whose bundles were deposited.
    pub squares: u64,
    /// Sizes of footprints.
    pub statistics: FootprintStatistics,
    /// Of tracing.
    pub trace_s: Seconds,
    /// Of depositing.
    pub deposit_s: Seconds,
    /// Whether it was stopped before the end.
    pub cancelled: bool,
}

/// Wall-clock and CPU time [s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seconds {
    pub wall: f64,
    /// Of all threads of the process.
    pub cpu: f64,
}

/// Measures wall-clock and CPU time.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    wall: Instant,
    cpu: Option<ProcessTime>,
}

impl Stopwatch {
    /// Starts both clocks. Without a CPU clock on the system, CPU time stays at zero.
    pub fn start() -> Self {
        Self {
            wall: Instant::now(),
            cpu: ProcessTime::try_now().ok(),
        }
    }

    /// Since the start.
    pub fn elapsed(&self) -> Seconds {
        let cpu = self
            .cpu
            .and_then(|start| start.try_elapsed().ok())
            .map_or(0.0, |time| time.as_secs_f64());
        Seconds {
            wall: self.wall.elapsed().as_secs_f64(),
            cpu,
        }
    }
}

impl Seconds {
    pub fn add(&mut self, other: Self) {
        self.wall += other.wall;
        self.cpu += other.cpu;
    }
}

/// Progress callback and cancel token of a pass.
#[derive(Clone, Copy)]
pub struct ProgressScope<'a> {
    pub progress: &'a dyn Progress,
    /// Checked for cancellation.
    pub control: &'a Control,
    /// Rays of previous passes (arrivals, where they were cached).
    pub done: u64,
    /// Rays (or arrivals) of all passes.
    pub total: u64,
}

impl PassReport {
    /// Adds the result of another pass over the same light.
    pub fn merge(&mut self, other: Self) {
        self.ledger.merge(&other.ledger);
        self.rays += other.rays;
        self.segments += other.segments;
        self.splats += other.splats;
        self.squares += other.squares;
        self.statistics.merge(&other.statistics);
        self.trace_s.add(other.trace_s);
        self.deposit_s.add(other.deposit_s);
        self.cancelled |= other.cancelled;
    }
}
