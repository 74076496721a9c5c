//! The state of a texel while its direct light is gathered.

use glam::DVec2;

use crate::geometry::sampling::{GOLDEN_64, mix64};
use crate::optics::{LinearSrgb, luminance};

/// Numbers of samples per texel.
#[derive(Clone, Copy, Debug)]
pub struct SamplingDetail {
    /// Sample points across and down.
    pub side: usize,
    /// Samples of an extended light, over all sample points.
    pub samples_of_lamp: usize,
    /// Samples of a sky, over all sample points.
    pub samples_of_sky: usize,
}

impl SamplingDetail {
    /// Enough where extended lights are fully visible or fully occluded.
    pub const GLANCE: Self = Self::new(2, 8, 8);
    /// Enough where all lights are fully visible or fully occluded, or penumbrae are wide.
    pub const COARSE: Self = Self::new(2, 64, 64);
    /// For small texels at a shadow border.
    pub const SMALL: Self = Self::new(4, 64, 128);
    /// For a texel that a shadow border crosses.
    pub const FINE: Self = Self::new(8, 256, 512);

    const fn new(side: usize, samples_of_lamp: usize, samples_of_sky: usize) -> Self {
        Self {
            side,
            samples_of_lamp,
            samples_of_sky,
        }
    }
}

/// Fingerprint of the lights that reach a texel, small enough to be stored for a whole map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightsOfTexel(u32);

impl LightsOfTexel {
    /// No sample lies on a surface.
    pub const EMPTY: Self = Self(0);
    /// Samples see different lights.
    pub const MIXED: Self = Self(1);

    /// Adds a sample that sees the lights of a mask.
    pub fn and(self, mask: u64) -> Self {
        let sample = Self((mask % u64::from(u32::MAX - 2)) as u32 + 2);
        match self {
            Self::EMPTY => sample,
            seen if seen == sample => seen,
            _ => Self::MIXED,
        }
    }

    /// Whether visibility differs within the texel, or between it and others that lie on a surface.
    pub fn differs(self, mut others: impl Iterator<Item = Self>) -> bool {
        self == Self::MIXED
            || self != Self::EMPTY && others.any(|other| other != Self::EMPTY && other != self)
    }
}

/// A light's mark in a mask. XOR combines marks; masks of different sets differ for any number of lights (SplitMix64).
pub fn mark_of(light: usize) -> u64 {
    mix64((light as u64 + 1).wrapping_mul(GOLDEN_64))
}

/// Sums over the samples of one texel that lie on the surface.
#[derive(Clone, Copy, Debug)]
pub struct TexelSum {
    /// Σ E·A [W]. Each sample stands for an equal part of the texel.
    pub flux: LinearSrgb,
    /// Σ A [m²].
    pub area_m2: f64,
    pub lit: LightsOfTexel,
    /// The extended lights that reach the texel; mixed if one is partly occluded.
    pub soft_lit: LightsOfTexel,
    pub largest: Option<LargestOverlap>,
    /// Luminance of extended lights.
    pub soft: Spread,
}

/// Running sums for a mean and its standard error.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spread {
    count: f64,
    sum: f64,
    squares: f64,
}

/// Nine texels lie on a plane if their squared deviations from it sum to no more than this many variances of one: 95 %
/// of χ² with the six degrees of freedom that a plane leaves.
const MAX_DEVIATION: f64 = 12.6;

/// Squared standard error of four samples at (±1/4, ±1/4) of a texel, without noise, over the square of the slope per
/// texel.
const SHARE_OF_SLOPE: f64 = 1.0 / 48.0;

/// The largest of nine variances over their median, above which an edge runs through that texel.
const MAX_UNEVENNESS: f64 = 8.0;

/// Standard error relative to a texel's mean above which it is sampled again.
const LARGEST_NOISE: f64 = 0.02;

impl Spread {
    fn add(&mut self, value: f64) {
        self.count += 1.0;
        self.sum += value;
        self.squares += value * value;
    }

    /// Whether the standard error of the mean exceeds [`LARGEST_NOISE`] of `whole`. A single value has no error
    /// estimate and counts as uncertain unless it is 0.
    fn is_uncertain(&self, whole: f64) -> bool {
        if self.count < 2.0 {
            return self.sum > 0.0;
        }
        self.variance().sqrt() > LARGEST_NOISE * whole
    }

    /// Squared standard error of the mean; 0 for fewer than two values.
    fn variance(&self) -> f64 {
        if self.count < 2.0 {
            return 0.0;
        }
        let mean = self.sum / self.count;
        (self.squares / self.count - mean * mean).max(0.0) / (self.count - 1.0)
    }
}

/// The largest overlap of a texel with one triangle. Its centroid is sampled where no regular sample lies on the
/// surface.
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
            variance: self.soft.variance() as f32,
        }
    }
}

/// Direct light at one point.
pub struct Sample {
    /// E [W/m²].
    pub irradiance: LinearSrgb,
    /// XOR of the marks ([`mark_of`]) of the point lights and suns that reach the point.
    pub mask: u64,
    /// XOR of the marks of the extended lights that are fully visible; `None` if one is partly occluded.
    pub soft_mask: Option<u64>,
    /// Luminance of the irradiance from extended lights [W/m²].
    pub soft: f64,
    pub shadow_rays: u64,
}

