//! The launch domain of a light: one or six unit squares, mapped so that the flux per unit area is known.

use glam::{DMat3, DVec2, DVec3};

use super::emitter::{Emitter, EmitterKind};
use crate::geometry::Ray;
use crate::geometry::cube_face::{self, FaceMapping};
use crate::optics::LinearSrgb;
use crate::scene::Scene;
use crate::settings::ItemBufferKind;
use crate::transport::MediumStack;

/// Launch domain of one wavefront.
#[derive(Clone, Debug, PartialEq)]
pub struct Launch {
    emitter: Emitter,
    domain: Domain,
    media: MediumStack,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Domain {
    /// Six cube faces around a point.
    Sphere { position: DVec3, mapping: FaceMapping },
    /// A rectangle across parallel light, in front of the whole scene.
    Plane {
        corner: DVec3,
        across: DVec3,
        down: DVec3,
        direction: DVec3,
    },
}

/// Sides from this length on, about 1,600 rays per steradian, are rounded to multiples of powers of two, so that
/// lattices nest [cells].
const FIRST_NESTED_SIDE: f64 = 58.0;

/// Sides up to this length may be odd [cells].
const ODD_SIDES: f64 = 16.0;

/// Cells along a side: `wanted`, rounded up so that lattices nest.
fn nested_side(wanted: f64) -> usize {
    let doublings = (wanted / FIRST_NESTED_SIDE).log2().floor().clamp(0.0, 24.0);
    let base = wanted / doublings.exp2();
    let even = if base > ODD_SIDES { 2.0 } else { 1.0 };
    ((base / even).ceil() * even * doublings.exp2()).clamp(1.0, 1e9) as usize
}

impl Launch {
    /// The domain of a source. For parallel light it is the smallest rectangle around all `casters` (indices of
    /// specular objects), in a frame that depends on the direction alone, moved in front of the whole scene. `None` if
    /// there is nothing to aim at.
    pub fn new(
        emitter: Emitter,
        scene: &Scene,
        casters: &[usize],
        item_buffer: ItemBufferKind,
    ) -> Option<Self> {
        let mapping = match item_buffer {
            ItemBufferKind::Equal => FaceMapping::EqualSolidAngle,
            ItemBufferKind::Cube => FaceMapping::Plain,
        };
        let domain = match emitter.kind {
            EmitterKind::Point { position }
            | EmitterKind::Spot { position, .. }
            | EmitterKind::Facet { position, .. } => Domain::Sphere { position, mapping },
            EmitterKind::Parallel { direction } => sun_domain(direction, scene, casters)?,
        };
        Some(Self {
            emitter,
            domain,
            media: MediumStack::default(),
        })
    }

    /// The same light inside these media.
    #[must_use]
    pub fn within(self, media: MediumStack) -> Self {
        Self { media, ..self }
    }

    /// The same light, so many times as strong.
    #[must_use]
    pub fn scaled(mut self, strength: LinearSrgb) -> Self {
        self.emitter.strength = self.emitter.strength * strength;
        self
    }

    /// The media in which its rays start; none for parallel light.
    pub fn media(&self) -> &MediumStack {
        &self.media
    }

    pub fn emitter(&self) -> &Emitter {
        &self.emitter
    }

    /// Whether the domain is fitted to the casters.
    pub fn is_fitted(&self) -> bool {
        matches!(self.domain, Domain::Plane { .. })
    }

    /// Number of unit squares.
    pub fn face_count(&self) -> usize {
        match self.domain {
            Domain::Sphere { .. } => 6,
            Domain::Plane { .. } => 1,
        }
    }

