//! What a light sends to a point.

use glam::DVec3;

use super::facet::SurfacePoint;
use crate::light_pass::emitter::{Emitter, EmitterKind};
use crate::optics::LinearSrgb;
use crate::optics::fresnel::dielectric_reflectance;
use crate::scene::{Material, SurfaceKind};

/// Light on its way to a point.
pub struct Arriving {
    /// E that it would give there [W/m²].
    pub irradiance: LinearSrgb,
    /// Unit.
    pub to_light: DVec3,
    /// To the light [m], infinite for a sun.
    pub distance_m: f64,
}

impl Arriving {
    /// What a source gives a point if nothing stands in its way; `None` where it sends nothing, or to the wrong side.
    /// A mixed surface takes what its polish does not reflect.
    pub fn unshadowed(emitter: &Emitter, point: &SurfacePoint, material: &Material) -> Option<Self> {
        let (to_light, distance_m, across_beam) = match (emitter.kind, emitter.kind.position()) {
            (EmitterKind::Parallel { direction }, _) => (-direction, f64::INFINITY, 1.0),
            (kind, Some(position)) => {
                let offset = position - point.position;
                let to_light = offset.try_normalize()?;
                let share = kind.falloff(-to_light);
                (to_light, offset.length(), share / offset.length_squared())
            }
            (_, None) => return None,
        };
        let side = if to_light.dot(point.geometric_normal) >= 0.0 {
            1.0
        } else if material.double_sided {
            -1.0
        } else {
            return None;
        };
        let cosine = side * to_light.dot(point.shading_normal);
        let taken = match material.surface {
            SurfaceKind::Mixed => 1.0 - dielectric_reflectance(cosine, material.ior),
            _ => 1.0,
        };
        let strength = across_beam * cosine * taken;
        (strength > 0.0).then(|| Self {
            irradiance: emitter.strength * strength,
            to_light,
            distance_m,
        })
    }
}
