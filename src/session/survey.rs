//! What a bake would take, before it: a short pilot bake, and what its course says of the presets.

use std::time::Instant;

use super::forecast::{Forecast, forecast};
use super::{BakeEstimate, BakeResult, BakeSession, StopReason, Timings};
use crate::error::Result;
use crate::plan::Effect;
use crate::progress::Control;
use crate::settings::{BakeSettings, Preset};

/// The pilot's light pass ends after so long [s]; the later ones go on where those before ended, where no error is known
/// by then.
const PILOTS_S: [f64; 3] = [1.0, 3.0, 9.0];

/// Relative RMSE that the pilot aims at.
const PILOT_TARGET: f64 = 0.03;

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
    /// The pilot bake: which maps there are, and what it took.
    pub pilot: BakeResult,
    /// All presets.
    pub presets: Vec<PresetForecast>,
    /// Wall-clock seconds that the survey took.
    pub seconds: f64,
}

impl BakeSession {
    /// Finds out what a bake would take: draft, preview and final in turn, everything else as the settings say.
    ///
    /// # Errors
    /// As [`Self::bake`].
    pub fn survey(&mut self, settings: &BakeSettings, control: &Control) -> Result<Survey> {
        let began = Instant::now();
        let estimate = self.estimate(settings)?;
        let is_on = estimate.plan.is_on(Effect::LightPass);
        let mut pilot = self.bake(&pilot_settings(settings, PILOTS_S[0]), &(), control)?;
        for limit_s in &PILOTS_S[1..] {
            if is_on && pilot.course.is_empty() && pilot.stop_reason == StopReason::MaxTime {
                let longer = self.bake(&pilot_settings(settings, *limit_s), &(), control)?;
                pilot = added(pilot, longer);
            }
        }
        let of_preset = |preset: Preset| PresetForecast {
            preset,
            forecast: match settings.estimator {
                _ if !is_on => Some(nothing(preset)),
                _ if settings.estimator.refines() => {
                    forecast(&pilot.course, preset.max_error(), settings.estimator)
                }
                _ => splat_forecast(&pilot, preset),
            },
        };
        let presets = Preset::ALL.map(of_preset).to_vec();
        Ok(Survey {
            estimate,
            pilot,
            presets,
            seconds: began.elapsed().as_secs_f64(),
        })
    }
}

/// A bake that went on where another ended, with what that one took.
fn added(first: BakeResult, mut second: BakeResult) -> BakeResult {
    let sum_s = |times: &Timings| times.plan + times.trace + times.deposit;
    for point in &mut second.course {
        point.rays += first.counts.rays;
        point.cpu_s += sum_s(&first.cpu_s);
        point.wall_s += sum_s(&first.timings_s);
    }
    second.counts.rays += first.counts.rays;
    second.item_buffers = first.item_buffers;
    second
}

fn pilot_settings(settings: &BakeSettings, limit_s: f64) -> BakeSettings {
    if settings.estimator.refines() {
        BakeSettings {
            max_error: Some(PILOT_TARGET),
            max_time_s: Some(limit_s),
            density_per_sr: BakeSettings::starting_density_per_sr(PILOT_TARGET),
            ..settings.clone()
        }
    } else {
        BakeSettings {
            density_per_sr: PILOT_DENSITY_PER_SR,
            max_time_s: Some(limit_s),
            ..settings.clone()
        }
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
fn splat_forecast(pilot: &BakeResult, preset: Preset) -> Option<Forecast> {
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
