//! How well pictures are made so that none is waited for: what is seen in mirrors and through glass is traced more
//! coarsely while the camera moves and frames run late, and the picture at rest becomes a mean of many.

use std::time::{Duration, Instant};

use crate::eye_pass::renderer::{EyeQuality, GpuMs};

/// Traced pixels per pixel along a side that are chosen from.
const SCALES: [f64; 4] = [0.25, 0.5, 1.0, 2.0];
/// The scale of pictures before anything is known.
const WHOLE: usize = 2;
/// A picture of a walk that takes longer than this [ms] is late.
const LATE_MS: f64 = 33.0;
/// A finer picture has to be expected within this [ms].
const EARLY_MS: f64 = 14.0;
/// What a picture at rest may take [ms]: the next key press waits for it.
const REST_MS: f64 = 250.0;
/// Pictures whose mean the picture at rest becomes.
const MAX_SAMPLES: u32 = 64;
/// As many are made in any case, however long they take.
const MIN_SAMPLES: u32 = 4;
/// Nothing is refined for so long after a key or the mouse was used.
const PAUSE: Duration = Duration::from_millis(400);
/// For how long further ones are made.
const REFINES_FOR: Duration = Duration::from_secs(2);

/// Chooses the quality of each picture from the times of those before.
#[derive(Clone, Debug)]
pub struct Pace {
    walking: usize,
    resting: usize,
    /// When the picture at rest was first drawn.
    rests_since: Option<Instant>,
    /// When a hand last moved.
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
    /// For a device that is software, before anything is known of it.
    pub fn of_software() -> Self {
        Self {
            walking: 0,
            resting: 1,
            rests_since: None,
            touched: None,
        }
    }

    /// While the view changes.
    pub fn walking(&self) -> EyeQuality {
        EyeQuality {
            traced_scale: SCALES[self.walking],
            ..EyeQuality::WALKING
        }
    }

    /// While it does not.
    pub fn resting(&self) -> EyeQuality {
        EyeQuality {
            traced_scale: SCALES[self.resting],
            ..EyeQuality::STILL
        }
    }

    /// Takes up what a picture of a quality took. Pictures at rest teach nothing: they would change how the next one is
    /// made, and so be thrown away.
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
        // A mean of many is fine enough without being traced finer than the picture.
        self.resting = finest_within(REST_MS).unwrap_or(0).min(WHOLE);
    }

    /// The view has changed.
    pub fn moves(&mut self) {
        self.rests_since = None;
    }

    /// A key or the mouse was used: what follows is not to wait for a picture.
    pub fn touch(&mut self, now: Instant) {
        self.touched = Some(now);
    }

    /// How long the picture at rest is left as it is for the sake of hands.
    pub fn pause(&self, now: Instant) -> Duration {
        let since = self.touched.map_or(PAUSE, |touched| now.duration_since(touched));
        PAUSE.saturating_sub(since)
    }

    /// Whether the mean of so many pictures of a view at rest is to be made better.
    pub fn refines(&mut self, samples: u32, now: Instant) -> bool {
        let since = *self.rests_since.get_or_insert(now);
        samples < MIN_SAMPLES || (samples < MAX_SAMPLES && now.duration_since(since) < REFINES_FOR)
    }
}
