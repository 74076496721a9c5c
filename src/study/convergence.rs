//! How the error of each estimator falls with light rays and with CPU time.

use std::sync::Arc;

use clap::ValueEnum;
use serde::Serialize;

use super::cost::{self, Cost};
use super::references::Reference;
use super::repeats::{bake, light_pass_cpu_s, median};
use crate::error::Result;
use crate::progress::{Control, Progress};
use crate::scene::Scene;
use crate::session::BakeResult;
use crate::settings::{BakeSettings, Estimator};

/// Errors that costs are given for.
pub const TARGETS: [f64; 3] = [0.05, 0.02, 0.01];

/// Densities when none are asked for [1/sr].
pub const DEFAULT_DENSITIES: [f64; 9] = [1e2, 3e2, 1e3, 3e3, 1e4, 3e4, 1e5, 3e5, 1e6];

/// The finest bake is this many times as dense when it is the reference itself.
const SELF_REFERENCE_FACTOR: f64 = 16.0;

/// What is measured.
#[derive(Clone, Debug)]
pub struct Ladder {
    /// Each is measured at every density.
    pub estimators: Vec<Estimator>,
    /// Ascending [1/sr].
    pub densities: Vec<f64>,
    /// Bakes of each kind; their median CPU times count.
    pub repeats: usize,
    /// Of all bakes, but for estimator, density, and sigma, which is the estimator's default.
    pub settings: BakeSettings,
}

/// One estimator at one density.
#[derive(Clone, Debug, Serialize)]
pub struct Measurement {
    /// The scene as it was named.
    pub scene: String,
    /// Its name on the command line.
    pub estimator: String,
    /// Light rays per steradian asked for.
    pub density: f64,
    /// Light rays traced.
    pub rays: u64,
    /// Interpolated rays against candidate receivers.
    pub receiver_queries: u64,
    /// Kernels deposited.
    pub splats: u64,
    /// Wavefront cells deposited.
    pub cells: u64,
    /// Item buffers, tracing and depositing: all of the light pass but the hierarchy [s of CPU].
    pub cpu_light_pass_s: f64,
    /// Tracing alone.
    pub cpu_trace_s: f64,
    /// Depositing alone.
    pub cpu_deposit_s: f64,
    /// sqrt(mean((I − R)²)) / mean(R).
    pub relative_rmse: f64,
    /// mean(|I − R| / R) over texels with R > 1 % of mean(R).
    pub ard: f64,
    /// Largest I over largest R.
    pub peak_ratio: f64,
    /// mean(I) / mean(R).
    pub flux_ratio: f64,
    /// What R is.
    pub reference: String,
}

/// What one estimator takes to reach an error.
#[derive(Clone, Debug)]
pub struct Price {
    /// Its name on the command line.
    pub estimator: String,
    /// Relative RMSE.
    pub target: f64,
    /// Light rays; `None` where the error does not get there.
    pub rays: Option<Cost>,
    /// CPU seconds of the light pass.
    pub cpu_s: Option<Cost>,
}

/// Measures every estimator at every density. Each bake has a session of its own, so that none finds the work of
/// another done.
///
/// # Errors
/// Those of a bake; a reference that does not fit; stopped before the end.
pub fn measure(
    scene: &Arc<Scene>,
    ladder: &Ladder,
    reference: &Reference,
    progress: &dyn Progress,
    control: &Control,
) -> Result<Vec<Measurement>> {
    let mut measurements = Vec::new();
    for &estimator in &ladder.estimators {
        for &density in &ladder.densities {
            let settings = ladder.settings_for(estimator, density);
            let mut results = Vec::new();
            for _ in 0..ladder.repeats.max(1) {
                results.push(bake(scene, &settings, progress, control)?);
            }
            measurements.push(measurement(scene, &settings, reference, &results)?);
        }
    }
    Ok(measurements)
}

