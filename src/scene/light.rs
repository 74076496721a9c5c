//! Light sources.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use serde::{Deserialize, Serialize};

use super::animation::turned;
use crate::optics::LinearSrgb;
use crate::optics::spectrum::Spectrum;
use crate::units::{Irradiance, Radiance, RadiantIntensity};

/// Geometry and strength of a light: KHR_lights_punctual, EXT_lights_area, emissive surfaces, the environment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightKind {
    /// Uniform in all directions.
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
        /// Half-angle of the cone of full strength [rad], 0 ≤ inner < outer.
        inner_cone_rad: f64,
        /// Half-angle at which the light ends [rad], at most π/2.
        outer_cone_rad: f64,
    },
    /// Parallel light from infinity.
    Sun {
        /// Unit, direction of travel.
        direction: DVec3,
        /// On a plane normal to the beam: glTF's lux divided by 683 lm/W.
        normal_irradiance: Irradiance,
    },
    /// A flat light with the same radiance in all directions of one side.
    Panel {
        /// Centre in scene coordinates [m].
        centre: DVec3,
        /// From the centre to the middle of one side [m].
        across: DVec3,
        /// From the centre to the middle of the next side [m]; the light shines towards `across` × `down`.
        down: DVec3,
        /// Its outline.
        shape: PanelShape,
        /// glTF's cd/m² divided by 683 lm/W.
        radiance: Radiance,
    },
    /// The emissive triangles of an object.
    Surface {
        /// Index into `Scene::objects`.
        object: usize,
        /// glTF's cd/m² divided by 683 lm/W.
        radiance: Radiance,
    },
    /// `Scene::environment`, scaled.
    Environment {
        /// Factor [1], > 0.
        scale: f64,
    },
}

/// Outline of a panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum PanelShape {
    /// Parallelogram spanned by the half-axes.
    Rectangle,
    /// Ellipse with these half-axes.
    Disc,
}

/// Extent of a light that would otherwise be a point or, for a sun, a single direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum LightSize {
    /// No extent.
    #[default]
    None,
    /// Point light: a sphere of uniform radiance. Spot: a disc normal to its axis.
    Radius {
        /// [m], > 0.
        radius_m: f64,
    },
    /// Sun.
    Angle {
        /// Angular diameter [rad], > 0 and at most π.
        diameter_rad: f64,
    },
}

/// A light source.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Name of the node in the file; `lightN` without one.
    pub name: String,
    /// Multiplies the intensity per channel; the luminous-equivalent strength is the intensity times its luminance. The
    /// colour of a spectrum has luminance 1, and a negative channel if it lies outside the gamut of sRGB.
    pub colour: LinearSrgb,
    /// Spectrum, scaled to one luminous-equivalent watt, whose colour is `colour`; `None` if only the colour is known.
    pub spectrum: Option<Arc<Spectrum>>,
    /// Geometry and strength.
    pub kind: LightKind,
    /// Extent, unless the kind defines it.
    pub size: LightSize,
}

/// Edits of the list of lights. Lights of the file come first, in file order, then added ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightList {
    /// Indices of removed lights in the scene as loaded, ascending.
    pub removed: Vec<usize>,
    /// Added lights, as they were when added.
    pub added: Vec<Arc<Light>>,
}

impl Light {
    /// A white light without extent and spectrum.
    pub fn new(name: impl Into<String>, kind: LightKind) -> Self {
        Self {
            name: name.into(),
            colour: LinearSrgb::WHITE,
            spectrum: None,
            kind,
            size: LightSize::None,
        }
    }

    /// Factor on its maps per channel: [`LightKind::strength`] times the colour.
    pub fn strength(&self) -> LinearSrgb {
        self.colour * self.kind.strength()
    }

    /// Sets the spectrum, scaled to one luminous-equivalent watt, and its colour. The luminous strength stays the same
    /// if the old colour had luminance 1.
    pub fn set_spectrum(&mut self, spectrum: Arc<Spectrum>) {
        self.colour = spectrum.xyz().to_linear_srgb();
        self.spectrum = Some(spectrum);
    }

    /// The light, white and of unit strength; keeps its spectrum.
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
    /// Strength without colour: intensity [W/sr], normal irradiance [W/m²] of a sun, radiance [W/(m² sr)] of a panel or
    /// surface, scale [1] of an environment.
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

    /// Direction of travel of the light of a spot or sun.
    pub fn direction(&self) -> Option<DVec3> {
        let mut kind = *self;
        kind.direction_mut().copied()
    }

    pub(super) fn direction_mut(&mut self) -> Option<&mut DVec3> {
        match self {
            Self::Spot { direction, .. } | Self::Sun { direction, .. } => Some(direction),
            _ => None,
        }
    }

    /// Position or centre [m]; `None` for lights without a single place.
    pub fn position(&self) -> Option<DVec3> {
        let mut kind = *self;
        kind.position_mut().copied()
    }

    pub(super) fn position_mut(&mut self) -> Option<&mut DVec3> {
        match self {
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(position),
            Self::Panel { centre, .. } => Some(centre),
            Self::Sun { .. } | Self::Surface { .. } | Self::Environment { .. } => None,
        }
    }

    /// The light translated by `offset` [m].
    pub fn moved(self, offset: DVec3) -> Self {
        self.carried(&DAffine3::from_translation(offset))
    }

    /// The light moved and turned by a transform; panels are scaled too.
    pub fn carried(mut self, carrying: &DAffine3) -> Self {
        if let Some(position) = self.position_mut() {
            *position = carrying.transform_point3(*position);
        }
        if let Some(direction) = self.direction_mut() {
            *direction = turned(*direction, carrying);
        }
        if let Self::Panel { across, down, .. } = &mut self {
            [*across, *down] = [*across, *down].map(|axis| carrying.transform_vector3(axis));
        }
        self
    }
}
