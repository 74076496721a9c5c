//! How long the last pictures took on the graphics device.

use std::collections::VecDeque;

use crate::eye_pass::renderer::GpuMs;

/// Pictures that are remembered.
pub const PICTURES: usize = 120;

/// Times of the last pictures that the device has told of, the oldest first. A picture whose times come back together
/// with those of a later one is left out.
#[derive(Clone, Debug, Default)]
pub struct FrameTimes {
    pictures: VecDeque<GpuMs>,
    made: Option<Made>,
}

/// How the picture that is shown was made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Made {
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
    pub fn set_made(&mut self, made: Made) {
        self.made = Some(made);
    }

    /// How the picture that is shown was made.
    pub fn made(&self) -> Option<Made> {
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
