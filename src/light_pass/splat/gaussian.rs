//! Integrals of an elliptical Gaussian over the texels of a window: narrow ones exactly, from the distribution function
//! at the texels' corners; wide ones from their values at the texels' centres.

use glam::DVec2;

use super::bivariate_normal::{BivariateNormal, Borders};
use super::footprint::Ellipse;
use super::kernel::normal_distribution;
use super::numeric::{exp, floor};

/// Most columns or rows of a window.
pub(super) const MAX_TEXELS: usize = 24;

/// Standard deviations that a window reaches; the outermost texels take what lies beyond, below 1e-4 on each side.
const REACH: f64 = 3.75;

/// Standard deviation [texels] above which [`Centred`] errs by less than 1e-4 of the peak.
pub(super) const WIDE_TEXELS: f64 = 2.5;

/// Texels that a small kernel reaches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    /// Column and row of the first texel.
    pub(super) first: (i64, i64),
    /// Columns and rows.
    pub(super) size: (usize, usize),
}

/// Integrates small kernels; reused from kernel to kernel.
#[derive(Debug, Default)]
pub(super) struct Cornered {
    across: Axis,
    down: Axis,
    joint: BivariateNormal,
}

/// Borders between texels along one axis.
#[derive(Debug, Default)]
struct Axis {
    first: i64,
    count: usize,
    /// Border after each texel [standard deviations from the centre].
    border: [f64; MAX_TEXELS],
    /// Share of the kernel before that border; 1 after the last texel.
    below: [f64; MAX_TEXELS],
}

impl Axis {
    /// `step` is 1 / `deviation`. Returns whether the kernel is narrow enough.
    fn set(&mut self, centre: f64, deviation: f64, step: f64) -> bool {
        let first = floor(centre - REACH * deviation);
        let last = floor(centre + REACH * deviation);
        let is_narrow = last - first < MAX_TEXELS as i64;
        if is_narrow {
            self.first = first;
            self.count = (last - first) as usize + 1;
            let first = first as f64;
            for texel in 0..self.count - 1 {
                let border = (first + (texel + 1) as f64 - centre) * step;
                self.border[texel] = border;
                self.below[texel] = normal_distribution(border);
            }
            self.below[self.count - 1] = 1.0;
        }
        is_narrow
    }
}

impl Cornered {
    /// Fills `weights`, row by row, with the integrals of a kernel of the given covariance [texels²] over the texels;
    /// they sum to 1. `None` where the kernel is too wide or too thin for this method.
    pub(super) fn integrate(
        &mut self,
        centre: DVec2,
        covariance: Ellipse,
        weights: &mut Vec<f64>,
    ) -> Option<Block> {
        // In units of its deviations, the kernel is the density of two correlated standard normal variables.
        let Ellipse { xx, xy, yy } = covariance;
        let (x_deviation, y_deviation) = (xx.sqrt(), yy.sqrt());
        let (x_step, y_step) = (1.0 / x_deviation, 1.0 / y_deviation);
        let correlation = xy * (x_step * y_step);
        if correlation.is_nan() || correlation.abs() >= 1.0 {
            return None;
        }

        // Windows have a fixed size: longer kernels are integrated by lines.
        let Self { across, down, joint } = self;
        if !(across.set(centre.x, x_deviation, x_step) && down.set(centre.y, y_deviation, y_step)) {
            return None;
        }

        // The integral over a texel is a difference of the distribution function at its four corners.
        weights.clear();
        let (columns, rows) = (across.count, down.count);
        let borders = Borders {
            at: &across.border[..columns - 1],
            below: &across.below[..columns - 1],
        };
        if rows > 1 {
            joint.set(borders.at, correlation);
        }
        let mut above = [0.0; MAX_TEXELS];
        let mut here = [0.0; MAX_TEXELS];
        for row in 0..rows {
            // Share of the kernel left of each border and above this row's lower border.
            let below = down.below[row];
            if row + 1 < rows {
                joint.shares(borders, down.border[row], below, &mut here[..columns - 1]);
            } else {
                here[..columns].copy_from_slice(&across.below[..columns]);
            }
            here[columns - 1] = below;

            // Differences along the row of what this row adds; rounding may make them negative.
            let mut before = 0.0;
            for (here, above) in here[..columns].iter().zip(&mut above) {
                let left = here - *above;
                weights.push((left - before).max(0.0));
                before = left;
                *above = *here;
            }
        }
        Some(Block {
            first: (across.first, down.first),
            size: (columns, rows),
        })
    }
}

/// Samples a wide kernel at the texels' centres, after convolution with a texel, which adds a variance of 1/12.
#[derive(Clone, Copy, Debug)]
pub(super) struct Centred {
    /// Half the inverse of the covariance.
    half: Ellipse,
}

