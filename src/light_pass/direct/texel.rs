//! What is known of a texel while its direct light is gathered.

use glam::DVec2;

use crate::optics::LinearSrgb;

/// Which lights reach a texel, small enough to be kept for a whole map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lit(u32);

impl Lit {
    /// No surface is there.
    pub const EMPTY: Self = Self(0);
    /// Some samples see what others do not.
    pub const MIXED: Self = Self(1);

    /// After one more sample that sees the lights of a mask.
    pub fn and(self, mask: u64) -> Self {
        let sample = Self((mask % u64::from(u32::MAX - 2)) as u32 + 2);
        match self {
            Self::EMPTY => sample,
            seen if seen == sample => seen,
            _ => Self::MIXED,
        }
    }
}

/// Sums over the samples of one texel that lie on the surface.
#[derive(Clone, Copy, Debug)]
pub struct TexelSum {
    /// Σ E·A [W], every sample standing for the same part of the texel.
    pub flux: LinearSrgb,
    /// Σ A [m²].
    pub area_m2: f64,
    pub lit: Lit,
    pub largest: Option<Part>,
}

/// The largest part of a texel that is covered by one triangle: what is looked at where no sample lies on the surface.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub triangle: u32,
    pub area_m2: f64,
    pub middle: DVec2,
}

impl TexelSum {
    pub const EMPTY: Self = Self {
        flux: LinearSrgb::BLACK,
        area_m2: 0.0,
        lit: Lit::EMPTY,
        largest: None,
    };

    pub fn add(&mut self, sample: Sample, area_m2: f64) {
        self.flux += sample.irradiance * area_m2;
        self.area_m2 += area_m2;
        self.lit = self.lit.and(sample.mask);
    }

    pub fn finished(&self) -> Texel {
        Texel {
            irradiance: (self.flux / self.area_m2).to_array().map(|e| e as f32),
            lit: self.lit,
        }
    }
}

/// What arrives at one point.
pub struct Sample {
    /// E [W/m²].
    pub irradiance: LinearSrgb,
    /// The lights that reach it, folded into a number.
    pub mask: u64,
    pub shadow_rays: u64,
}

/// What a pass says of a texel.
#[derive(Clone, Copy, Debug)]
pub struct Texel {
    pub irradiance: [f32; 3],
    pub lit: Lit,
}

/// The covered texels of one row that were asked for, by column.
#[derive(Debug, Default)]
pub struct Row {
    pub texels: Vec<(u32, Texel)>,
    pub shadow_rays: u64,
    pub cancelled: bool,
}
