//! GPU times of pictures.

use std::collections::VecDeque;

use crate::eye_pass::renderer::GpuMs;

/// Number of pictures kept.
pub const PICTURES: usize = 120;

/// GPU times of the last pictures, oldest first. If the times of several pictures arrive together, only the latest
/// are recorded.
#[derive(Clone, Debug, Default)]
pub struct FrameTimes {
    pictures: VecDeque<GpuMs>,
    /// How the newest was rendered.
    pub made: Option<FrameStats>,
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

    /// Oldest first.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &GpuMs> {
        self.pictures.iter()
    }

    pub fn newest(&self) -> Option<&GpuMs> {
        self.pictures.back()
    }

    /// Longest total time of a picture [ms]; 0 if there is none.
    pub fn longest_ms(&self) -> f64 {
        self.iter().map(GpuMs::sum).fold(0.0, f64::max)
    }
}