impl Centred {
    /// For a covariance [texels²].
    pub(super) fn new(covariance: Ellipse) -> Self {
        let Ellipse { xx, xy, yy } = covariance;
        let (xx, yy) = (xx + 1.0 / 12.0, yy + 1.0 / 12.0);
        let scale = 0.5 / (xx * yy - xy * xy);
        Self {
            half: Ellipse {
                xx: yy * scale,
                xy: -xy * scale,
                yy: xx * scale,
            },
        }
    }

    /// Fills the weights of a row of texels whose first centre is at (x, y) from the kernel's: each is the previous one
    /// times a ratio that itself changes by a constant factor.
    pub(super) fn fill_row(&self, x: f64, y: f64, weights: &mut [f64]) {
        let Ellipse { xx, xy, yy } = self.half;
        let mut value = exp(-(xx * x * x + 2.0 * xy * x * y + yy * y * y));
        let mut ratio = exp(-(xx * (2.0 * x + 1.0) + 2.0 * xy * y));
        let change = exp(-2.0 * xx);
        for weight in weights {
            *weight = value;
            value *= ratio;
            ratio *= change;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Midpoint sums over subdivisions of each texel.
    fn by_grid(centre: DVec2, covariance: Ellipse, column: i64, row: i64) -> f64 {
        let Ellipse { xx, xy, yy } = covariance;
        let determinant = xx * yy - xy * xy;
        let n = if determinant < 0.2 * xx * yy { 500 } else { 64 };
        let mut sum = 0.0;
        for j in 0..n {
            for i in 0..n {
                let at = |start: i64, part: i32| start as f64 + (f64::from(part) + 0.5) / f64::from(n);
                let d = DVec2::new(at(column, i), at(row, j)) - centre;
                let square = (yy * d.x * d.x - 2.0 * xy * d.x * d.y + xx * d.y * d.y) / determinant;
                sum += (-0.5 * square).exp();
            }
        }
        sum / (f64::from(n * n) * std::f64::consts::TAU * determinant.sqrt())
    }

    #[test]
    fn small_kernels_are_integrated() {
        let centre = DVec2::new(7.3, 2.85);
        let mut weights = Vec::new();
        let mut cornered = Cornered::default();
        for (x, y) in [(0.12, 0.2), (0.5, 0.3), (0.4, 1.4), (2.4, 1.1)] {
            for correlation in [0.0, 0.2, -0.39, 0.55, -0.75, 0.89, 0.91, -0.93, -0.98, 0.999] {
                let covariance = Ellipse {
                    xx: x * x,
                    xy: correlation * x * y,
                    yy: y * y,
                };
                let found = cornered
                    .integrate(centre, covariance, &mut weights)
                    .expect("small enough");
                assert_eq!(weights.len(), found.size.0 * found.size.1);
                assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-3, "{covariance:?}");
                for (index, weight) in weights.iter().enumerate() {
                    let column = found.first.0 + (index % found.size.0) as i64;
                    let row = found.first.1 + (index / found.size.0) as i64;
                    let exact = by_grid(centre, covariance, column, row);
                    // The outermost texels also take what lies beyond them.
                    assert!(
                        (weight - exact).abs() < 8e-5,
                        "{covariance:?}, {column} {row}: {weight}, {exact}"
                    );
                }
            }
        }
        let wide = Ellipse {
            xx: 100.0,
            xy: 0.0,
            yy: 1.0,
        };
        assert!(cornered.integrate(centre, wide, &mut weights).is_none());
    }

    #[test]
    fn wide_kernels_are_their_values_at_the_centres() {
        let centre = DVec2::new(0.37, 0.81);
        for covariance in [
            Ellipse {
                xx: 6.3,
                xy: 0.0,
                yy: 6.3,
            },
            Ellipse {
                xx: 60.0,
                xy: 20.0,
                yy: 15.0,
            },
        ] {
            let peak = by_grid(centre, covariance, 0, 0);
            let middle = {
                let mut one = [0.0];
                let d = DVec2::splat(0.5) - centre;
                Centred::new(covariance).fill_row(d.x, d.y, &mut one);
                one[0]
            };
            for row in -12..12 {
                let mut weights = [0.0; 24];
                let d = DVec2::new(-11.5, row as f64 + 0.5) - centre;
                Centred::new(covariance).fill_row(d.x, d.y, &mut weights);
                for (column, weight) in (-12..).zip(weights) {
                    let exact = by_grid(centre, covariance, column, row) / peak;
                    assert!(
                        (weight / middle - exact).abs() < 1e-4,
                        "{column} {row}: {weight}, {exact}"
                    );
                }
            }
        }
    }
}
