//! The estimated error of each element.

use super::grid::Grid;
use super::network::Network;
use super::solve::Solution;

impl Network {
    /// Expected error of the luminance of a grid's elements [W/m²]: the root of the squared noise and the squared
    /// curvature of E between elements, which linear interpolation misses.
    pub fn errors(&self, grid: &Grid, solution: &Solution) -> Vec<f64> {
        let value = |element: usize| solution.irradiance[grid.first + element].luminance();
        let noise = |element: usize| solution.noise[grid.first + element];
        (0..grid.elements.all().len())
            .map(|element| {
                let bends = [(1, 0), (0, 1)].map(|step| bend(grid, element, step, &value));
                noise(element).hypot(bends.iter().sum())
            })
            .collect()
    }

    /// Noise as the root mean square over the elements around, scaled to equal numbers of rays: for a single element it
    /// is only one difference.
    pub(super) fn pooled(&self, noise: &[f64], passes: &[u8]) -> Vec<f64> {
        let mut pooled = Vec::with_capacity(noise.len());
        for grid in self.grids() {
            pooled.extend((0..grid.elements.all().len()).map(|element| {
                let rays = |element: usize| f64::from(Self::rays_after(passes[grid.first + element]));
                let (mut sum, mut count) = (0.0, 0.0);
                let (texel, piece) = grid.place(element);
                for near in grid.around(texel, piece) {
                    sum += noise[grid.first + near].powi(2) * rays(near);
                    count += 1.0;
                }
                (sum / (count * rays(element))).sqrt()
            }));
        }
        pooled
    }
}

/// Error of linear interpolation between neighbours: an eighth of the second difference; at a border, an eighth of the
/// first.
fn bend(grid: &Grid, element: usize, (right, down): (i64, i64), value: &impl Fn(usize) -> f64) -> f64 {
    let ([column, row], piece) = grid.place(element);
    let ends = [1, -1].map(|sign| grid.element_in([column + sign * right, row + sign * down], piece));
    match ends {
        [Some(a), Some(b)] => (value(a) - 2.0 * value(element) + value(b)).abs() / 8.0,
        [Some(one), None] | [None, Some(one)] => (value(one) - value(element)).abs() / 8.0,
        [None, None] => 0.0,
    }
}
