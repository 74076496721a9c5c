//! How well a picture is made: what a slow device may trade for time.

/// Quality of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeQuality {
    /// Traced pixels per pixel, across and down, [1/8, 4]: below 1 what is seen in mirrors and through glass is coarser
    /// than the picture, above 1 each pixel is a mean.
    pub traced_scale: f64,
    /// Up to this many specular surfaces on a chain, at most 4, both ways on are followed, and after them the one that
    /// carries more.
    pub branching_depth: u32,
    /// Whether maps and textures are looked up as coarsely as they are seen; else always at their finest, as the CPU
    /// eye pass does.
    pub minifies: bool,
}

impl EyeQuality {
    /// For pictures of a walk.
    pub const WALKING: Self = Self {
        traced_scale: 1.0,
        branching_depth: 2,
        minifies: true,
    };
    /// For pictures that are kept.
    pub const STILL: Self = Self {
        branching_depth: 4,
        ..Self::WALKING
    };

    /// Within the ranges above; what is no number becomes the least.
    #[must_use]
    pub fn clamped(self) -> Self {
        let traced_scale = if self.traced_scale.is_nan() {
            0.125
        } else {
            self.traced_scale.clamp(0.125, 4.0)
        };
        Self {
            traced_scale,
            branching_depth: self.branching_depth.min(super::chains::MOST_BRANCHING),
            ..self
        }
    }
}

impl Default for EyeQuality {
    fn default() -> Self {
        Self::WALKING
    }
}

/// Where in its pixels a picture is looked at, and how finely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    /// From the pixel's centre, right and down [pixels].
    pub(super) offset: [f64; 2],
    /// Added to the level of images.
    pub(super) level_bias: f64,
    /// Number of the picture among those of its view, which chooses its wavelengths.
    pub(super) picture: u32,
}

impl Sample {
    /// The pixel's centre.
    pub(super) const CENTRE: Self = Self {
        offset: [0.0; 2],
        level_bias: 0.0,
        picture: 0,
    };

    /// The same for the traced picture: where it is coarser than the picture, its own pixels are shared out.
    pub(super) fn traced_offset(self, quality: EyeQuality) -> [f64; 2] {
        self.offset.map(|offset| offset / quality.traced_scale.min(1.0))
    }

    /// One of `side`² places that share out a pixel evenly, those of the CPU eye pass, in turn.
    pub(super) fn of_grid(index: u32, side: u32) -> Self {
        let place = |index: u32| (f64::from(index) + 0.5) / f64::from(side) - 0.5;
        Self {
            offset: [place(index % side), place(index / side % side)],
            level_bias: -f64::from(side).log2(),
            // Many pictures are made: none has to show all colours by itself.
            picture: index + 1,
        }
    }

    /// A further place of a sequence that fills pixels evenly however long it is (M. Roberts, "The Unreasonable
    /// Effectiveness of Quasirandom Sequences", 2018: R2).
    pub(super) fn of_sequence(index: u32) -> Self {
        const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
        Self {
            offset: STEPS.map(|step| (0.5 + step * f64::from(index)).fract() - 0.5),
            // A pixel's mean blurs enough by itself.
            level_bias: -1.0,
            picture: index,
        }
    }
}
