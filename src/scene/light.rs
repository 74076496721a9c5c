//! Light sources.

use glam::DVec3;

use crate::optics::LinearSrgb;
use crate::units::{Irradiance, RadiantIntensity};

/// Where a light is and how strong, KHR_lights_punctual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// The same in every direction.
    Point {
        /// Scene coordinates [m].
        position: DVec3,
        /// glTF's candela divided by 683 lm/W.
        intensity: RadiantIntensity,
    },
    /// A cone with a soft edge.
    Spot {
        /// Scene coordinates [m].
        position: DVec3,
        /// Unit, away from the lamp.
        direction: DVec3,
        /// On the axis: glTF's candela divided by 683 lm/W.
        intensity: RadiantIntensity,
        /// Half-angle of full strength [rad], 0 ≤ inner < outer.
        inner_cone_rad: f64,
        /// Half-angle at which it ends [rad], at most π/2.
        outer_cone_rad: f64,
    },
    /// Parallel light from infinitely far.
    Sun {
        /// Unit, the way the light travels.
        direction: DVec3,
        /// Measured across the beam: glTF's lux divided by 683 lm/W.
        normal_irradiance: Irradiance,
    },
}

/// A light with its colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// The node's name in the file; `lightN` when it has none.
    pub name: String,
    /// Multiplies the intensity per channel; a light's luminous-equivalent strength is intensity × its luminance.
    pub colour: LinearSrgb,
    /// Where and how strong.
    pub kind: LightKind,
}

impl Light {
    /// What its maps are multiplied by per channel: intensity [W/sr] or, for suns, normal irradiance [W/m²], times the
    /// colour.
    pub fn strength(&self) -> LinearSrgb {
        self.colour
            * match self.kind {
                LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. } => intensity.0,
                LightKind::Sun {
                    normal_irradiance, ..
                } => normal_irradiance.0,
            }
    }

    /// The same light, white and of 1 W/sr or 1 W/m².
    #[must_use]
    pub fn of_unit_strength(&self) -> Self {
        let mut kind = self.kind;
        match &mut kind {
            LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. } => {
                *intensity = RadiantIntensity(1.0);
            }
            LightKind::Sun {
                normal_irradiance, ..
            } => *normal_irradiance = Irradiance(1.0),
        }
        Self {
            name: self.name.clone(),
            colour: LinearSrgb::WHITE,
            kind,
        }
    }
}

impl LightKind {
    /// Fall-off of a spot, [0, 1]: the square of a linear ramp in the cosine (KHR_lights_punctual); 1 for the others.
    /// `direction` is unit and points away from the light.
    pub fn falloff(&self, direction: DVec3) -> f64 {
        match *self {
            Self::Spot {
                direction: axis,
                inner_cone_rad,
                outer_cone_rad,
                ..
            } => {
                let (cos_outer, cos_inner) = (outer_cone_rad.cos(), inner_cone_rad.cos());
                let cosine = axis.dot(direction);
                let ramp = if cos_inner > cos_outer {
                    ((cosine - cos_outer) / (cos_inner - cos_outer)).clamp(0.0, 1.0)
                } else {
                    f64::from(u8::from(cosine >= cos_outer))
                };
                ramp * ramp
            }
            Self::Point { .. } | Self::Sun { .. } => 1.0,
        }
    }

    /// The same light moved by `offset` [m].
    pub fn moved(self, offset: DVec3) -> Self {
        match self {
            Self::Point { position, intensity } => Self::Point {
                position: position + offset,
                intensity,
            },
            Self::Spot {
                position,
                direction,
                intensity,
                inner_cone_rad,
                outer_cone_rad,
            } => Self::Spot {
                position: position + offset,
                direction,
                intensity,
                inner_cone_rad,
                outer_cone_rad,
            },
            sun @ Self::Sun { .. } => sun,
        }
    }
}
