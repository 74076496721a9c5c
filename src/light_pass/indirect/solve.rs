//! Iterates the light between surfaces until it converges.

use rayon::prelude::*;

use super::network::Network;
use crate::optics::LinearSrgb;

/// Maximum number of bounces.
pub const MAX_BOUNCES: u32 = 1000;

/// Remaining light, relative to the mean, at which the iteration ends.
const TOLERANCE: f64 = 1e-5;

/// Irradiance of the elements from each other.
#[derive(Clone, Debug)]
pub struct Solution {
    /// E from other elements [W/m²].
    pub irradiance: Vec<LinearSrgb>,
    /// Standard error of its luminance by element [W/m²], estimated from the rays of the element and of those around
    /// it.
    pub noise: Vec<f64>,
    pub bounces: u32,
    /// False if [`MAX_BOUNCES`] was not enough.
    pub converged: bool,
}

impl Network {
    /// Solves E = K (S + E) for the sources S [W/m²] of all elements, using the first `passes` of each element, at
    /// least [`MIN_PASSES`](super::MIN_PASSES).
    pub fn solve(&self, sources: &[LinearSrgb], passes: &[u8]) -> Solution {
        // Jacobi iteration from darkness: after n rounds, E holds the light of up to n bounces.
        let count = self.element_count();
        let mut irradiance = vec![LinearSrgb::BLACK; count];
        let (mut bounces, mut converged, mut last_change) = (0, false, f64::INFINITY);
        while bounces < MAX_BOUNCES {
            let sent: Vec<LinearSrgb> = sources.iter().zip(&irradiance).map(|(s, e)| *s + *e).collect();
            let next: Vec<LinearSrgb> = (0..count)
                .into_par_iter()
                .map(|element| self.gathered(element, &sent, 0..passes[element]))
                .collect();
            bounces += 1;
            let (change, mean) = self.change(&irradiance, &next);
            irradiance = next;
            // Changes shrink by a ratio; the remaining ones add up to a geometric series.
            let ratio = (change / last_change).clamp(0.0, 1.0);
            last_change = change;
            if change == 0.0 || change * ratio <= TOLERANCE * mean * (1.0 - ratio) && bounces > 2 {
                converged = true;
                break;
            }
        }

        // Noise is measured under the converged light, and pooled with the elements around: a single difference says
        // little.
        let sent: Vec<LinearSrgb> = sources.iter().zip(&irradiance).map(|(s, e)| *s + *e).collect();
        let lone: Vec<f64> = (0..count)
            .into_par_iter()
            .map(|element| self.noise(element, &sent, passes[element]))
            .collect();
        let noise = self.pooled(&lone, passes);
        Solution {
            irradiance,
            noise,
            bounces,
            converged,
        }
    }

    /// E of an element from the rays of some passes.
    fn gathered(&self, element: usize, sent: &[LinearSrgb], passes: std::ops::Range<u8>) -> LinearSrgb {
        let (mut sum, mut rays) = ([0.0; 3], 0_u32);
        for (links, kept) in passes.filter_map(|pass| self.row(element, pass)) {
            rays += kept;
            for link in links {
                let from = sent[link.element as usize].to_array();
                for channel in 0..3 {
                    sum[channel] += f64::from(link.weight[channel]) * from[channel];
                }
            }
        }
        if rays == 0 {
            LinearSrgb::BLACK
        } else {
            LinearSrgb::from(sum) / f64::from(rays)
        }
    }

    /// Half the difference between the last pass and all before it, which have equally many rays.
    fn noise(&self, element: usize, sent: &[LinearSrgb], passes: u8) -> f64 {
        let last = passes.saturating_sub(1);
        let halves = [0..last, last..passes];
        let [first, second] = halves.map(|half| self.gathered(element, sent, half).luminance());
        0.5 * (second - first).abs()
    }

    /// Change and new E, each summed over the area; of the largest channel.
    fn change(&self, old: &[LinearSrgb], new: &[LinearSrgb]) -> (f64, f64) {
        let (mut change, mut mean) = ([0.0; 3], [0.0; 3]);
        for grid in self.grids() {
            for (index, element) in grid.elements.all().iter().enumerate() {
                let (old, new) = (
                    old[grid.first + index].to_array(),
                    new[grid.first + index].to_array(),
                );
                for channel in 0..3 {
                    change[channel] += (new[channel] - old[channel]).abs() * element.area_m2;
                    mean[channel] += new[channel] * element.area_m2;
                }
            }
        }
        let largest = |sums: [f64; 3]| sums.into_iter().fold(0.0, f64::max);
        (largest(change), largest(mean))
    }
}
