//! Smooths indirect light where its rays did not suffice: single rays that met a bright focus by way of glass would
//! show as dots. Flux is conserved.

use std::ops::{AddAssign, Mul, Sub};

use super::network::Network;
use super::solve::Solution;
use super::tolerance::NoiseTolerance;
use crate::optics::LinearSrgb;

/// Distances of the elements whose light is mixed in turn [elements]. Each time nine are averaged, which divides the
/// noise by three (Dammertz et al., "Edge-Avoiding À-Trous Wavelet Transform", HPG 2010, without their edges).
const STEPS: [i64; 3] = [1, 2, 4];

/// Directions to half of the eight neighbours: the others follow by symmetry.
const HALF_AROUND: [[i64; 2]; 4] = [[1, 0], [0, 1], [1, 1], [1, -1]];

/// How far the light of each element is smoothed.
#[derive(Clone, Debug, Default)]
pub struct NoiseSmoothing {
    /// Noise over what is allowed, by element; empty if nothing has too much.
    excess: Vec<f64>,
}

impl NoiseSmoothing {
    /// For a target of the relative error.
    pub fn new(network: &Network, solution: &Solution, tolerance: &NoiseTolerance, target: f64) -> Self {
        let mut squares = tolerance.squared_excess(target, &solution.noise);
        if squares.iter().all(|square| *square <= 1.0) {
            return Self::default();
        }
        // The noise of an element whose rays all missed the focus shows around it alone.
        for step in STEPS {
            network.mix(&mut squares, step, |_| 1.0);
        }
        Self {
            excess: squares.into_iter().map(f64::sqrt).collect(),
        }
    }

    /// E of all elements [W/m²], smoothed.
    pub fn of(&self, network: &Network, irradiance: &[LinearSrgb]) -> Vec<LinearSrgb> {
        let mut smoothed = irradiance.to_vec();
        if self.excess.is_empty() {
            return smoothed;
        }
        let mut left = 1.0;
        for step in STEPS {
            network.mix(&mut smoothed, step, |element| {
                (self.excess[element] * left - 1.0).clamp(0.0, 1.0)
            });
            left /= 3.0;
        }
        smoothed
    }
}

impl Network {
    /// Averages each element with the eight at a distance [elements], to a share in [0, 1]. What one of two gains, the
    /// other loses.
    fn mix<V>(&self, values: &mut [V], step: i64, share: impl Fn(usize) -> f64)
    where
        V: AddAssign + Copy + Mul<f64, Output = V> + Sub<Output = V>,
    {
        let before = values.to_vec();
        for grid in self.grids() {
            let elements = grid.elements.all();
            for (index, own) in elements.iter().enumerate() {
                let ([column, row], piece) = grid.place(index);
                for [right, down] in HALF_AROUND {
                    let texel = [column + step * right, row + step * down];
                    let Some(other) = grid.element_in(texel, piece) else {
                        continue;
                    };
                    let (a, b) = (grid.first + index, grid.first + other);
                    if self.is_hidden(a) != self.is_hidden(b) {
                        continue;
                    }
                    let [own_m2, other_m2] = [own.area_m2, elements[other].area_m2];
                    let mixed_m2 = own_m2.min(other_m2) * share(a).min(share(b)) / 9.0;
                    let flow = (before[b] - before[a]) * mixed_m2;
                    values[a] += flow * own_m2.recip();
                    values[b] += flow * -other_m2.recip();
                }
            }
        }
    }
}
