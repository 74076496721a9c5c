//! Predicts the cost of a bake from the first second of one.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::forecast::{Forecast, forecast};
use super::{Bake, BakeEstimate, Baker};
use crate::error::Result;
use crate::light_pass::caustic::pass::Stopwatch;
use crate::plan::Effect;
use crate::progress::{Control, Progress, Stage};
use crate::settings::{BakeSettings, Preset};

/// A pilot ends after so much of all processors once something is known of its error, and else [CPU s].
const PILOT_CPU_S: (f64, f64) = (1.0, 2.0);

/// Density of a pilot of splats [rays/sr].
const PILOT_DENSITY_PER_SR: f64 = 10_000.0;

/// Splats cost as much each whatever their density, within this.
const SPLAT_FACTOR: f64 = 1.5;

/// What a bake with one of the presets would take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PresetForecast {
    /// Which.
    pub preset: Preset,
    /// What it is expected to take; `None` where the pilot could not tell.
    pub forecast: Option<Forecast>,
}

/// What is known of a bake before it.
#[derive(Clone, Debug)]
pub struct Survey {
    /// The plan, and bounds.
    pub estimate: BakeEstimate,
    /// The pilot bake of the default preset: which maps there are, and what it took.
    pub pilot: Bake,
    /// All presets.
    pub presets: Vec<PresetForecast>,
    /// Wall-clock seconds that the survey took.
    pub seconds: f64,
}

impl Baker {
    /// Finds out what a bake would take: draft, preview and final, everything else as the settings say.
    ///
    /// # Errors
    /// As [`Self::bake`].
    pub fn survey(&mut self, settings: &BakeSettings, control: &Control) -> Result<Survey> {
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
        let within_memory = |forecast: Forecast| {
            let held = pilot.course.last().map_or(0, |last| last.bytes);
            Forecast {
                // What is kept beside the maps is dropped where memory ends.
                bytes: forecast.bytes.min(settings.memory_bytes.max(held)),
                ..forecast
            }
        };
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

/// Ends a pilot in time. A bake that knows of a limit would choose what fits into it; this one is cut off.
struct PilotWatch<'a> {
    taken: Stopwatch,
    /// Whether the error is known.
    is_known: AtomicBool,
    /// What the user asks.
    control: &'a Control,
    own: Control,
}

impl Progress for PilotWatch<'_> {
    fn advance(&self, _: Stage, _: u64, _: u64) {
        let (known_s, unknown_s) = PILOT_CPU_S;
        let is_known = self.is_known.load(Ordering::Relaxed);
        let limit_s = if is_known { known_s } else { unknown_s };
        let taken = self.taken.elapsed();
        // Nobody waits longer than ten times that for a busy machine, or one without a clock of its processors.
        if self.control.is_cancelled() || taken.cpu.max(0.1 * taken.wall) > limit_s {
            self.own.cancel();
        }
    }

    fn expect(&self, _: &str) {
        self.is_known.store(true, Ordering::Relaxed);
    }
}

/// Of the default preset, whose course leads past a draft towards a final bake.
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

/// Rays and time grow with the density.
fn splat_forecast(pilot: &Bake, preset: Preset) -> Option<Forecast> {
    let last = pilot.course.last()?;
    let gain = preset.splat_density_per_sr() / PILOT_DENSITY_PER_SR;
    Some(Forecast {
        // Twice as exact with four times the rays, as a rule.
        target: last.error / gain.sqrt(),
        rays: (last.rays as f64 * gain) as u64,
        cpu_s: last.cpu_s * gain,
        wall_s: last.wall_s * gain,
        bytes: last.bytes,
        factor: SPLAT_FACTOR,
    })
}