/// State of a texel after a pass.
#[derive(Clone, Copy, Debug)]
pub struct Texel {
    pub irradiance: [f32; 3],
    pub lit: LightsOfTexel,
    pub soft_lit: LightsOfTexel,
    /// Whether extended lights need more samples.
    pub is_uncertain: bool,
    /// Squared standard error of the luminance from extended lights [W²/m⁴].
    pub variance: f32,
}

impl Texel {
    /// A texel that was not sampled.
    pub const DARK: Self = Self {
        irradiance: [0.0; 3],
        lit: LightsOfTexel::EMPTY,
        soft_lit: LightsOfTexel::EMPTY,
        is_uncertain: false,
        variance: 0.0,
    };

    /// The mean of a texel and the eight around it, if their luminances differ from a plane by no more than their noise:
    /// as good as eight times the samples. `None` as well where point lights or suns are partly occluded.
    pub fn smoothed(square: &[Self; 9]) -> Option<[f32; 3]> {
        let own = square[4].lit;
        let is_alike = |texel: &Self| texel.lit == own && texel.lit != LightsOfTexel::EMPTY;
        if own == LightsOfTexel::MIXED || !square.iter().all(is_alike) {
            return None;
        }
        let values = square.map(|texel| luminance(&texel.irradiance));
        let mean = values.iter().sum::<f64>() / 9.0;
        let place = |index: usize| [index % 3, index / 3].map(|along| along as f64 - 1.0);
        let slope = |axis: usize| {
            let part = |(index, value): (usize, &f64)| place(index)[axis] * value;
            values.iter().enumerate().map(part).sum::<f64>() / 6.0
        };
        let [across, down] = [slope(0), slope(1)];
        let deviation = |(index, value): (usize, &f64)| {
            let [x, y] = place(index);
            (value - mean - across * x - down * y).powi(2)
        };
        let squares: f64 = values.iter().enumerate().map(deviation).sum();
        let mut variances = square.map(|texel| f64::from(texel.variance));
        variances.sort_unstable_by(f64::total_cmp);
        let [.., median, _, _, _, largest] = variances;
        // The samples of a texel differ by the plane's slope as well.
        let variance = (median - SHARE_OF_SLOPE * (across * across + down * down)).max(0.0);
        let colour =
            [0, 1, 2].map(|channel| square.iter().map(|texel| texel.irradiance[channel]).sum::<f32>() / 9.0);
        let has_edge = largest > MAX_UNEVENNESS * median;
        (!has_edge && squares <= MAX_DEVIATION * variance).then_some(colour)
    }

    /// Whether the texel needs more samples: visibility differs within it or from its neighbours, or it is too noisy.
    pub fn is_unclear<Around: Iterator<Item = Self>>(&self, around: impl Fn() -> Around) -> bool {
        let differs = |lit: fn(&Self) -> LightsOfTexel| lit(self).differs(around().map(|other| lit(&other)));
        self.is_uncertain || differs(|texel| texel.lit) || differs(|texel| texel.soft_lit)
    }
}

/// The sampled texels of one row that lie on a surface, by column.
#[derive(Debug, Default)]
pub struct TexelRow {
    pub texels: Vec<(u32, Texel)>,
    pub shadow_rays: u64,
    pub cancelled: bool,
    /// Not sampled, since the time was up.
    pub is_late: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nine texels with these irradiances and a variance.
    fn square(irradiance: impl Fn(f64, f64) -> f64, variance: f32) -> [Texel; 9] {
        std::array::from_fn(|index| Texel {
            irradiance: [irradiance((index % 3) as f64 - 1.0, (index / 3) as f64 - 1.0) as f32; 3],
            lit: LightsOfTexel::EMPTY.and(0),
            soft_lit: LightsOfTexel::MIXED,
            is_uncertain: true,
            variance,
        })
    }

    #[test]
    fn noise_is_smoothed_and_structure_is_not() {
        let noise = |x: f64, y: f64| if (x + 3.0 * y) % 2.0 == 0.0 { 0.1 } else { -0.1 };
        let plane = |x: f64, y: f64| 1.0 + 0.05 * x - 0.02 * y;
        let found = Texel::smoothed(&square(|x, y| plane(x, y) + noise(x, y), 0.01)).expect("it is noise");
        assert!((found[0] - 1.0).abs() < 0.02, "{found:?}");
        let step = square(|x, _| if x > 0.0 { 2.0 } else { 1.0 }, 0.01);
        assert!(Texel::smoothed(&step).is_none());
        // Curved light without noise: the samples of a texel differ by its slope alone.
        let steep = square(|x, _| (0.5 * x).exp(), 0.25 / 48.0);
        assert!(Texel::smoothed(&steep).is_none());
        let mut edge = square(plane, 0.01);
        edge[2].variance = 0.1;
        assert!(Texel::smoothed(&edge).is_none());
        let mut shadow = square(plane, 0.01);
        shadow[0].lit = LightsOfTexel::EMPTY.and(mark_of(1));
        assert!(Texel::smoothed(&shadow).is_none());
    }

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
