//! Irradiance of a point from one light.

use glam::DVec3;

use super::facet::SurfacePoint;
use crate::optics::LinearSrgb;
use crate::scene::Scene;
use crate::scene::emitter::Emitter;
use crate::transport::{DiffuseResponse, MediumStack};

/// Light that arrives at a point, whatever surface is there.
pub struct IncidentLight {
    /// Unit vector.
    pub to_light: DVec3,
    /// Infinite for a sun.
    pub distance_m: f64,
    /// E at unit strength on a surface that faces the light.
    pub across_beam: f64,
    pub strength: LinearSrgb,
}

impl IncidentLight {
    /// `None` at the source itself.
    pub fn new(emitter: &Emitter, point: DVec3) -> Option<Self> {
        Self::of_patch(emitter, point, 0.0)
    }

    /// A source that represents a patch of a surface: see [`EmitterKind::seen_from`](crate::scene::emitter::EmitterKind::seen_from).
    pub fn of_patch(emitter: &Emitter, point: DVec3, patch_m2: f64) -> Option<Self> {
        let (to_light, distance_m, across_beam) = emitter.kind.seen_from(point, patch_m2)?;
        Some(Self {
            to_light,
            distance_m,
            across_beam,
            strength: emitter.strength,
        })
    }
}

/// Unoccluded light that arrives at a surface.
pub struct UnshadowedLight {
    /// E [W/m²].
    pub irradiance: LinearSrgb,
    /// Unit vector.
    pub to_light: DVec3,
    /// Infinite for a sun.
    pub distance_m: f64,
    /// E at unit strength, before the coat reflects its share and the medium absorbs its own.
    pub unoccluded: f64,
}

impl UnshadowedLight {
    /// `None` if the light comes from behind the surface or none of it is left. Its whole path lies in the media
    /// around the source.
    pub fn from_beam(
        beam: &IncidentLight,
        point: &SurfacePoint,
        response: &DiffuseResponse,
        (scene, media): (&Scene, &MediumStack),
    ) -> Option<Self> {
        if beam.to_light.dot(point.geometric_normal) < 0.0 {
            return None;
        }
        let cosine = beam.to_light.dot(point.shading_normal);
        let unoccluded = beam.across_beam * cosine;
        let strength = media.transmittance(scene, beam.distance_m)
            * (unoccluded * response.of(cosine, media.ior(scene)));
        (strength.max_channel() > 0.0).then(|| Self {
            irradiance: beam.strength * strength,
            to_light: beam.to_light,
            distance_m: beam.distance_m,
            unoccluded,
        })
    }
}
