//! Which effects a scene calls for, and why.

mod decide;
mod eye;
mod reach;
mod sealed_regions;

pub use decide::{LightReach, decide, is_wanted, wants_caustics};
pub use eye::{chains, dispersion};
pub use reach::SceneReach;

use serde::{Deserialize, Serialize};

pub use crate::effect::{Effect, EffectSwitch};

/// Whether an effect is on, and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EffectLine {
    /// Which effect.
    pub effect: Effect,
    /// How the user switched it.
    pub switch: EffectSwitch,
    /// Whether it is simulated.
    pub on: bool,
    /// Why, with the names of the objects and lights that cause it.
    pub reason: String,
}

/// The decision for one light.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LightLine {
    /// The light's name.
    pub light: String,
    /// Whether caustic rays leave it.
    pub on: bool,
    /// Why.
    pub reason: String,
}

/// All effects of a scene under given settings, decided once.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct EffectPlan {
    /// One line per effect.
    pub effects: Vec<EffectLine>,
    /// One line per light.
    pub lights: Vec<LightLine>,
}

impl EffectPlan {
    /// Whether an effect is on.
    pub fn is_on(&self, effect: Effect) -> bool {
        self.effects.iter().any(|line| line.effect == effect && line.on)
    }
}