    /// Lattice cells across and down each face at a density [1/sr]. Suns take density/D² rays per m²: D, `reach_m`, is
    /// the distance from the casters' centre to their farthest receiver.
    ///
    /// Sides are rounded up to multiples of powers of two, by a thirtieth at most, so that the lattice of a quarter of
    /// the density consists of every second ray of this one.
    pub fn lattice_size(&self, density_per_sr: f64, reach_m: f64) -> (usize, usize) {
        match self.domain {
            Domain::Sphere { .. } => {
                let side = nested_side((density_per_sr * cube_face::FACE_SOLID_ANGLE_SR).sqrt());
                (side, side)
            }
            Domain::Plane { across, down, .. } => {
                let rays_per_m = density_per_sr.sqrt() / reach_m;
                (
                    nested_side(across.length() * rays_per_m),
                    nested_side(down.length() * rays_per_m),
                )
            }
        }
    }

    /// The ray of a point of the domain; `square` is in the unit square of `face`.
    pub fn ray(&self, face: usize, square: DVec2) -> Ray {
        match self.domain {
            Domain::Sphere { position, mapping } => {
                let direction = mapping.plane_from_square(square).extend(1.0).normalize();
                Ray {
                    origin: position,
                    direction: cube_face::axes_from_face(face) * direction,
                }
            }
            Domain::Plane {
                corner,
                across,
                down,
                direction,
            } => Ray {
                origin: corner + across * square.x + down * square.y,
                direction,
            },
        }
    }

    /// The ray through a point of the scene, and the distance of the point along it [m]. The direction is arbitrary for
    /// a point at the light itself.
    pub fn ray_through(&self, point: DVec3) -> (Ray, f64) {
        match self.domain {
            Domain::Sphere { position, .. } => {
                let path = point - position;
                let ray = Ray {
                    origin: position,
                    direction: path.normalize_or(DVec3::Z),
                };
                (ray, path.length())
            }
            Domain::Plane {
                corner, direction, ..
            } => {
                let path_m = (point - corner).dot(direction);
                let ray = Ray {
                    origin: point - direction * path_m,
                    direction,
                };
                (ray, path_m)
            }
        }
    }

    /// Flux [W per channel] through the cell between two corners of the unit square, whose ray has the given direction.
    /// The light's strength is taken in that direction.
    pub fn cell_flux_w(&self, low: DVec2, high: DVec2, direction: DVec3) -> LinearSrgb {
        let measure = self.cell_measure(low, high);
        self.emitter.strength * (self.emitter.kind.falloff(direction) * measure)
    }

    /// Flux per unit area of the unit square [W per channel] at a point of it, whose ray has the given direction.
    pub fn flux_density_w(&self, square: DVec2, direction: DVec3) -> LinearSrgb {
        let measure = match self.domain {
            Domain::Sphere {
                mapping: FaceMapping::Plain,
                ..
            } => {
                let plane = FaceMapping::Plain.plane_from_square(square);
                4.0 * (1.0 + plane.length_squared()).powf(-1.5)
            }
            Domain::Sphere { .. } | Domain::Plane { .. } => self.cell_measure(DVec2::ZERO, DVec2::ONE),
        };
        self.emitter.strength * (self.emitter.kind.falloff(direction) * measure)
    }

    /// False only if the light emits nothing into the cell between two corners of the unit square.
    pub fn may_light_cell(&self, face: usize, low: DVec2, high: DVec2) -> bool {
        let Some((axis, half_angle_rad)) = self.emitter.kind.cone() else {
            return true;
        };
        let middle = self.ray(face, (low + high) * 0.5).direction;
        // The cell lies within the cap around its centre that reaches its farthest corner; edges bulge by less than
        // half of that.
        let radius = [low, high, DVec2::new(low.x, high.y), DVec2::new(high.x, low.y)]
            .map(|corner| middle.angle_between(self.ray(face, corner).direction))
            .into_iter()
            .fold(0.0, f64::max);
        axis.angle_between(middle) <= half_angle_rad + 1.5 * radius
    }

    /// Solid angle of a cell [sr], or its area for a sun [m²].
    pub fn cell_measure(&self, low: DVec2, high: DVec2) -> f64 {
        match self.domain {
            Domain::Sphere { mapping, .. } => mapping.cell_solid_angle_sr(low, high),
            Domain::Plane { across, down, .. } => {
                across.cross(down).length() * (high.x - low.x) * (high.y - low.y)
            }
        }
    }

