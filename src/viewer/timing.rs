//! GPU times of pictures, and the latency from an input event to the picture that shows its effect.
//!
//! A busy window receives events late, and the system does not tell when they occurred. The earliest possible time is
//! assumed for each, so latencies are never underestimated, except for the time that the system itself takes.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::eye_pass::renderer::GpuMs;

/// Number of pictures kept.
pub const PICTURES: usize = 120;

/// GPU times of the last pictures, oldest first. If the times of several pictures arrive together, only the latest
/// are recorded.
#[derive(Clone, Debug, Default)]
pub struct FrameTimes {
    pictures: VecDeque<GpuMs>,
    made: Option<FrameStats>,
}

/// How the picture shown was rendered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameStats {
    /// Pixels of the traced image per pixel along a side; `None` if nothing specular is in view.
    pub traced_scale: Option<f64>,
    /// Number of samples in its mean.
    pub samples: u32,
}

impl FrameTimes {
    /// Adds the times of a picture; drops the oldest at the limit.
    pub fn push(&mut self, ms: GpuMs) {
        if self.pictures.len() == PICTURES {
            self.pictures.pop_front();
        }
        self.pictures.push_back(ms);
    }

    pub fn set_made(&mut self, made: FrameStats) {
        self.made = Some(made);
    }

    pub fn made(&self) -> Option<FrameStats> {
        self.made
    }

    /// Oldest first.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &GpuMs> {
        self.pictures.iter()
    }

    pub fn newest(&self) -> Option<&GpuMs> {
        self.pictures.back()
    }

    /// Longest total time of a picture [ms]; 0 if there is none.
    pub fn longest_ms(&self) -> f64 {
        self.iter().copied().map(sum_ms).fold(0.0, f64::max)
    }
}

/// Total time of all passes [ms].
pub fn sum_ms(ms: GpuMs) -> f64 {
    ms.opaque + ms.specular + ms.tone_mapping
}

/// Number of latencies kept of each kind.
const MAX_WAITS: usize = 10_000;
/// If asking the system for events blocked for longer than this, no events were pending.
const WAITED: Duration = Duration::from_millis(1);

/// Percentiles of latencies: the smallest latency that the given fraction does not exceed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Percentiles {
    /// Number of latencies, ≥ 1.
    pub count: usize,
    /// Median [ms].
    pub p50_ms: f64,
    pub p95_ms: f64,
    pub p99_ms: f64,
    pub max_ms: f64,
}

impl Percentiles {
    /// `None` without latencies.
    pub fn of(waits: impl IntoIterator<Item = Duration>) -> Option<Self> {
        let mut sorted: Vec<_> = waits.into_iter().collect();
        sorted.sort_unstable();
        let last = sorted.len().checked_sub(1)?;
        // Rounded up: 95 % of 20 are 19.
        let at = |percent: usize| 1e3 * sorted[(percent * sorted.len()).div_ceil(100) - 1].as_secs_f64();
        Some(Self {
            count: sorted.len(),
            p50_ms: at(50),
            p95_ms: at(95),
            p99_ms: at(99),
            max_ms: 1e3 * sorted[last].as_secs_f64(),
        })
    }
}

/// Latencies from events to frames, with those during a bake kept apart.
#[derive(Clone, Debug, Default)]
pub struct Latencies {
    while_baking: VecDeque<Duration>,
    otherwise: VecDeque<Duration>,
    /// Events that no frame has shown yet: earliest possible time, and whether a bake was running.
    pending: Vec<(Instant, bool)>,
    /// Start of the present turn of the event loop.
    turn: Option<Instant>,
    /// End of the previous turn.
    ended: Option<Instant>,
    /// Earliest possible time of events received in the present turn.
    earliest: Option<Instant>,
}

impl Latencies {
    /// Begins a turn of the event loop: the system was asked for events.
    pub fn begin_turn(&mut self, now: Instant) {
        let has_waited = self.ended.is_some_and(|ended| now.duration_since(ended) > WAITED);
        // Otherwise events may have occurred during the previous turn.
        let earliest = if has_waited { None } else { self.turn };
        self.earliest = earliest.or(Some(now));
        self.turn = Some(now);
    }

    /// Ends a turn of the event loop: the system will be asked next.
    pub fn end_turn(&mut self, now: Instant) {
        self.ended = Some(now);
    }

    /// Records an event whose effect the next frame will show.
    pub fn meet(&mut self, now: Instant, is_baking: bool) {
        self.pending.push((self.earliest.unwrap_or(now), is_baking));
    }

    /// Records that a frame was presented that shows the effect of all events so far.
    pub fn show(&mut self, now: Instant) {
        for (came, is_baking) in self.pending.drain(..) {
            let waits = if is_baking {
                &mut self.while_baking
            } else {
                &mut self.otherwise
            };
            if waits.len() == MAX_WAITS {
                waits.pop_front();
            }
            waits.push_back(now.duration_since(came));
        }
    }

    /// Latencies during bakes; `None` if there are none.
    pub fn while_baking(&self) -> Option<Percentiles> {
        Percentiles::of(self.while_baking.iter().copied())
    }

    /// Latencies at other times; `None` if there are none.
    pub fn otherwise(&self) -> Option<Percentiles> {
        Percentiles::of(self.otherwise.iter().copied())
    }
}
