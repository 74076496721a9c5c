//! Splits the error target of a bake into one target per light. Light adds up on the maps, and so do squared errors:
//! lights whose error hardly shows beside the others stay coarse.

use std::collections::BTreeMap;

use super::caustic::{CausticLayer, LightProgress};
use super::metric::ErrorTerms;
use crate::light_pass::ledger_sum::Account;
use crate::light_pass::visibility::VisibleLight;

/// A light whose whole flux is below this fraction of the limit is dim.
const NEGLIGIBLE: f64 = 0.25;

/// Fraction of the squared target that all dim lights together may contribute.
const DIM_SHARE: f64 = 0.5;

/// What a light is refined towards next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Goal {
    /// No further refinement.
    Converged,
    /// The next level.
    NextLevel,
    /// A relative RMSE of the light's own maps.
    Refine(f64),
}

/// Error of a light that deposited flux.
#[derive(Clone, Copy, Debug)]
struct ErrorOfLight {
    /// Index among the lights.
    index: usize,
    /// Relative RMSE of the maps that the light reaches.
    relative_rmse: f64,
    /// Contribution to the error of all maps, in the target metric; contributions add in squares.
    share: f64,
}

/// The lights whose error is known.
#[derive(Clone, Debug, Default)]
pub(super) struct Errors {
    lights: Vec<ErrorOfLight>,
}

impl Errors {
    /// Error of all lights together, in the target metric.
    pub(super) fn error(&self) -> f64 {
        let squares: f64 = self.lights.iter().map(|light| light.share.powi(2)).sum();
        squares.sqrt()
    }

    /// Whether the error of every light is known.
    pub(super) fn are_of_all(&self, lights: &[LightProgress]) -> bool {
        !lights.is_empty() && self.lights.len() == lights.len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// The largest share that a light may have for the error of all to meet `target`: larger shares are cut down to it,
    /// smaller ones stay. Infinite if the target is met already.
    fn level(&self, target: f64) -> f64 {
        let mut shares: Vec<f64> = self.lights.iter().map(|light| light.share).collect();
        shares.sort_by(f64::total_cmp);
        let mut left = target * target;
        for (index, share) in shares.iter().enumerate() {
            let others = (shares.len() - index) as f64;
            if share * share * others > left {
                return (left / others).sqrt();
            }
            left -= share * share;
        }
        f64::INFINITY
    }
}

impl CausticLayer<'_> {
    /// Whether all flux that a light can add to the maps is below the target: one coarse lattice is then enough,
    /// whatever it misses, unless the light is concentrated on one spot.
    pub(super) fn is_negligible(&self, light: &VisibleLight) -> bool {
        let Some(target) = self.settings.max_error else {
            return false;
        };
        let scene = self.tracer.scene();
        let sends_w = |light: &VisibleLight| {
            let strength = scene.lights[light.light].strength().luminance();
            strength * light.launch.power_bound_w() * light.visible().marked_share(&light.launch)
        };
        let (mut all_w, mut count) = (0.0, 0);
        for light in self.lit() {
            all_w += sends_w(light);
            count += 1;
        }
        sends_w(light) < NEGLIGIBLE * target * all_w / f64::from(count).sqrt()
    }

    /// Lights that were treated as negligible but are bright enough on some spot to need refinement.
    pub(super) fn promote_dim_lights(&self, errors: &Errors, lights: &[LightProgress]) -> Vec<usize> {
        let Some(target) = self.settings.max_error else {
            return Vec::new();
        };
        let is_negligible = |light: &&ErrorOfLight| {
            let last = lights[light.index].levels.last();
            last.is_some_and(|level| level.key.trace.is_negligible)
        };
        let mut dim: Vec<&ErrorOfLight> = errors.lights.iter().filter(is_negligible).collect();
        dim.sort_by(|a, b| a.share.total_cmp(&b.share));
        let mut left = DIM_SHARE * target * target;
        let stays = |light: &&ErrorOfLight| {
            left -= light.share.powi(2);
            left >= 0.0
        };
        let kept = dim.iter().copied().take_while(stays).count();
        dim[kept..].iter().map(|light| light.index).collect()
    }

    /// Errors of the lights that have one.
    pub(super) fn errors(&self, lights: &[LightProgress], terms: &ErrorTerms) -> Errors {
        let ErrorTerms::Visible(counts) = terms else {
            return self.errors_by_rmse(lights);
        };
        let of = |(index, light): (usize, &LightProgress)| {
            let level = light.levels.last()?;
            let error = level.error.as_ref()?;
            let strength = level.strength(&self.tracer.scene().lights[light.visible.light]);
            Some(ErrorOfLight {
                index,
                relative_rmse: error.relative_rmse,
                share: counts.of_light(level, error) * strength.luminance(),
            })
        };
        Errors {
            lights: lights.iter().enumerate().filter_map(of).collect(),
        }
    }

    /// Errors as shares of the relative RMSE over all maps, by area and flux.
    fn errors_by_rmse(&self, lights: &[LightProgress]) -> Errors {
        // Area of all lit maps and flux of all lights: the mean irradiance that errors are relative to.
        let (mut areas_m2, mut all_w) = (BTreeMap::new(), 0.0);
        let of = |(index, light): (usize, &LightProgress)| {
            let level = light.levels.last()?;
            let strength = level.strength(&self.tracer.scene().lights[light.visible.light]);
            let flux_w = level.ledger.watts(Account::Deposited, level.unit, strength);
            // Lights without a known error count in the total, too.
            all_w += flux_w;
            let of_light = level.maps.iter();
            let of_light: Vec<_> = of_light
                .map(|(receiver, map)| (receiver, map.chart.area_m2()))
                .collect();
            areas_m2.extend(of_light.iter().copied());
            let area_m2: f64 = of_light.iter().map(|(_, m2)| m2).sum();
            let error = level.error.as_ref()?;
            Some((index, error.relative_rmse, flux_w, area_m2))
        };
        let known: Vec<(usize, f64, f64, f64)> = lights.iter().enumerate().filter_map(of).collect();

        // A light adds nothing to the mean on maps that it does not reach, so that its relative error grows with their
        // area.
        let all_m2: f64 = areas_m2.values().sum();
        let of = |&(index, relative_rmse, flux_w, area_m2): &(usize, f64, f64, f64)| ErrorOfLight {
            index,
            relative_rmse,
            // As if the light shone alone on all maps, weighted by its share of the flux.
            share: if flux_w > 0.0 {
                relative_rmse * (all_m2 / area_m2).sqrt() * flux_w / all_w
            } else {
                0.0
            },
        };
        Errors {
            lights: known.iter().map(of).collect(),
        }
    }

    /// The next goal of each light. Also updates its target.
    pub(super) fn goals(&self, lights: &mut [LightProgress], errors: &Errors) -> Vec<Goal> {
        let mut goals = vec![Goal::NextLevel; lights.len()];
        let Some(target) = self.settings.max_error else {
            return goals;
        };
        let level = errors.level(target);
        for error in &errors.lights {
            let light = &mut lights[error.index];
            let has_limit = error.share > 0.0 && level.is_finite();
            light.target_rmse = has_limit.then(|| error.relative_rmse * level / error.share);
            goals[error.index] = light.target_rmse.map_or(Goal::Converged, Goal::Refine);
        }
        goals
    }
}