/// The bake that serves as reference where there is no other: the first estimator of the ladder, far above its
/// densest lattice.
///
/// # Errors
/// Those of a bake; stopped before the end.
pub fn self_reference(
    scene: &Arc<Scene>,
    ladder: &Ladder,
    progress: &dyn Progress,
    control: &Control,
) -> Result<Reference> {
    let densest = ladder.densities.iter().copied().fold(1.0, f64::max);
    let estimator = ladder
        .estimators
        .last()
        .copied()
        .unwrap_or(ladder.settings.estimator);
    let settings = ladder.settings_for(estimator, SELF_REFERENCE_FACTOR * densest);
    let result = bake(scene, &settings, progress, control)?;
    let kind = format!("self {} {:e}/sr", name(estimator), settings.density_per_sr);
    Ok(Reference::of_bake(result.maps, kind))
}

/// Rays and seconds of each estimator at each of the [`TARGETS`].
pub fn prices(measurements: &[Measurement]) -> Vec<Price> {
    let mut prices = Vec::new();
    for estimator in estimators(measurements) {
        for target in TARGETS {
            prices.push(Price {
                estimator: estimator.to_string(),
                target,
                rays: cost::cost_of(&curve(measurements, estimator, Axis::Rays), target),
                cpu_s: cost::cost_of(&curve(measurements, estimator, Axis::CpuSeconds), target),
            });
        }
    }
    prices
}

/// What an error is plotted against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Light rays.
    Rays,
    /// CPU seconds of the light pass.
    CpuSeconds,
}

/// (cost, relative RMSE) of one estimator in the order of the measurements.
pub fn curve(measurements: &[Measurement], estimator: &str, axis: Axis) -> Vec<(f64, f64)> {
    measurements
        .iter()
        .filter(|measurement| measurement.estimator == estimator)
        .map(|measurement| {
            let cost = match axis {
                Axis::Rays => measurement.rays as f64,
                Axis::CpuSeconds => measurement.cpu_light_pass_s,
            };
            (cost, measurement.relative_rmse)
        })
        .filter(|(cost, error)| *cost > 0.0 && *error > 0.0)
        .collect()
}

/// Names of the estimators, each once, in the order of the measurements.
pub fn estimators(measurements: &[Measurement]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for measurement in measurements {
        if !names.contains(&measurement.estimator.as_str()) {
            names.push(&measurement.estimator);
        }
    }
    names
}

/// An estimator's name on the command line.
pub fn name(estimator: Estimator) -> String {
    estimator
        .to_possible_value()
        .map_or_else(|| format!("{estimator:?}"), |value| value.get_name().to_string())
}

impl Ladder {
    fn settings_for(&self, estimator: Estimator, density_per_sr: f64) -> BakeSettings {
        BakeSettings {
            estimator,
            density_per_sr,
            sigma: estimator.default_sigma(),
            ..self.settings.clone()
        }
    }
}

fn measurement(
    scene: &Scene,
    settings: &BakeSettings,
    reference: &Reference,
    results: &[BakeResult],
) -> Result<Measurement> {
    let agreement = reference.measure(&results[0].maps)?;
    let counts = &results[0].counts;
    let cpu = |seconds: fn(&BakeResult) -> f64| median(results.iter().map(seconds).collect());
    Ok(Measurement {
        scene: scene.source.clone(),
        estimator: name(settings.estimator),
        density: settings.density_per_sr,
        rays: counts.rays,
        receiver_queries: counts.receiver_queries,
        splats: counts.splats,
        cells: counts.cells,
        cpu_light_pass_s: cpu(light_pass_cpu_s),
        cpu_trace_s: cpu(|result| result.cpu_s.trace),
        cpu_deposit_s: cpu(|result| result.cpu_s.deposit),
        relative_rmse: agreement.relative_rmse,
        ard: agreement.average_relative_difference,
        peak_ratio: agreement.peak_ratio,
        flux_ratio: agreement.flux_ratio,
        reference: reference.kind.clone(),
    })
}
