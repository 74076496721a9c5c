//! Rough surfaces: light reflects and refracts about a sampled micro-normal (Walter et al., "Microfacet Models for
//! Refraction through Rough Surfaces", EGSR 2007).
//!
//! Micro-normals are those of the GGX distribution that are visible to the incoming light, drawn by a point of the unit
//! square. Where that point is held fixed the micro-normal is a smooth function of direction and place, so that a
//! wavefront stays one; the mean over all points is the lobe.
//!
//! Each draw sends the whole of its share on: what a micro-facet would send into the surface is mirrored out of it. That
//! stands for light that bounces between micro-facets, which the distribution alone would lose; the shadowing of what
//! leaves is left out for the same reason, so that a surface that absorbs nothing sends on exactly what arrives.

use glam::{DVec2, DVec3};

use crate::optics::refraction;

/// A sampled microfacet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// GGX α: the square of glTF's roughness.
    pub alpha: f64,
    /// Sample of the unit square that selects the microfacet.
    pub point: DVec2,
}

/// Scattering event at a microfacet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MicrofacetEvent {
    Reflected,
    /// Through an interface.
    Refracted {
        /// n_t/n_i.
        eta: f64,
    },
    /// Through a wall without thickness: the mirror image of the reflection.
    ThroughThinWall,
}

impl Facet {
    /// Unit normal for light along the unit vector `incident` on a surface of unit normal `normal` (incident · normal <
    /// 0), sampled among the visible ones (Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical Caps",
    /// 2023).
    pub fn normal(&self, incident: DVec3, normal: DVec3) -> DVec3 {
        let (x, y) = frame(normal);
        let to_light = -incident;
        let local = DVec3::new(to_light.dot(x), to_light.dot(y), to_light.dot(normal));
        let stretched = DVec3::new(self.alpha * local.x, self.alpha * local.y, local.z).normalize();
        let z = (1.0 - self.point.y) * (1.0 + stretched.z) - stretched.z;
        let sine = (1.0 - z * z).clamp(0.0, 1.0).sqrt();
        let (s, c) = (std::f64::consts::TAU * self.point.x).sin_cos();
        let half = DVec3::new(sine * c, sine * s, z) + stretched;
        let micro = DVec3::new(self.alpha * half.x, self.alpha * half.y, half.z.max(0.0)).normalize();
        (x * micro.x + y * micro.y + normal * micro.z).normalize()
    }

    /// Scattered direction; `None` for total internal reflection.
    pub fn scattered(&self, incident: DVec3, normal: DVec3, event: MicrofacetEvent) -> Option<DVec3> {
        let micro = self.normal(incident, normal);
        let (direction, side) = match event {
            MicrofacetEvent::Reflected => (refraction::reflect(incident, micro), 1.0),
            MicrofacetEvent::Refracted { eta } => (refraction::refract(incident, micro, eta)?, -1.0),
            MicrofacetEvent::ThroughThinWall => {
                let back = out_of(refraction::reflect(incident, micro), normal, 1.0);
                (mirrored(back, normal), -1.0)
            }
        };
        Some(out_of(direction, normal, side))
    }
}

/// Radiance that a rough mirror reflects per irradiance across a beam [1/sr], at a reflectance of 1: the GGX distribution
/// with the height-correlated shadowing of Smith (Heitz, "Understanding the Masking-Shadowing Function in
/// Microfacet-Based BRDFs", JCGT 2014), times the cosine of incidence. 0 where eye or light is behind the surface.
pub fn ggx_reflection(normal: DVec3, to_eye: DVec3, to_light: DVec3, alpha_squared: f64) -> f64 {
    let [eye, light] = [to_eye, to_light].map(|direction| direction.dot(normal));
    if eye <= 0.0 || light <= 0.0 {
        return 0.0;
    }
    let half = (to_eye + to_light).normalize();
    let cos_half = half.dot(normal);
    // sin² + α² cos² of the half vector; the sine from a cross product keeps its digits in narrow lobes.
    let sine = half.cross(normal).length_squared();
    let stretched = sine + alpha_squared * cos_half * cos_half;
    let distribution = alpha_squared / (std::f64::consts::PI * stretched * stretched);
    let hidden = |cosine: f64| (alpha_squared + (1.0 - alpha_squared) * cosine * cosine).sqrt();
    distribution * light * 0.5 / (light * hidden(eye) + eye * hidden(light))
}

/// Mirror image of a direction in the plane perpendicular to a unit normal.
fn mirrored(direction: DVec3, normal: DVec3) -> DVec3 {
    direction - normal * (2.0 * direction.dot(normal))
}

/// The direction, mirrored if necessary to lie on one side of the plane perpendicular to `normal`: 1 in front, -1
/// behind.
pub fn out_of(direction: DVec3, normal: DVec3, side: f64) -> DVec3 {
    if direction.dot(normal) * side >= 0.0 {
        direction
    } else {
        mirrored(direction, normal)
    }
}

/// Singularity of [`frame`], which no tangent field on a sphere can avoid: a direction that surfaces are rarely built
/// along.
const POLE: DVec3 = DVec3::new(
    -0.362_357_181_989_727_66,
    -0.815_303_659_476_887_2,
    0.451_638_368_060_176_6,
);

/// Two unit tangents of a unit normal, smooth except at [`POLE`] (Frisvad 2012, rotated to put the singularity there).
fn frame(normal: DVec3) -> (DVec3, DVec3) {
    // The rotation about POLE × normal that takes −POLE to the normal, applied to two fixed tangents.
    let (x, y) = POLE_TANGENTS;
    let divisor = 1.0 - POLE.dot(normal);
    if divisor <= 1e-12 {
        return (x, -y);
    }
    let turned = |tangent: DVec3| tangent + (POLE - normal) * (tangent.dot(normal) / divisor);
    (turned(x), turned(y))
}

/// Unit vectors perpendicular to [`POLE`] and to each other.
const POLE_TANGENTS: (DVec3, DVec3) = (
    DVec3::new(-0.913_811_548_620_257_3, 0.406_138_466_053_447_7, 0.0),
    DVec3::new(
        -0.183_427_714_014_842_5,
        -0.412_712_356_533_395_66,
        -0.892_201_089_719_096_3,
    ),
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_smooth() {
        let mut worst: f64 = 0.0;
        for index in 0..2000 {
            let square = crate::geometry::sampling::even_point(index, 0, 1);
            let z = 1.0 - 2.0 * square.x;
            let (s, c) = (std::f64::consts::TAU * square.y).sin_cos();
            let normal = DVec3::new((1.0 - z * z).sqrt() * c, (1.0 - z * z).sqrt() * s, z);
            let (x, y) = frame(normal);
            for product in [
                x.dot(y),
                x.dot(normal),
                y.dot(normal),
                x.length() - 1.0,
                y.length() - 1.0,
            ] {
                worst = worst.max(product.abs());
            }
            // Neighbouring frames are close, except near the pole.
            if normal.dot(POLE) < 0.9 {
                let next = (normal + DVec3::new(1e-4, -2e-4, 1.5e-4)).normalize();
                assert!(frame(next).0.distance(x) < 1e-2, "{normal}");
            }
        }
        assert!(worst < 1e-12, "{worst}");
    }
}
