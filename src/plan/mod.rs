//! Which effects a scene calls for, and why.

mod decide;
mod eye;
mod reach;
mod sealed_regions;

pub use decide::{LightReach, decide, is_wanted, wants_caustics, weighs_direct};
pub use eye::{chains, dispersion};
pub use reach::SceneReach;

use serde::{Deserialize, Serialize};

use crate::effect::EffectSwitches;
pub use crate::effect::{Effect, EffectSwitch};

/// Whether an effect is on, and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EffectLine {
    pub effect: Effect,
    /// The user's switch.
    pub switch: EffectSwitch,
    /// Whether it is simulated.
    pub on: bool,
    /// Reason, with the names of the objects and lights that cause it.
    pub reason: String,
}

/// The decision for one light.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LightLine {
    /// Name of the light.
    pub light: String,
    /// Whether it emits caustic rays.
    pub on: bool,
    pub reason: String,
}

/// All effects of a scene under given settings, decided once.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct EffectPlan {
    pub effects: Vec<EffectLine>,
    pub lights: Vec<LightLine>,
}

impl EffectPlan {
    pub fn is_on(&self, effect: Effect) -> bool {
        self.effects.iter().any(|line| line.effect == effect && line.on)
    }
}

/// Path effects that a plan switches on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct EffectSet {
    pub transmission: bool,
    pub reflection: bool,
    /// Absorption inside bodies.
    pub absorption: bool,
    /// Textures tint light at specular surfaces.
    pub textures: bool,
    /// Rough surfaces scatter light into lobes.
    pub lobes: bool,
    /// Waves and normal textures perturb normals: see [`super::Tracer::without_bumps`].
    pub bumps: bool,
}

impl EffectSet {
    pub const EVERYTHING: Self = Self {
        transmission: true,
        reflection: true,
        absorption: true,
        textures: true,
        lobes: true,
        bumps: true,
    };

    pub fn of(plan: &EffectPlan) -> Self {
        Self::where_on(|effect| plan.is_on(effect))
    }

    /// Every effect that is not switched off, needed or not.
    pub fn unless_off(switches: &EffectSwitches) -> Self {
        Self::where_on(|effect| switches.get(effect) != EffectSwitch::Off)
    }

    fn where_on(is_on: impl Fn(Effect) -> bool) -> Self {
        Self {
            transmission: is_on(Effect::Refraction),
            reflection: is_on(Effect::Reflection),
            absorption: is_on(Effect::Absorption),
            textures: is_on(Effect::Textures),
            lobes: is_on(Effect::Roughness),
            bumps: is_on(Effect::Bumps),
        }
    }
}
