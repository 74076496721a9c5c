//! How much noise of indirect light the target allows, and which elements have more.

use super::network::{MAX_PASSES, Network};
use super::solve::Solution;
use crate::optics::LinearSrgb;
use crate::settings::ErrorMetric;

/// The noise of a solution by a metric.
#[derive(Clone, Debug, Default)]
pub struct NoiseTolerance {
    /// Root mean square over all elements, relative; 0 without light.
    pub relative_noise: f64,
    /// By element; empty without light.
    limits: Vec<NoiseLimit>,
}

/// Limits of an element's noise [W/m²] for a target of 1.
#[derive(Clone, Copy, Debug)]
struct NoiseLimit {
    /// Always.
    alone: f64,
    /// As long as the noise of all exceeds the target: stricter for elements that contribute most to it.
    together: f64,
}

impl NoiseTolerance {
    /// Elements that need more rays for a relative error of `target`, ascending.
    pub fn wanting(&self, target: f64, solution: &Solution, passes: &[u8]) -> Vec<usize> {
        let is_rough = self.relative_noise > target;
        let most = |limit: &NoiseLimit| target * if is_rough { limit.together } else { limit.alone };
        (0..self.limits.len())
            .filter(|&element| passes[element] < MAX_PASSES)
            .filter(|&element| solution.noise[element] > most(&self.limits[element]))
            .collect()
    }

    /// Squared noise over its limit, by element; empty without light.
    pub(super) fn squared_excess(&self, target: f64, noise: &[f64]) -> Vec<f64> {
        let limits = self.limits.iter().zip(noise);
        let excess = limits.map(|(limit, noise)| (noise / (target * limit.alone)).powi(2));
        excess.collect()
    }
}

impl Network {
    /// How much noise a solution for these sources [W/m²] may have.
    pub fn tolerance(
        &self,
        solution: &Solution,
        sources: &[LinearSrgb],
        metric: ErrorMetric,
    ) -> NoiseTolerance {
        let elements = self.grids().iter().flat_map(|grid| grid.elements.all());
        let elements = elements
            .zip(&solution.irradiance)
            .zip(sources)
            .zip(&solution.noise);
        let elements = elements.map(|(((element, e), source), noise)| NoisyElement {
            area_m2: element.area_m2,
            indirect: e.luminance(),
            all: (*source + *e).luminance(),
            noise: *noise,
        });
        let elements: Vec<NoisyElement> = elements.collect();
        let area_m2: f64 = elements.iter().map(|element| element.area_m2).sum();
        let flux_w: f64 = elements.iter().map(|of| of.indirect * of.area_m2).sum();
        if flux_w <= 0.0 {
            return NoiseTolerance::default();
        }
        match metric {
            ErrorMetric::Rmse => relative_to_mean(&elements, flux_w / area_m2),
            ErrorMetric::Visible => relative_to_all(&elements, flux_w / area_m2),
        }
    }
}

/// An element with luminances [W/m²].
struct NoisyElement {
    area_m2: f64,
    indirect: f64,
    /// With the light of other layers.
    all: f64,
    noise: f64,
}

/// Noise relative to the mean of indirect light. The limit of an element is relative to its own, or to half the mean if
/// it is darker.
fn relative_to_mean(elements: &[NoisyElement], mean: f64) -> NoiseTolerance {
    let (mut squares, mut area_m2) = (0.0, 0.0);
    for element in elements {
        squares += element.noise.powi(2) * element.area_m2;
        area_m2 += element.area_m2;
    }
    let limit = |element: &NoisyElement| {
        let own = element.indirect / mean;
        let alone = own.max(0.5);
        // Errors in proportion to √E add up to the target.
        let together = alone.min((0.5 * own.max(0.25)).sqrt());
        NoiseLimit {
            alone: mean * alone,
            together: mean * together,
        }
    };
    NoiseTolerance {
        relative_noise: (squares / area_m2).sqrt() / mean,
        limits: elements.iter().map(limit).collect(),
    }
}

/// The same relative to all light of an element: where lamps shine, noise is not seen. Errors weigh by the part of that
/// light which is indirect, so that bright places do not hide those in the shade.
fn relative_to_all(elements: &[NoisyElement], mean: f64) -> NoiseTolerance {
    let scale = |element: &NoisyElement| element.all.max(0.5 * mean);
    let weight = |element: &NoisyElement| element.indirect / scale(element);
    let (mut squares, mut weights_m2, mut area_m2) = (0.0, 0.0, 0.0);
    for element in elements {
        let weight_m2 = weight(element) * element.area_m2;
        squares += weight_m2 * (element.noise / scale(element)).powi(2);
        weights_m2 += weight_m2;
        area_m2 += element.area_m2;
    }
    let mean_weight = weights_m2 / area_m2;
    let limit = |element: &NoisyElement| {
        let alone = scale(element);
        // Errors in inverse proportion to the roots of weights add up to the target.
        let together = alone * (0.5 * mean_weight / weight(element)).sqrt().min(1.0);
        NoiseLimit { alone, together }
    };
    NoiseTolerance {
        relative_noise: (squares / weights_m2).sqrt(),
        limits: elements.iter().map(limit).collect(),
    }
}