    /// Area that the cell lights after a path of the given length [m], as if the path were straight.
    pub fn cell_area_at_m2(&self, low: DVec2, high: DVec2, path_m: f64) -> f64 {
        let spread = match self.domain {
            Domain::Sphere { .. } => path_m * path_m,
            Domain::Plane { .. } => 1.0,
        };
        self.cell_measure(low, high) * spread
    }

    /// Upper bound on the flux of the whole domain [W, largest channel].
    pub fn power_bound_w(&self) -> f64 {
        let measure = self.cell_measure(DVec2::ZERO, DVec2::ONE) * self.face_count() as f64;
        measure * self.emitter.strength.max_channel()
    }

    /// Frame of a face: maps scene points to homogeneous plane coordinates (x, y, z) whose (x/z, y/z) is the point of
    /// the face or, for a sun, with z = 1, the point of the rectangle as [−1, 1]².
    pub fn to_face(&self, face: usize, point: DVec3) -> DVec3 {
        match self.domain {
            Domain::Sphere { position, .. } => {
                cube_face::axes_from_face(face).transpose() * (point - position)
            }
            Domain::Plane {
                corner, across, down, ..
            } => {
                let local = point - corner;
                let u = local.dot(across) / across.length_squared();
                let v = local.dot(down) / down.length_squared();
                DVec3::new(2.0 * u - 1.0, 2.0 * v - 1.0, 1.0)
            }
        }
    }

    /// Increases towards the light; divided by the third coordinate of [`Self::to_face`] it is linear on planes. 1, or
    /// for a sun the negative distance from the launch plane [m].
    pub fn nearness(&self, point: DVec3) -> f64 {
        match self.domain {
            Domain::Sphere { .. } => 1.0,
            Domain::Plane {
                corner, direction, ..
            } => (corner - point).dot(direction),
        }
    }

    /// 1 if the normal points to the light's side of the plane, −1 otherwise.
    pub fn side_of_light(&self, point: DVec3, normal: DVec3) -> f64 {
        let height = match self.domain {
            Domain::Sphere { position, .. } => (position - point).dot(normal),
            Domain::Plane { direction, .. } => -direction.dot(normal),
        };
        height.signum()
    }

    /// How the unit square maps to a face.
    pub fn mapping(&self) -> FaceMapping {
        match self.domain {
            Domain::Sphere { mapping, .. } => mapping,
            Domain::Plane { .. } => FaceMapping::Plain,
        }
    }
}

/// Orthonormal frame with `direction` as its z axis, which depends on nothing else.
fn frame_across(direction: DVec3) -> DMat3 {
    let (across, down) = direction.any_orthonormal_pair();
    DMat3::from_cols(across, down, direction)
}

fn sun_domain(direction: DVec3, scene: &Scene, casters: &[usize]) -> Option<Domain> {
    // The part of the wavefront that can hit a caster: the casters' extent across the light.
    let scene_from_frame = frame_across(direction);
    let frame_from_scene = scene_from_frame.transpose();
    let mut low = DVec3::INFINITY;
    let mut high = DVec3::NEG_INFINITY;
    for &object in casters {
        for position in scene.objects[object].in_scene().positions() {
            let local = frame_from_scene * position;
            (low, high) = (low.min(local), high.max(local));
        }
    }
    // Nearest point of the scene, occluders included.
    let before = scene
        .objects
        .iter()
        .flat_map(|object| object.in_scene().positions())
        .map(|position| (frame_from_scene * position).z)
        .fold(f64::INFINITY, f64::min);
    let size = high - low;
    // Also false without casters, or if none has an extent across the light.
    if !(size.x > 0.0 && size.y > 0.0 && before.is_finite()) {
        return None;
    }

    // The plane lies well before the whole scene, so that no ray starts behind an occluder.
    let margin = size.max_element().max(high.z - before);
    Some(Domain::Plane {
        corner: scene_from_frame * DVec3::new(low.x, low.y, before - margin),
        across: scene_from_frame.x_axis * size.x,
        down: scene_from_frame.y_axis * size.y,
        direction,
    })
}
