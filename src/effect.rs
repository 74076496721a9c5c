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
    /// The caustic layer as a whole.
    LightPass,
    /// Light transmitted by solid bodies and panes.
    Refraction,
    /// Refraction that depends on wavelength: spectra.
    Dispersion,
    /// Light reflected by surfaces.
    Reflection,
    /// Absorption within bodies (Beer and Lambert).
    Absorption,
    /// Base colour textures of specular surfaces.
    Textures,
    /// Lobes of rough specular surfaces.
    Roughness,
    /// Waves and other bumps in the normals of specular surfaces.
    Bumps,
    /// Size of lamps, suns and the environment.
    AreaLights,
    /// The direct layer.
    Direct,
    /// The indirect layer.
    Indirect,
    /// Running waves and keyframe animation.
    Motion,
    /// Reflections and refractions in the eye pass.
    Chains,
}

impl Effect {
    /// All effects, in display order.
    pub const ALL: [Self; 13] = *Self::VARIANTS.as_array().expect("thirteen effects");

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Description for users, in one sentence.
    pub fn description(self) -> &'static str {
        match self {
            Self::LightPass => {
                "Light that meets glass, mirrors or water before it falls on diffuse surfaces."
            }
            Self::Refraction => "Light that goes through glass, water and panes.",
            Self::Dispersion => "Glass bends each colour another way, and light is traced by wavelength.",
            Self::Reflection => "Light that mirrors, coats and glass send back.",
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
    /// Default: on where the scene needs it; where not, it takes nothing.
    #[default]
    Auto,
    /// Always on: what the scene does not need is looked for all the same. More time and memory, the same light.
    On,
    /// Always off: light that needs it is missing, and booked as switched off. Less time and memory.
    Off,
}

/// The switches of all effects; those not listed are at [`EffectSwitch::Auto`].
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
            // Equal switches have a single representation.
            EffectSwitch::Auto => self.0.remove(&effect),
            EffectSwitch::On | EffectSwitch::Off => self.0.insert(effect, switch),
        };
    }

    /// A copy with one effect switched.
    #[must_use]
    pub fn with(mut self, effect: Effect, switch: EffectSwitch) -> Self {
        self.set(effect, switch);
        self
    }
}
