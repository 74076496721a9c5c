//! GPU times of pictures, and the latency from an input event to the picture that shows its effect.
//!
//! A window that is busy meets events late, and nobody tells it when they came. Each is taken to have come at the
//! earliest moment that it can have: what is said here is never too short, but for the way through the system.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::eye_pass::renderer::GpuMs;

/// Pictures that are remembered.
pub const PICTURES: usize = 120;

/// Times of the last pictures that the device has told of, the oldest first. A picture whose times come back together
/// with those of a later one is left out.
#[derive(Clone, Debug, Default)]
pub struct FrameTimes {
    pictures: VecDeque<GpuMs>,
    made: Option<FrameStats>,
}

/// How the picture that is shown was made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameStats {
    /// Traced pixels per pixel along a side; `None` where nothing specular is in view.
    pub traced_scale: Option<f64>,
    /// Pictures of which it is the mean.
    pub samples: u32,
}

impl FrameTimes {
    /// One more; the oldest goes where there are too many.
    pub fn push(&mut self, ms: GpuMs) {
        if self.pictures.len() == PICTURES {
            self.pictures.pop_front();
        }
        self.pictures.push_back(ms);
    }

    /// Says how the picture that is shown was made.
    pub fn set_made(&mut self, made: FrameStats) {
        self.made = Some(made);
    }

    /// How the picture that is shown was made.
    pub fn made(&self) -> Option<FrameStats> {
        self.made
    }

    /// The oldest first.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &GpuMs> {
        self.pictures.iter()
    }

    /// The last one.
    pub fn newest(&self) -> Option<&GpuMs> {
        self.pictures.back()
    }

    /// The longest of all passes together [ms]; 0 where there is none.
    pub fn longest_ms(&self) -> f64 {
        self.iter().copied().map(sum_ms).fold(0.0, f64::max)
    }
}

/// All passes of a picture [ms].
pub fn sum_ms(ms: GpuMs) -> f64 {
    ms.opaque + ms.specular + ms.tone_mapping
}

/// Waits that are remembered of each kind: the last ones.
const MAX_WAITS: usize = 10_000;
/// Whoever asks the system for events and gets none at once has met all that came before.
const WAITED: Duration = Duration::from_millis(1);

/// Waits of one kind, from the shortest to the longest: the least that so many of them do not exceed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Percentiles {
    /// How many there are; at least 1.
    pub count: usize,
    /// Of half of them [ms].
    pub p50_ms: f64,
    /// Of 95 % [ms].
    pub p95_ms: f64,
    /// Of 99 % [ms].
    pub p99_ms: f64,
    /// The longest [ms].
    pub max_ms: f64,
}

impl Percentiles {
    /// Of some waits; `None` where there are none.
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

/// Waits between events and frames, those during a bake and the others apart.
#[derive(Clone, Debug, Default)]
pub struct Latencies {
    while_baking: VecDeque<Duration>,
    otherwise: VecDeque<Duration>,
    /// Events that no frame has shown yet: when they can have come, and whether a bake ran.
    pending: Vec<(Instant, bool)>,
    /// When the present turn of events and frames began.
    turn: Option<Instant>,
    /// When the turn before it ended.
    ended: Option<Instant>,
    /// The earliest moment at which events of the present turn can have come.
    earliest: Option<Instant>,
}

impl Latencies {
    /// A turn begins: the system has been asked for events.
    pub fn begin_turn(&mut self, now: Instant) {
        let has_waited = self.ended.is_some_and(|ended| now.duration_since(ended) > WAITED);
        // Otherwise they may have come while the turn before was at work.
        let earliest = if has_waited { None } else { self.turn };
        self.earliest = earliest.or(Some(now));
        self.turn = Some(now);
    }

    /// The turn ends: the system is asked next.
    pub fn end_turn(&mut self, now: Instant) {
        self.ended = Some(now);
    }

    /// An event is met that the next frame is to show.
    pub fn meet(&mut self, now: Instant, is_baking: bool) {
        self.pending.push((self.earliest.unwrap_or(now), is_baking));
    }

    /// A frame was handed to the system that shows all that was met.
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

    /// Of events during a bake.
    pub fn while_baking(&self) -> Option<Percentiles> {
        Percentiles::of(self.while_baking.iter().copied())
    }

    /// Of all others.
    pub fn otherwise(&self) -> Option<Percentiles> {
        Percentiles::of(self.otherwise.iter().copied())
    }
}
