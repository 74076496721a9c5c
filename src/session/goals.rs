//! A share of the rays for each light, by what it can still gain: light adds up on the maps, and so do the squares of its
//! errors. Lights whose error hardly shows beside the others' stay coarse.

use std::collections::BTreeMap;

use super::carrier::Carrier;
use super::caustic::{CausticLayer, Climb};
use crate::light_pass::caustic::setup::AimedLight;
use crate::light_pass::ledger_sum::Account;

/// A light whose error is below this share of what it might be need not even go through all lattices; one whose whole
/// light is, is dim.
const NEGLIGIBLE: f64 = 0.25;

/// Share of the squared error that is aimed at which all dim lights may have together.
const DIM_SHARE: f64 = 0.5;

/// What a light aims at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Goal {
    /// Nothing more.
    Enough,
    /// The next lattice.
    NextLevel,
    /// A relative RMSE of its own maps.
    Refine(f64),
}

/// The error of a light that deposits light.
#[derive(Clone, Copy, Debug)]
pub(super) struct ErrorOfLight {
    /// Its place among the lights.
    index: usize,
    /// Relative RMSE of the maps that it reaches.
    relative_rmse: f64,
    /// What it deposits [W].
    flux_w: f64,
    /// Area of the maps that it reaches [m²].
    area_m2: f64,
}

/// Errors of lights as they show on the maps.
#[derive(Clone, Debug, Default)]
pub(super) struct Errors {
    pub(super) lights: Vec<ErrorOfLight>,
    /// Area of the maps that any light reaches [m²].
    area_m2: f64,
}

impl Errors {
    /// Of all together.
    pub(super) fn relative_rmse(&self) -> f64 {
        let squares: f64 = self.lights.iter().map(|light| self.error_w(light).powi(2)).sum();
        squares.sqrt() / self.flux_w()
    }

    fn flux_w(&self) -> f64 {
        self.lights.iter().map(|light| light.flux_w).sum()
    }

    /// What relative RMSE over all maps a light's own one comes to.
    fn spread(&self, light: &ErrorOfLight) -> f64 {
        (self.area_m2 / light.area_m2).sqrt()
    }

    /// The error of a light over all maps [W]: the relative RMSE over them if it shone alone, times its flux.
    fn error_w(&self, light: &ErrorOfLight) -> f64 {
        light.relative_rmse * self.spread(light) * light.flux_w
    }

    /// The error [W] that no light may exceed for all to have a relative RMSE of `target`: the largest ones are cut down to
    /// it, the others stay. Infinite where that is so already.
    fn level_w(&self, target: f64) -> f64 {
        let mut errors: Vec<f64> = self.lights.iter().map(|light| self.error_w(light)).collect();
        errors.sort_by(f64::total_cmp);
        let mut left = (target * self.flux_w()).powi(2);
        for (index, error) in errors.iter().enumerate() {
            let others = (errors.len() - index) as f64;
            if error * error * others > left {
                return (left / others).sqrt();
            }
            left -= error * error;
        }
        f64::INFINITY
    }
}

