//! The state of a texel while its direct light is gathered.

use glam::DVec2;

use crate::optics::LinearSrgb;

/// How thoroughly a texel is looked at.
#[derive(Clone, Copy, Debug)]
pub struct SamplingDetail {
    /// Places across and down.
    pub side: usize,
    /// Samples of a lamp with extent, over all places.
    pub samples_of_lamp: usize,
    /// And of a sky.
    pub samples_of_sky: usize,
}

impl SamplingDetail {
    /// Where lights with extent are seen whole or not at all.
    pub const GLANCE: Self = Self::new(2, 8, 8);
    /// Where light is all there or all away, or fades little.
    pub const COARSE: Self = Self::new(2, 64, 64);
    /// At a border between light and shadow, in texels that were divided for it.
    pub const SMALL: Self = Self::new(4, 64, 128);
    /// At a border that lies within a texel.
    pub const FINE: Self = Self::new(8, 256, 512);

    const fn new(side: usize, samples_of_lamp: usize, samples_of_sky: usize) -> Self {
        Self {
            side,
            samples_of_lamp,
            samples_of_sky,
        }
    }
}

/// Which lights reach a texel, small enough to be kept for a whole map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightsOfTexel(u32);

impl LightsOfTexel {
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

    /// Whether others are lit otherwise, or parts of this.
    pub fn differs(self, mut others: impl Iterator<Item = Self>) -> bool {
        self == Self::MIXED
            || self != Self::EMPTY && others.any(|other| other != Self::EMPTY && other != self)
    }
}

/// A light's part of a mask: masks of different sets of lights differ however many lights there are (SplitMix64).
pub fn mark_of(light: usize) -> u64 {
    let mut bits = (light as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ bits >> 31
}

/// Sums over the samples of one texel that lie on the surface.
#[derive(Clone, Copy, Debug)]
pub struct TexelSum {
    /// Σ E·A [W], every sample standing for the same part of the texel.
    pub flux: LinearSrgb,
    /// Σ A [m²].
    pub area_m2: f64,
    pub lit: LightsOfTexel,
    /// The same of lights with extent: mixed where one is partly hidden.
    pub soft_lit: LightsOfTexel,
    pub largest: Option<LargestOverlap>,
    /// Of lights with extent.
    pub soft: Spread,
}

/// How values differ from each other.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spread {
    count: f64,
    sum: f64,
    squares: f64,
}

/// Standard error of a texel's mean, as a share of it, above which it is looked at once more.
const LARGEST_NOISE: f64 = 0.02;

impl Spread {
    fn add(&mut self, value: f64) {
        self.count += 1.0;
        self.sum += value;
        self.squares += value * value;
    }

    /// Whether the mean of the values may be off by more than [`LARGEST_NOISE`] of `whole`. A lone value says nothing
    /// of itself.
    fn is_uncertain(&self, whole: f64) -> bool {
        if self.count < 2.0 {
            return self.sum > 0.0;
        }
        let mean = self.sum / self.count;
        let variance = (self.squares / self.count - mean * mean).max(0.0) / (self.count - 1.0);
        variance.sqrt() > LARGEST_NOISE * whole
    }
}

/// The largest part of a texel that is covered by one triangle: what is looked at where no sample lies on the surface.
#[derive(Clone, Copy, Debug)]
pub struct LargestOverlap {
    pub triangle: u32,
    pub area_m2: f64,
    pub middle: DVec2,
}

impl TexelSum {
    pub const EMPTY: Self = Self {
        flux: LinearSrgb::BLACK,
        area_m2: 0.0,
        lit: LightsOfTexel::EMPTY,
        soft_lit: LightsOfTexel::EMPTY,
        largest: None,
        soft: Spread {
            count: 0.0,
            sum: 0.0,
            squares: 0.0,
        },
    };

    pub fn add(&mut self, sample: Sample, area_m2: f64) {
        self.flux += sample.irradiance * area_m2;
        self.area_m2 += area_m2;
        self.lit = self.lit.and(sample.mask);
        self.soft_lit = match sample.soft_mask {
            Some(mask) => self.soft_lit.and(mask),
            None => LightsOfTexel::MIXED,
        };
        self.soft.add(sample.soft);
    }

    pub fn finished(&self) -> Texel {
        Texel {
            irradiance: (self.flux / self.area_m2).to_array().map(|e| e as f32),
            lit: self.lit,
            soft_lit: self.soft_lit,
            is_uncertain: self.soft.is_uncertain((self.flux / self.area_m2).luminance()),
        }
    }
}

/// What arrives at one point.
pub struct Sample {
    /// E [W/m²].
    pub irradiance: LinearSrgb,
    /// The points and directions that reach it, folded into a number.
    pub mask: u64,
    /// The lights with extent that are seen whole; `None` where one is partly hidden.
    pub soft_mask: Option<u64>,
    /// Luminance of what comes from lights with extent [W/m²].
    pub soft: f64,
    pub shadow_rays: u64,
}

/// What a pass says of a texel.
#[derive(Clone, Copy, Debug)]
pub struct Texel {
    pub irradiance: [f32; 3],
    pub lit: LightsOfTexel,
    pub soft_lit: LightsOfTexel,
    /// Whether lights with extent were looked for with too few samples.
    pub is_uncertain: bool,
}

impl Texel {
    /// Where nothing was looked at.
    pub const DARK: Self = Self {
        irradiance: [0.0; 3],
        lit: LightsOfTexel::EMPTY,
        soft_lit: LightsOfTexel::EMPTY,
        is_uncertain: false,
    };

    /// Whether it asks for another look: some of its neighbours or its parts are lit otherwise, or too little is known.
    pub fn is_unclear<Around: Iterator<Item = Self>>(&self, around: impl Fn() -> Around) -> bool {
        let differs = |lit: fn(&Self) -> LightsOfTexel| lit(self).differs(around().map(|other| lit(&other)));
        self.is_uncertain || differs(|texel| texel.lit) || differs(|texel| texel.soft_lit)
    }
}

/// The covered texels of one row that were asked for, by column.
#[derive(Debug, Default)]
pub struct TexelRow {
    pub texels: Vec<(u32, Texel)>,
    pub shadow_rays: u64,
    pub cancelled: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shadows_of_lights_64_apart_do_not_cancel() {
        let both = mark_of(0) ^ mark_of(64);
        for other in [0, mark_of(0), mark_of(64)] {
            assert_eq!(LightsOfTexel::EMPTY.and(both).and(other), LightsOfTexel::MIXED);
        }
        assert_ne!(
            LightsOfTexel::EMPTY.and(mark_of(32)),
            LightsOfTexel::EMPTY.and(mark_of(0) ^ mark_of(1))
        );
    }
}
