//! Picture quality against frame rate: mirrors and glass are traced more coarsely while the camera moves and frames are
//! late, and at rest the picture averages many samples.

use std::time::{Duration, Instant};

use crate::eye_pass::renderer::{EyeQuality, GpuMs};

/// Available resolutions of the traced image, in pixels per pixel of the frame along a side.
const SCALES: [f64; 4] = [0.25, 0.5, 1.0, 2.0];
/// Index of the scale before any time is known.
const WHOLE: usize = 2;
/// A frame of a moving camera that takes longer than this is late [ms].
const LATE_MS: f64 = 33.0;
/// The scale is raised only if frames are expected to take less than this [ms].
const EARLY_MS: f64 = 14.0;
/// Limit of the GPU time of a picture at rest [ms]: the next key press waits for it.
const REST_MS: f64 = 250.0;
/// Largest number of samples of a picture at rest.
const MAX_SAMPLES: u32 = 64;
/// Smallest number of samples of a picture at rest, however long they take.
const MIN_SAMPLES: u32 = 4;
/// Refinement pauses for this time after input.
const PAUSE: Duration = Duration::from_millis(400);
/// Time for which samples beyond the minimum are added.
const REFINES_FOR: Duration = Duration::from_secs(4);

/// Chooses the quality of each picture from the GPU times of earlier ones.
#[derive(Clone, Debug)]
pub struct Pace {
    walking: usize,
    resting: usize,
    /// When the camera came to rest and refinement began.
    rests_since: Option<Instant>,
    /// Time of the last input.
    touched: Option<Instant>,
}

impl Default for Pace {
    fn default() -> Self {
        Self {
            walking: WHOLE,
            resting: WHOLE,
            rests_since: None,
            touched: None,
        }
    }
}

impl Pace {
    /// Start values for a software rasterizer.
    pub fn of_software() -> Self {
        Self {
            walking: 0,
            resting: 1,
            rests_since: None,
            touched: None,
        }
    }

    /// Quality while the view changes.
    pub fn walking(&self) -> EyeQuality {
        EyeQuality {
            traced_scale: SCALES[self.walking],
            ..EyeQuality::WALKING
        }
    }

    /// Quality while the view rests.
    pub fn resting(&self) -> EyeQuality {
        EyeQuality {
            traced_scale: SCALES[self.resting],
            ..EyeQuality::STILL
        }
    }

    /// Adapts the scales to the GPU time of a picture of a given quality. Times of pictures at rest are ignored: a
    /// change of their scale would discard the samples taken so far.
    pub fn learn(&mut self, ms: GpuMs, quality: EyeQuality) {
        let traced_scale = quality.traced_scale;
        if ms.specular <= 0.0 || quality.branching_depth != EyeQuality::WALKING.branching_depth {
            return;
        }
        let at = |scale: usize| {
            let ratio = SCALES[scale] / traced_scale;
            ms.opaque + ms.tone_mapping + ms.specular * ratio * ratio
        };
        let finest_within = |limit_ms: f64| (0..SCALES.len()).rev().find(|scale| at(*scale) <= limit_ms);
        if at(self.walking) > LATE_MS {
            self.walking = finest_within(LATE_MS).unwrap_or(0).min(self.walking);
        } else if let Some(finer) = finest_within(EARLY_MS) {
            self.walking = finer.max(self.walking);
        }
        // The mean of many samples needs no supersampled tracing.
        self.resting = finest_within(REST_MS).unwrap_or(0).min(WHOLE);
    }

    /// The view has changed.
    pub fn moves(&mut self) {
        self.rests_since = None;
    }

    /// The user has pressed a key or used the mouse: the response must not wait for a picture.
    pub fn touch(&mut self, now: Instant) {
        self.touched = Some(now);
    }

    /// Remaining time of the pause after input.
    pub fn pause(&self, now: Instant) -> Duration {
        let since = self.touched.map_or(PAUSE, |touched| now.duration_since(touched));
        PAUSE.saturating_sub(since)
    }

    /// Whether to add a sample to a picture at rest that is the mean of `samples`.
    pub fn refines(&mut self, samples: u32, now: Instant) -> bool {
        let since = *self.rests_since.get_or_insert(now);
        samples < MIN_SAMPLES || (samples < MAX_SAMPLES && now.duration_since(since) < REFINES_FOR)
    }
}
