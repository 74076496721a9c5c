//! Picture quality against frame rate: pictures, and mirrors and glass in them, are coarser while the camera moves and
//! frames are late, and at rest the picture averages many samples.

use std::time::{Duration, Instant};

use crate::eye_pass::renderer::{EyeQuality, TimedFrame};

/// Resolutions from coarse to fine, along a side: pixels of the picture per pixel of the window, and pixels of the traced
/// image per pixel of the picture.
const SCALES: [(f64, f64); 6] = [
    (0.25, 0.5),
    (0.5, 0.5),
    (1.0, 0.25),
    (1.0, 0.5),
    (1.0, 1.0),
    (1.0, 2.0),
];
/// Index of the coarsest scale at which the picture has all pixels of the window. Those below are for devices that are
/// too slow even for surfaces without mirrors and glass: software.
const SHARP: usize = 2;
/// Index of the scale before any time is known.
const WHOLE: usize = 4;
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

/// Quality of a picture of the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureQuality {
    /// Pixels of the picture per pixel of the window, along a side, (0, 1].
    pub scale: f64,
    pub eye: EyeQuality,
}

impl PictureQuality {
    fn new((scale, traced_scale): (f64, f64), eye: EyeQuality) -> Self {
        let eye = EyeQuality { traced_scale, ..eye };
        Self { scale, eye }
    }
}

/// Chooses the quality of each picture from the GPU times of earlier ones.
#[derive(Clone, Debug)]
pub struct Pace {
    /// Indices into [`SCALES`].
    walking: usize,
    waiting: usize,
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
            waiting: WHOLE,
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
            waiting: 1,
            resting: SHARP + 1,
            ..Self::default()
        }
    }

    /// Quality while the view changes.
    pub fn walking(&self) -> PictureQuality {
        PictureQuality::new(SCALES[self.walking], EyeQuality::WALKING)
    }

    /// Quality of a view that rests while a bake goes on, with which a software rasterizer shares the cores.
    pub fn waiting(&self) -> PictureQuality {
        PictureQuality::new(SCALES[self.waiting], EyeQuality::WALKING)
    }

    /// Quality while the view rests.
    pub fn resting(&self) -> PictureQuality {
        PictureQuality::new(SCALES[self.resting], EyeQuality::STILL)
    }

    /// Adapts the scales to the GPU time of a frame, of a window of some width [pixels]. Frames of pictures at rest are
    /// ignored: a change of their scale would discard the samples taken so far.
    pub fn learn(&mut self, frame: &TimedFrame, window_width: u32) {
        let TimedFrame { ms, quality, width } = frame;
        // Frames that are read back have no tone mapping, and are too small to tell anything.
        if quality.branching_depth != EyeQuality::WALKING.branching_depth || ms.tone_mapping == 0.0 {
            return;
        }
        let drawn_scale = f64::from(*width) / f64::from(window_width.max(1));
        let expected_ms = |index: usize| {
            let (scale, traced_scale) = SCALES[index];
            let ratio = scale / drawn_scale;
            let traced_ratio = ratio * traced_scale / quality.traced_scale;
            (ms.opaque + ms.tone_mapping) * ratio * ratio + ms.specular * traced_ratio * traced_ratio
        };
        let finest_within = |limit_ms: f64| {
            (0..SCALES.len())
                .rev()
                .find(|index| expected_ms(*index) <= limit_ms)
        };

        // Frames without mirrors and glass tell nothing about what tracing costs.
        let finest = if ms.specular > 0.0 {
            SCALES.len() - 1
        } else {
            self.walking.max(SHARP)
        };
        if expected_ms(self.walking) > LATE_MS {
            self.walking = finest_within(LATE_MS).unwrap_or(0).min(self.walking);
        } else if let Some(finer) = finest_within(EARLY_MS) {
            self.walking = finer.min(finest).max(self.walking);
        }
        if ms.specular > 0.0 {
            // The mean of many samples needs no supersampled tracing.
            let within = finest_within(REST_MS).unwrap_or(0).min(WHOLE);
            (self.waiting, self.resting) = (within.max(1), within.max(SHARP));
        }
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
