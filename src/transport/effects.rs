//! The effects that the paths of a light pass need.

use crate::plan::{Effect, EffectPlan};

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
        Self {
            transmission: plan.is_on(Effect::Refraction),
            reflection: plan.is_on(Effect::Reflection),
            absorption: plan.is_on(Effect::Absorption),
            textures: plan.is_on(Effect::Textures),
            lobes: plan.is_on(Effect::Roughness),
            bumps: plan.is_on(Effect::Bumps),
        }
    }
}
