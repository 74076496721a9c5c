//! The effects that can be simulated or left out, and the user's switch of each.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use strum::{EnumMessage, IntoStaticStr, VariantArray};

/// One effect that can be simulated or left out.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    Serialize,
    Deserialize,
    EnumMessage,
    IntoStaticStr,
    VariantArray,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Effect {
    /// Light pass of the caustic layer at all.
    LightPass,
    /// Light that goes through a surface: solid bodies and panes.
    Refraction,
    /// Refraction by wavelength: spectra.
    Dispersion,
    /// Light that a surface sends back.
    Reflection,
    /// Beer and Lambert's absorption within bodies.
    Absorption,
    /// Base-colour textures of surfaces that light goes on from.
    Textures,
    /// Lobes of rough surfaces that light goes on from.
    Roughness,
    /// Waves and other bumps in the normals of surfaces that light goes on from.
    Bumps,
    /// Size of lamps, suns and the environment.
    AreaLights,
    /// The direct layer.
    Direct,
    /// The indirect layer.
    Indirect,
    /// Waves that run, and what keyframes move.
    Motion,
    /// What the eye sees in mirrors and through glass.
    Chains,
}

impl Effect {
    /// All of them, as they are listed.
    pub const ALL: [Self; 13] = *Self::VARIANTS.as_array().expect("thirteen effects");

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// What it is, in one sentence for people.
    pub fn description(self) -> &'static str {
        match self {
            Self::LightPass => {
                "Light that meets glass, mirrors or water before it falls on diffuse surfaces."
            }
            Self::Refraction => "Light that goes through glass, water and panes.",
            Self::Dispersion => "Glass bends each colour another way, and light is traced by wavelength.",
            Self::Reflection => "Light that mirrors, polish and glass send back.",
            Self::Absorption => "Coloured bodies take light along the way through them (Beer and Lambert).",
            Self::Textures => "Images on mirrors and glass tint the light that goes on from them.",
            Self::Roughness => {
                "Rough mirrors and frosted glass spread the light that goes on from them (GGX)."
            }
            Self::Bumps => {
                "Waves and normal textures of water, glass and mirrors bend the light that goes on from them."
            }
            Self::AreaLights => {
                "Lamps, suns and skies with a size blur caustics; without it each shines from its middle."
            }
            Self::Direct => "Light straight from the lamps, with its shadows.",
            Self::Indirect => "Light that diffuse surfaces send each other.",
            Self::Motion => "Waves run, and animated objects, lights and cameras move.",
            Self::Chains => "What the eye sees in mirrors and through glass.",
        }
    }
}

/// Switch of one effect.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Hash,
    Serialize,
    Deserialize,
    EnumMessage,
    IntoStaticStr,
    VariantArray,
)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum EffectSwitch {
    /// On where the scene calls for it.
    #[default]
    Auto,
    /// Always: what the scene does not call for is looked for all the same.
    On,
    /// Never: light that would need it is booked as switched off.
    Off,
}

/// The switches of all effects; those that are not named are at [`EffectSwitch::Auto`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct EffectSwitches(BTreeMap<Effect, EffectSwitch>);

impl EffectSwitches {
    /// Every effect forced on.
    pub fn all_on() -> Self {
        Self(Effect::ALL.map(|effect| (effect, EffectSwitch::On)).into())
    }

    /// The switch of an effect.
    pub fn get(&self, effect: Effect) -> EffectSwitch {
        self.0.get(&effect).copied().unwrap_or_default()
    }

    /// Sets the switch of an effect.
    pub fn set(&mut self, effect: Effect, switch: EffectSwitch) {
        match switch {
            // One form for the same switches.
            EffectSwitch::Auto => self.0.remove(&effect),
            EffectSwitch::On | EffectSwitch::Off => self.0.insert(effect, switch),
        };
    }

    /// The same with one effect switched.
    #[must_use]
    pub fn with(mut self, effect: Effect, switch: EffectSwitch) -> Self {
        self.set(effect, switch);
        self
    }
}
