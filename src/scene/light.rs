//! Light sources.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use serde::{Deserialize, Serialize};

use super::animation::turned;
use crate::optics::LinearSrgb;
use crate::optics::spectrum::Spectrum;
use crate::units::{Irradiance, Radiance, RadiantIntensity};

/// Where a light is and how strong: KHR_lights_punctual, EXT_lights_area, what glows, and what lies around.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    /// A flat lamp that sends the same radiance into all directions of one side.
    Panel {
        /// Of its middle, scene coordinates [m].
        centre: DVec3,
        /// From the middle to the middle of one side [m].
        across: DVec3,
        /// From the middle to the middle of the next side [m]; it shines to the side of `across` × `down`.
        down: DVec3,
        /// Its outline.
        shape: PanelShape,
        /// glTF's cd/m² divided by 683 lm/W.
        radiance: Radiance,
    },
    /// The triangles of an object that glow.
    Surface {
        /// Index into `Scene::objects`.
        object: usize,
        /// glTF's cd/m² divided by 683 lm/W.
        radiance: Radiance,
    },
    /// `Scene::environment`, so many times as bright.
    Environment {
        /// Factor [1], > 0.
        scale: f64,
    },
}

/// Outline of a flat lamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum PanelShape {
    /// The parallelogram of its half-axes.
    Rectangle,
    /// The ellipse of its half-axes.
    Disc,
}

/// How large a lamp is that would else be a point, or a sun that would else be one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum LightSize {
    /// Not at all.
    #[default]
    None,
    /// Of a point light: a ball that sends the same radiance everywhere. Of a spot: a disc across its axis.
    Radius {
        /// [m], > 0.
        radius_m: f64,
    },
    /// Of a sun.
    Angle {
        /// Full angle across its disc [rad], > 0 and at most π.
        diameter_rad: f64,
    },
}

/// A light with its colour.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// The node's name in the file; `lightN` when it has none.
    pub name: String,
    /// Multiplies the intensity per channel; a light's luminous-equivalent strength is intensity × its luminance. That
    /// of a spectrum has the luminance 1, and a channel below 0 where the spectrum lies outside of sRGB.
    pub colour: LinearSrgb,
    /// Its light by wavelength, scaled to one luminous-equivalent watt, of which `colour` is the colour; `None` where
    /// that is all that is known.
    pub spectrum: Option<Arc<Spectrum>>,
    /// Where and how strong.
    pub kind: LightKind,
    /// How large, where the kind does not say it.
    pub size: LightSize,
}

/// What edits did to the list of lights: those of the file come first, in its order, and then those that were added.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightList {
    /// Places of lights that were taken out, among those of the scene as it was loaded, ascending.
    pub removed: Vec<usize>,
    /// Lights that were added, as they were then.
    pub added: Vec<Arc<Light>>,
}

impl Light {
    /// A white light without a size or a spectrum.
    pub fn new(name: impl Into<String>, kind: LightKind) -> Self {
        Self {
            name: name.into(),
            colour: LinearSrgb::WHITE,
            spectrum: None,
            kind,
            size: LightSize::None,
        }
    }

    /// What its maps are multiplied by per channel: [`LightKind::strength`] times the colour.
    pub fn strength(&self) -> LinearSrgb {
        self.colour * self.kind.strength()
    }

    /// Gives it a spectrum, scaled to one luminous-equivalent watt, and the spectrum's colour; as bright as it was
    /// if its colour had the luminance 1.
    pub fn set_spectrum(&mut self, spectrum: Arc<Spectrum>) {
        self.colour = spectrum.xyz().to_linear_srgb();
        self.spectrum = Some(spectrum);
    }

    /// The same light, white and of strength 1; its spectrum stays.
    #[must_use]
    pub fn of_unit_strength(&self) -> Self {
        let mut kind = self.kind;
        kind.set_strength(1.0);
        Self {
            colour: LinearSrgb::WHITE,
            kind,
            ..self.clone()
        }
    }

    /// Whether its light comes from more than one point or direction.
    pub fn has_extent(&self) -> bool {
        match self.kind {
            LightKind::Point { .. } | LightKind::Spot { .. } | LightKind::Sun { .. } => {
                self.size != LightSize::None
            }
            LightKind::Panel { .. } | LightKind::Surface { .. } | LightKind::Environment { .. } => true,
        }
    }
}

impl LightKind {
    /// Its strength alone: intensity [W/sr], normal irradiance [W/m²] of a sun, radiance [W/(m² sr)] of what glows,
    /// the scale [1] of an environment.
    pub fn strength(&self) -> f64 {
        match *self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => intensity.0,
            Self::Sun {
                normal_irradiance, ..
            } => normal_irradiance.0,
            Self::Panel { radiance, .. } | Self::Surface { radiance, .. } => radiance.0,
            Self::Environment { scale } => scale,
        }
    }

    /// Sets [`strength`](Self::strength).
    pub fn set_strength(&mut self, strength: f64) {
        match self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => {
                *intensity = RadiantIntensity(strength);
            }
            Self::Sun {
                normal_irradiance, ..
            } => *normal_irradiance = Irradiance(strength),
            Self::Panel { radiance, .. } | Self::Surface { radiance, .. } => *radiance = Radiance(strength),
            Self::Environment { scale } => *scale = strength,
        }
    }

    /// The way a spot's or a sun's light travels.
    pub fn direction(&self) -> Option<DVec3> {
        match *self {
            Self::Spot { direction, .. } | Self::Sun { direction, .. } => Some(direction),
            _ => None,
        }
    }

    /// Where it is [m], or its middle; `None` for what has no single place.
    pub fn position(&self) -> Option<DVec3> {
        match *self {
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(position),
            Self::Panel { centre, .. } => Some(centre),
            Self::Sun { .. } | Self::Surface { .. } | Self::Environment { .. } => None,
        }
    }

    /// The same light moved by `offset` [m].
    pub fn moved(self, offset: DVec3) -> Self {
        self.carried(&DAffine3::from_translation(offset))
    }

    /// The same light, moved and turned; panels are scaled too.
    pub fn carried(mut self, carrying: &DAffine3) -> Self {
        match &mut self {
            Self::Point { position, .. } => *position = carrying.transform_point3(*position),
            Self::Spot {
                position, direction, ..
            } => {
                *position = carrying.transform_point3(*position);
                *direction = turned(*direction, carrying);
            }
            Self::Sun { direction, .. } => *direction = turned(*direction, carrying),
            Self::Panel {
                centre, across, down, ..
            } => {
                *centre = carrying.transform_point3(*centre);
                [*across, *down] = [*across, *down].map(|axis| carrying.transform_vector3(axis));
            }
            Self::Surface { .. } | Self::Environment { .. } => {}
        }
        self
    }
}
