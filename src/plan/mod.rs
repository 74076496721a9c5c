//! Which effects a scene calls for, and why.

mod decide;

pub use decide::{CastersByLight, decide};

use serde::{Deserialize, Serialize};

/// One effect that can be simulated or left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Effect {
    /// Light pass at all.
    LightPass,
    /// Refraction branch.
    Refraction,
    /// Reflection branch.
    Reflection,
    /// Beer-Lambert absorption in volumes.
    Absorption,
    /// Direct layer.
    Direct,
}

impl Effect {
    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::LightPass => "light_pass",
            Self::Refraction => "refraction",
            Self::Reflection => "reflection",
            Self::Absorption => "absorption",
            Self::Direct => "direct",
        }
    }
}

/// Whether an effect is on, and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EffectLine {
    /// Which effect.
    pub effect: Effect,
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