impl CausticLayer<'_> {
    /// Whether all the flux that a light can add to the maps is less than the error that is aimed at: then one coarse
    /// lattice is enough, whatever it misses, unless it shines all on one spot.
    pub(super) fn is_dim(&self, light: &AimedLight) -> bool {
        let Some(target) = self.settings.max_error else {
            return false;
        };
        let scene = self.tracer.scene();
        let sends_w = |light: &AimedLight| {
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

    /// Lights that were taken to be dim and, bright on some spot, are worth knowing better.
    pub(super) fn underrated(&self, lights: &[&AimedLight], climbs: &[Climb]) -> Vec<usize> {
        let Some(target) = self.settings.max_error else {
            return Vec::new();
        };
        let known = self.known_errors(lights, climbs);
        let is_dim = |light: &&ErrorOfLight| {
            let last = climbs[light.index].levels.last();
            last.is_some_and(|level| level.key.trace.is_dim)
        };
        let mut dim: Vec<&ErrorOfLight> = known.lights.iter().filter(is_dim).collect();
        dim.sort_by(|a, b| known.error_w(a).total_cmp(&known.error_w(b)));
        let lit = lights.iter().zip(climbs);
        let flux_w: f64 = lit.filter_map(|(light, climb)| self.flux_w(light, climb)).sum();
        let mut left = DIM_SHARE * (target * flux_w).powi(2);
        let stays = |light: &&ErrorOfLight| {
            left -= known.error_w(light).powi(2);
            left >= 0.0
        };
        let kept = dim.iter().copied().take_while(stays).count();
        dim[kept..].iter().map(|light| light.index).collect()
    }

    /// Whether levels of a light are no lattices.
    fn has_no_ladder(&self, light: &AimedLight, climb: &Climb) -> bool {
        climb.carrier == Carrier::Photons || self.is_soft(light)
    }

    /// Errors of all lights; `None` where one is not known yet.
    pub(super) fn errors(&self, lights: &[&AimedLight], climbs: &[Climb]) -> Option<Errors> {
        let known = self.known_errors(lights, climbs);
        (!lights.is_empty() && known.lights.len() == lights.len()).then_some(known)
    }

    /// What a light deposits [W], as far as that is known.
    fn flux_w(&self, light: &AimedLight, climb: &Climb) -> Option<f64> {
        let level = climb.levels.last()?;
        let strength = level.strength(&self.tracer.scene().lights[light.light]);
        Some(level.ledger.watts(Account::Deposited, level.unit, strength))
    }

    /// Errors of the lights that have one.
    pub(super) fn known_errors(&self, lights: &[&AimedLight], climbs: &[Climb]) -> Errors {
        let mut areas_m2 = BTreeMap::new();
        let of = |(index, (light, climb)): (usize, (&&AimedLight, &Climb))| {
            let level = climb.levels.last()?;
            let of_light = level
                .maps
                .iter()
                .map(|(receiver, map)| (receiver, map.chart.area_m2()));
            let of_light: Vec<_> = of_light.collect();
            areas_m2.extend(of_light.iter().copied());
            Some(ErrorOfLight {
                index,
                relative_rmse: climb.error()?.relative_rmse,
                flux_w: self.flux_w(light, climb)?,
                area_m2: of_light.iter().map(|(_, m2)| m2).sum(),
            })
        };
        Errors {
            lights: lights.iter().zip(climbs).enumerate().filter_map(of).collect(),
            area_m2: areas_m2.values().sum(),
        }
    }

    /// What each light aims at next.
    pub(super) fn goals(&self, lights: &[&AimedLight], climbs: &[Climb]) -> Vec<Goal> {
        let has_ladder = |light: &AimedLight, climb: &Climb| {
            !self.has_no_ladder(light, climb) && climb.levels.len() < self.lattices(light).len()
        };
        let known = self.known_errors(lights, climbs);
        let all_known = known.lights.len() == lights.len();
        let Some(target) = self.settings.max_error else {
            return vec![Goal::NextLevel; lights.len()];
        };
        let level_w = known.level_w(target);
        let mut goals: Vec<Goal> = lights.iter().map(|_| Goal::NextLevel).collect();
        for light in &known.lights {
            let &ErrorOfLight { index, flux_w, .. } = light;
            let error_w = known.error_w(light);
            goals[index] = if has_ladder(lights[index], &climbs[index]) {
                let is_negligible =
                    all_known && lights.len() > 1 && error_w < NEGLIGIBLE * level_w.min(1e300);
                if is_negligible && level_w.is_finite() {
                    Goal::Enough
                } else {
                    Goal::NextLevel
                }
            } else if level_w.is_infinite() {
                Goal::Enough
            } else if flux_w > 0.0 {
                Goal::Refine(level_w / flux_w / known.spread(light))
            } else {
                Goal::Enough
            };
        }
        // Without an error there is nothing to aim at once all lattices are through.
        for (index, goal) in goals.iter_mut().enumerate() {
            let is_known = known.lights.iter().any(|light| light.index == index);
            if !is_known
                && !has_ladder(lights[index], &climbs[index])
                && !self.has_no_ladder(lights[index], &climbs[index])
            {
                *goal = Goal::Enough;
            }
        }
        goals
    }
}
