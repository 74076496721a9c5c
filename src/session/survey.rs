//! What a bake would take, before it: a short pilot bake of each preset, and what its course says.

use std::time::Instant;

use super::forecast::{Forecast, forecast};
use super::{Bake, BakeEstimate, Baker, StopReason, Timings};
use crate::error::Result;
use crate::plan::Effect;
use crate::progress::Control;
use crate::settings::{BakeSettings, Preset};

/// A pilot's light pass ends after so long [s]; the later ones go on where those before ended, where no error is known
/// by then.
const PILOTS_S: [f64; 3] = [0.5, 3.0, 9.0];

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
    /// Finds out what a bake would take: draft, preview and final in turn, everything else as the settings say.
    ///
    /// # Errors
    /// As [`Self::bake`].
    pub fn survey(&mut self, settings: &BakeSettings, control: &Control) -> Result<Survey> {
        let began = Instant::now();
        let estimate = self.estimate(settings)?;
        let is_on = estimate.plan.is_on(Effect::LightPass);
        let mut pilots = Vec::new();
        for preset in Preset::ALL {
            if pilots.is_empty() || is_on && settings.estimator.refines() {
                pilots.push(self.pilot(&pilot_settings(settings, preset), control)?);
            }
        }
        let of_preset = |(index, preset): (usize, Preset)| {
            let pilot = &pilots[index.min(pilots.len() - 1)];
            PresetForecast {
                preset,
                forecast: match settings.estimator {
                    _ if !is_on => Some(nothing(preset)),
                    _ if settings.estimator.refines() => {
                        forecast(&pilot.course, preset.max_error(), settings.estimator)
                    }
                    _ => splat_forecast(pilot, preset),
                },
            }
        };
        let presets = Preset::ALL.into_iter().enumerate().map(of_preset).collect();
        let pilot = pilots.swap_remove(pilots.len() / 2);
        Ok(Survey {
            estimate,
            pilot,
            presets,
            seconds: began.elapsed().as_secs_f64(),
        })
    }

    /// The first moments of a bake: until something is known of its error, or the last limit is reached.
    fn pilot(&mut self, settings: &BakeSettings, control: &Control) -> Result<Bake> {
        let within = |limit_s| BakeSettings {
            max_time_s: Some(limit_s),
            ..settings.clone()
        };
        let mut pilot = self.bake(&within(PILOTS_S[0]), &(), control)?;
        for limit_s in &PILOTS_S[1..] {
            if pilot.course.is_empty() && pilot.stop_reason == StopReason::MaxTime {
                let longer = self.bake(&within(*limit_s), &(), control)?;
                pilot = added(pilot, longer);
            }
        }
        Ok(pilot)
    }
}

/// A bake that went on where another ended, with what that one took.
fn added(first: Bake, mut second: Bake) -> Bake {
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

/// The map's size, and with it the noise of each texel, depends on the target.
fn pilot_settings(settings: &BakeSettings, preset: Preset) -> BakeSettings {
    if settings.estimator.refines() {
        BakeSettings {
            max_error: Some(preset.max_error()),
            density_per_sr: BakeSettings::starting_density_per_sr(preset.max_error()),
            ..settings.clone()
        }
    } else {
        BakeSettings {
            density_per_sr: PILOT_DENSITY_PER_SR,
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
