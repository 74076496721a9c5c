//! Predicts the cost of a bake from the first second of one.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::forecast::{Forecast, forecast};
use super::{Bake, BakeEstimate, Baker};
use crate::error::Result;
use crate::light_pass::pass_report::Stopwatch;
use crate::plan::Effect;
use crate::progress::{Control, Progress, Stage};
use crate::settings::{BakeSettings, Preset};

/// CPU time after which a pilot ends, with and without a known error [s].
const PILOT_CPU_S: (f64, f64) = (1.0, 2.0);

/// Density of a pilot of splats [rays/sr].
const PILOT_DENSITY_PER_SR: f64 = 10_000.0;

/// Uncertainty of the cost per splat, which hardly depends on the density.
const SPLAT_FACTOR: f64 = 1.5;

/// Predicted cost of a bake with one of the presets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PresetForecast {
    /// The preset.
    pub preset: Preset,
    /// Its cost; `None` if the pilot found no error.
    pub forecast: Option<Forecast>,
}

/// What is known about a bake in advance.
#[derive(Clone, Debug)]
pub struct Survey {
    /// The plan, and upper bounds.
    pub estimate: BakeEstimate,
    /// Pilot bake of the default preset: its maps and its cost.
    pub pilot: Bake,
    /// Forecasts of all presets.
    pub presets: Vec<PresetForecast>,
    /// Wall-clock time of the survey [s].
    pub seconds: f64,
}

impl Baker {
    /// Predicts the cost of each preset, with all other settings as given.
    ///
    /// # Errors
    /// As [`Self::bake`].
    pub fn survey(&mut self, settings: &BakeSettings, control: &Control) -> Result<Survey> {
        // The pilot is a bake of the default preset, cut off once its course tells enough.
        let began = Instant::now();
        let estimate = self.estimate(settings)?;
        let is_on = estimate.plan.is_on(Effect::LightPass);
        let watch = PilotWatch {
            taken: Stopwatch::start(),
            is_known: AtomicBool::new(false),
            control,
            own: Control::default(),
        };
        let pilot = self.bake(&pilot_settings(settings), &watch, &watch.own)?;

        // No forecast of memory exceeds the limit, unless the pilot itself did.
        let within_memory = |forecast: Forecast| {
            let held = pilot.course.last().map_or(0, |last| last.bytes);
            Forecast {
                // What is kept besides the maps is dropped at the memory limit.
                bytes: forecast.bytes.min(settings.memory_bytes.max(held)),
                ..forecast
            }
        };

        // Bundles and photons are extrapolated along the course of the pilot, splats in proportion to their density.
        let of_preset = |preset: Preset| PresetForecast {
            preset,
            forecast: match settings.estimator {
                _ if !is_on => Some(nothing(preset)),
                estimator if estimator.refines() => {
                    forecast(&pilot.course, preset.max_error(), estimator).map(within_memory)
                }
                _ => splat_forecast(&pilot, preset),
            },
        };
        let presets = Preset::ALL.into_iter().map(of_preset).collect();
        Ok(Survey {
            estimate,
            presets,
            seconds: began.elapsed().as_secs_f64(),
            pilot,
        })
    }
}

/// Ends a pilot in time. A bake with a time limit would choose what fits into it; the pilot is cut off instead.
struct PilotWatch<'a> {
    taken: Stopwatch,
    /// Whether the error is known.
    is_known: AtomicBool,
    /// Cancellation by the user.
    control: &'a Control,
    own: Control,
}

impl Progress for PilotWatch<'_> {
    fn advance(&self, _: Stage, _: u64, _: u64) {
        let (known_s, unknown_s) = PILOT_CPU_S;
        let is_known = self.is_known.load(Ordering::Relaxed);
        let limit_s = if is_known { known_s } else { unknown_s };
        let taken = self.taken.elapsed();
        // The wall-clock limit, ten times as long, is for busy machines and those without a CPU clock.
        if self.control.is_cancelled() || taken.cpu.max(0.1 * taken.wall) > limit_s {
            self.own.cancel();
        }
    }

    fn expect(&self, _: &str) {
        self.is_known.store(true, Ordering::Relaxed);
    }
}

/// The pilot aims at the default preset, whose course leads past a draft's target towards that of a final bake.
fn pilot_settings(settings: &BakeSettings) -> BakeSettings {
    let target = Preset::Preview.max_error();
    let (max_error, density_per_sr) = if settings.estimator.refines() {
        (Some(target), BakeSettings::starting_density_per_sr(target))
    } else {
        (settings.max_error, PILOT_DENSITY_PER_SR)
    };
    BakeSettings {
        max_error,
        density_per_sr,
        max_time_s: None,
        ..settings.clone()
    }
}

fn nothing(preset: Preset) -> Forecast {
    Forecast {
        target: preset.max_error(),
        rays: 0,
        cpu_s: 0.0,
        wall_s: 0.0,
        bytes: 0,
        factor: 1.0,
    }
}

/// Rays and time are proportional to the density.
fn splat_forecast(pilot: &Bake, preset: Preset) -> Option<Forecast> {
    let last = pilot.course.last()?;
    let gain = preset.splat_density_per_sr() / PILOT_DENSITY_PER_SR;
    Some(Forecast {
        // Four times the rays halve the error, as a rule.
        target: last.error / gain.sqrt(),
        rays: (last.rays as f64 * gain) as u64,
        cpu_s: last.cpu_s * gain,
        wall_s: last.wall_s * gain,
        bytes: last.bytes,
        factor: SPLAT_FACTOR,
    })
}
