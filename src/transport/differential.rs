//! Ray differentials: the derivatives of a ray with respect to its start in the launch domain (Igehy, "Tracing Ray
//! Differentials", SIGGRAPH 1999), through every reflection and refraction.

use glam::DVec3;

use super::bend;
use super::curvature;
use super::interaction::{Branch, Event, NormalSource};
use super::microfacets::MicrofacetEvent;
use super::{SurfaceHit, Tracer};
use crate::geometry::Ray;

/// Derivatives of a ray with respect to one coordinate of the unit square that it is launched from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RayDerivative {
    /// [m].
    pub origin: DVec3,
    /// Perpendicular to the ray's direction [1].
    pub direction: DVec3,
}

/// Derivatives of a ray with respect to both coordinates of its launch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RayDifferential {
    /// With respect to the first coordinate.
    pub across: RayDerivative,
    /// With respect to the second coordinate.
    pub down: RayDerivative,
}

impl RayDifferential {
    /// Applies one function to both derivatives.
    #[must_use]
    pub fn map(self, f: impl Fn(RayDerivative) -> RayDerivative) -> Self {
        Self {
            across: f(self.across),
            down: f(self.down),
        }
    }

    pub fn is_finite(&self) -> bool {
        [self.across, self.down]
            .iter()
            .all(|derivative| derivative.origin.is_finite() && derivative.direction.is_finite())
    }
}

/// Geometry from which surface derivatives are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceScale {
    /// The smooth surface that the mesh approximates, for steps longer than its triangles.
    Smooth,
    /// The triangle alone, for steps within it.
    Facet,
}

/// Detail of the normals that surface derivatives include.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceDetail {
    /// All bumps.
    Bumps,
    /// The mesh's normals only, for steps longer than all bumps.
    Mesh,
}

impl Tracer {
    /// Scale for a ray differential [m, at the hit]: smooth once its steps leave the triangle that was hit. `steps` are
    /// in units of the launch coordinates.
    pub fn surface_scale(&self, hit: &SurfaceHit, moved: &RayDifferential, steps: [f64; 2]) -> SurfaceScale {
        let [a, b, c] = self.scene().objects[hit.object].in_scene().corners(hit.triangle);
        let shortest = a
            .distance_squared(b)
            .min(b.distance_squared(c))
            .min(c.distance_squared(a));
        let longest_step = (moved.across.origin.length_squared() * steps[0] * steps[0])
            .max(moved.down.origin.length_squared() * steps[1] * steps[1]);
        if 4.0 * longest_step < shortest {
            SurfaceScale::Facet
        } else {
            SurfaceScale::Smooth
        }
    }

    /// Transfers a differential to the ray's hit: the origin's derivatives become those of the hit point, within the
    /// tangent plane of the surface at the given scale.
    pub fn transfer(
        &self,
        ray: &Ray,
        hit: &SurfaceHit,
        differential: &RayDifferential,
        scale: SurfaceScale,
    ) -> RayDifferential {
        let normal = match scale {
            SurfaceScale::Facet => hit.geometric_normal,
            SurfaceScale::Smooth => hit.interpolated_normal,
        };
        let slope = ray.direction.dot(normal);
        differential.map(|derivative| {
            let free = derivative.origin + derivative.direction * hit.distance_m;
            RayDerivative {
                origin: free - ray.direction * (free.dot(normal) / slope),
                direction: derivative.direction,
            }
        })
    }

    /// Differential of a branch that leaves a hit, from that of the incident ray at the hit.
    pub fn differential_after(
        &self,
        incident: DVec3,
        hit: &SurfaceHit,
        at_hit: &RayDifferential,
        branch: &Branch,
        surface: (SurfaceScale, SurfaceDetail),
    ) -> RayDifferential {
        let normal_change_of = |derivative: &RayDerivative| {
            if branch.by == NormalSource::Geometric {
                DVec3::ZERO
            } else {
                self.normal_change(hit, branch.normal, derivative.origin, surface)
            }
        };
        if let NormalSource::Micro(facet) = branch.by {
            let turn = match branch.event {
                Event::Refraction => MicrofacetEvent::Refracted {
                    eta: 1.0 / branch.ior_ratio,
                },
                Event::ThinTransmission | Event::Passage => MicrofacetEvent::ThroughThinWall,
                Event::Reflection | Event::TotalInternalReflection => MicrofacetEvent::Reflected,
            };
            return at_hit.map(|derivative| RayDerivative {
                origin: derivative.origin,
                direction: facet.scattered_derivative(
                    (incident, derivative.direction),
                    (branch.normal, normal_change_of(&derivative)),
                    turn,
                ),
            });
        }
        if matches!(branch.event, Event::ThinTransmission | Event::Passage) {
            return *at_hit;
        }
        at_hit.map(|derivative| {
            let normal_change = normal_change_of(&derivative);
            let cos_change = -(derivative.direction.dot(branch.normal) + incident.dot(normal_change));
            let cos_incident = -incident.dot(branch.normal);
            let direction = match branch.event {
                Event::Refraction => {
                    // d' = (d + n·c)/η − n·cos θt, with cos²θt = (η² − 1 + c²)/η².
                    let inverse_eta = branch.ior_ratio;
                    let cos_transmitted = -branch.ray.direction.dot(branch.normal);
                    let cos_transmitted_change =
                        cos_incident * cos_change * inverse_eta * inverse_eta / cos_transmitted;
                    (derivative.direction + normal_change * cos_incident + branch.normal * cos_change)
                        * inverse_eta
                        - normal_change * cos_transmitted
                        - branch.normal * cos_transmitted_change
                }
                // d' = d + 2·n·c.
                _ => derivative.direction + (normal_change * cos_incident + branch.normal * cos_change) * 2.0,
            };
            RayDerivative {
                origin: derivative.origin,
                direction,
            }
        })
    }

    /// Change of the shading normal, oriented like `normal`, for a step [m] along the surface.
    fn normal_change(
        &self,
        hit: &SurfaceHit,
        normal: DVec3,
        step: DVec3,
        (scale, detail): (SurfaceScale, SurfaceDetail),
    ) -> DVec3 {
        let mesh = self.scene().objects[hit.object].in_scene();
        let change = match (scale, self.normal_field(hit.object)) {
            (SurfaceScale::Smooth, Some(field)) => {
                let change = field.turn(mesh, hit.triangle, hit.barycentric, step);
                change - hit.interpolated_normal * hit.interpolated_normal.dot(change)
            }
            _ => curvature::turn_within(mesh, hit.triangle, hit.barycentric, step),
        };
        let gradient = match detail {
            SurfaceDetail::Bumps => self.bump_gradient(hit),
            SurfaceDetail::Mesh => None,
        };
        let change = match gradient {
            Some(gradient) => bend::bent_change(
                hit.interpolated_normal,
                gradient,
                change,
                self.bump_gradient_change(hit, step),
            ),
            None => change,
        };
        if normal.dot(hit.shading_normal) < 0.0 {
            -change
        } else {
            change
        }
    }
}
