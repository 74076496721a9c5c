//! A share of the rays for each light, by what it can still gain: light adds up on the maps, and so do the squares of its
//! errors. Lights whose error hardly shows beside the others' stay coarse.

use super::caustic::{CausticLayer, Climb};
use crate::light_pass::caustic::setup::AimedLight;
use crate::light_pass::ledger_sum::Account;

/// A light whose error is below this share of what it might be need not even go through all lattices; one whose whole
/// light is, is dim.
const NEGLIGIBLE: f64 = 0.25;

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

/// Errors of lights as they show on the maps.
#[derive(Clone, Debug, Default)]
pub(super) struct Errors {
    /// Of each light that deposits light: its place among the lights, its relative RMSE, and its flux [W].
    pub(super) lights: Vec<(usize, f64, f64)>,
}

impl Errors {
    /// Of all together.
    pub(super) fn relative_rmse(&self) -> f64 {
        let squares: f64 = self.lights.iter().map(|(_, rmse, w)| (rmse * w).powi(2)).sum();
        squares.sqrt() / self.flux_w()
    }

    fn flux_w(&self) -> f64 {
        self.lights.iter().map(|(.., w)| w).sum()
    }

    /// The error [W] that no light may exceed for all to have a relative RMSE of `target`: the largest ones are cut down to
    /// it, the others stay. Infinite where that is so already.
    fn level_w(&self, target: f64) -> f64 {
        let mut errors: Vec<f64> = self.lights.iter().map(|(_, rmse, w)| rmse * w).collect();
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
    /// Whether all that a light can add to the maps is less than the error that is aimed at: then one coarse lattice is
    /// enough, whatever it misses.
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

    /// Errors of all lights; `None` where one is not known yet.
    pub(super) fn errors(&self, lights: &[&AimedLight], climbs: &[Climb]) -> Option<Errors> {
        let known = self.known_errors(lights, climbs);
        (!lights.is_empty() && known.lights.len() == lights.len()).then_some(known)
    }

    /// Errors of the lights that have one.
    pub(super) fn known_errors(&self, lights: &[&AimedLight], climbs: &[Climb]) -> Errors {
        let scene = self.tracer.scene();
        let of = |(index, (light, climb)): (usize, (&&AimedLight, &Climb))| {
            let level = climb.levels.last()?;
            let strength = level.strength(&scene.lights[light.light]);
            let flux_w = level.ledger.watts(Account::Deposited, level.unit, strength);
            Some((index, climb.error()?.relative_rmse, flux_w))
        };
        Errors {
            lights: lights.iter().zip(climbs).enumerate().filter_map(of).collect(),
        }
    }

    /// What each light aims at next.
    pub(super) fn goals(&self, lights: &[&AimedLight], climbs: &[Climb]) -> Vec<Goal> {
        let has_ladder = |light: &AimedLight, climb: &Climb| {
            !self.is_soft(light) && climb.levels.len() < self.lattices(light).len()
        };
        let known = self.known_errors(lights, climbs);
        let all_known = known.lights.len() == lights.len();
        let Some(target) = self.settings.max_error else {
            return vec![Goal::NextLevel; lights.len()];
        };
        let level_w = known.level_w(target);
        let mut goals: Vec<Goal> = lights.iter().map(|_| Goal::NextLevel).collect();
        for &(index, rmse, flux_w) in &known.lights {
            let error_w = rmse * flux_w;
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
                Goal::Refine(level_w / flux_w)
            } else {
                Goal::Enough
            };
        }
        // Without an error there is nothing to aim at once all lattices are through.
        for (index, goal) in goals.iter_mut().enumerate() {
            let is_known = known.lights.iter().any(|(known, ..)| *known == index);
            if !is_known && !has_ladder(lights[index], &climbs[index]) && !self.is_soft(lights[index]) {
                *goal = Goal::Enough;
            }
        }
        goals
    }
}
