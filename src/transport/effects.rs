//! The effects that the paths of a light pass need.

use crate::plan::{Effect, EffectPlan};

/// Effects of paths, as a plan decides them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct EffectSet {
    /// Light goes through surfaces.
    pub transmission: bool,
    /// Surfaces send light back.
    pub reflection: bool,
    /// Bodies absorb light along the way.
    pub absorption: bool,
    /// Textures tint what goes on from specular surfaces.
    pub textures: bool,
    /// Rough surfaces spread what they send on.
    pub lobes: bool,
    /// Normals are bent by what no mesh shows: see [`super::Tracer::without_bumps`].
    pub bumps: bool,
}

impl EffectSet {
    /// Every effect.
    pub const EVERYTHING: Self = Self {
        transmission: true,
        reflection: true,
        absorption: true,
        textures: true,
        lobes: true,
        bumps: true,
    };

    /// The effects that are on in a plan.
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
