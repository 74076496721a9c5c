//! Microfacets that rays from the eye scatter at; twin of `shaders/eye_pass/facets.wgsl`.
//!
//! A rough surface shows the mean over its visible microfacets. Each sample of a pixel selects one of them by a point of
//! the unit square. The points of a pixel cover the square evenly, and their offset differs from pixel to pixel, so that
//! what is left of the sampling looks like grain.

use glam::DVec2;

/// Microfacets of a picture per pixel at the first rough surface of a path: the error of their mean is a tenth of the
/// lobe's contrast.
pub const PER_PIXEL: u32 = 64;

/// Fractional parts of 1/ρ and 1/ρ² for ρ³ = ρ + 1, times 2³²: steps of the sequence R2 (M. Roberts, "The Unreasonable
/// Effectiveness of Quasirandom Sequences", 2018).
const STEPS: [u32; 2] = [3_242_174_889, 2_447_445_414];

/// The points of one sample of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct FacetPoints {
    /// Random number of the pixel.
    seed: u32,
    /// Number of its first point among those of the pixel.
    first: u32,
    /// Distance to the number of the next one: samples of the pixel.
    samples: u32,
}

/// The microfacet of one ray at a rough surface, and at those that follow.
#[derive(Clone, Copy, Debug)]
pub struct FacetPoint {
    seed: u32,
    /// Number among the points of the pixel, from 1 on.
    number: u32,
}

impl FacetPoints {
    /// The points of sample number `sample` of `samples` of a pixel.
    pub fn of_sample([column, row]: [u32; 2], sample: u32, samples: u32) -> Self {
        Self {
            seed: scrambled(column.wrapping_add(scrambled(row))),
            first: 1 + sample,
            samples,
        }
    }

    /// Number of points for a share of the pixel. A dim lobe may still hold what is bright, so that its grain would need no
    /// fewer; the square root is a compromise with time.
    pub fn count_for(self, share: f64) -> u32 {
        let most = PER_PIXEL.div_ceil(self.samples);
        ((share.sqrt() * f64::from(most)).ceil() as u32).clamp(1, most)
    }

    pub fn point(self, index: u32) -> FacetPoint {
        FacetPoint {
            seed: self.seed,
            number: self.first + index * self.samples,
        }
    }
}

impl FacetPoint {
    /// A point of the unit square, for a surface that follows after `lobes` rough ones.
    pub fn at(self, lobes: u32) -> DVec2 {
        let along = |axis: u32| {
            let offset = scrambled(self.seed.wrapping_add(2 * lobes + axis));
            // The points of several surfaces have to be independent of each other.
            let place = match lobes {
                0 => offset.wrapping_add(self.number.wrapping_mul(STEPS[axis as usize])),
                _ => scrambled(offset.wrapping_add(self.number)),
            };
            f64::from(place >> 8) / f64::from(1 << 24)
        };
        DVec2::new(along(0), along(1))
    }

    /// Part of a lobe's width that the footprint of the ray keeps: the more rays there are, the less. Small lamps, which
    /// few rays would meet, are thus spread over a part of the lobe that shrinks as rays are added.
    pub fn kept_width(self) -> f64 {
        f64::from(self.number).powf(-1.0 / 6.0)
    }
}

/// A random permutation of all numbers: PCG (Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 2020).
fn scrambled(number: u32) -> u32 {
    let state = number.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}
