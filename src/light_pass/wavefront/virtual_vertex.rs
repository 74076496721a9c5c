//! Interpolated rays between the traced ones, and their hits.

use glam::{DVec2, DVec3};

use super::facets::FacetPlace;
use super::lattice_ray::{PathSegment, SegmentEnd};
use super::patch::PatchShape;
use super::receivers::{ReceiverSurface, Receivers};
use super::spread::Spreader;
use crate::geometry::Ray;
use crate::illumination::{Receiver, Side};
use crate::optics::{ColourMatrix, LinearSrgb};
use crate::scene::SurfaceKind;
use crate::transport::{MediumStack, SurfaceHit};

/// Where a ray lands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LandingPoint {
    /// Outside the scene, or far off the map.
    Nowhere,
    /// On a surface without a map, which only scatters or absorbs.
    Onward,
    /// On a receiver that cannot have a map, or that the patch's light cannot reach.
    Refused,
    /// On a map.
    On {
        receiver: Receiver,
        /// Island of the chart.
        island: u32,
        /// Texel coordinates.
        texel: DVec2,
        /// Facet of the mesh and hit point [m]; `None` on an extended plane, which counts as one facet.
        facet: Option<(u32, DVec3)>,
    },
}

impl LandingPoint {
    /// Whether two rays land on the same receiver or share another fate.
    pub fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::On { receiver, .. }, Self::On { receiver: other, .. }) => receiver == other,
            _ => std::mem::discriminant(self) == std::mem::discriminant(other),
        }
    }

    /// Facet and hit point [m]; `None` off the maps and on extended planes.
    pub fn facet(&self) -> Option<(FacetPlace, DVec3)> {
        match *self {
            Self::On {
                texel,
                facet: Some((triangle, point)),
                ..
            } => Some((FacetPlace { triangle, texel }, point)),
            _ => None,
        }
    }

    /// Texel coordinates; zero off the maps.
    pub fn texel(&self) -> DVec2 {
        match self {
            Self::On { texel, .. } => *texel,
            _ => DVec2::ZERO,
        }
    }

    /// The receiver; `None` off the maps.
    pub fn receiver(&self) -> Option<Receiver> {
        match self {
            Self::On { receiver, .. } => Some(*receiver),
            _ => None,
        }
    }
}

/// End of an interpolated ray.
#[derive(Clone, Copy, Debug)]
pub struct VirtualVertex {
    pub place: LandingPoint,
    /// Not normalised.
    pub ray: Ray,
    /// Fraction of the light that arrives [0, 1].
    pub transmittance: LinearSrgb,
    /// Fraction that the surface takes into its map [0, 1].
    pub deposit: f64,
}

/// Interpolates rays of one patch and intersects them with the scene.
pub struct VirtualRays<'a> {
    receivers: &'a Receivers<'a>,
    shape: &'a PatchShape,
    /// Receiver whose extended plane all rays are intersected with.
    plane: Option<Receiver>,
    /// From RGB factors to the light's channels.
    factors: ColourMatrix,
    media: MediumStack,
    /// Whether light is absorbed on the way.
    absorbs: bool,
    /// Object and smoothing group that the rays leave.
    from: (u32, u32),
    /// Within this distance, hits on the surface that a ray leaves are artefacts of its interpolated origin [m].
    skin_m: f64,
    /// Origins of the traced rays [m].
    origins: Vec<DVec3>,
    /// Receiver that a traced ray lights.
    lit: Option<Receiver>,
    /// Number of rays so far.
    pub queries: u64,
}

impl<'a> VirtualRays<'a> {
    /// For one patch between segments of one signature.
    pub fn new(
        spreader: &Spreader<'a>,
        shape: &'a PatchShape,
        segments: &[&PathSegment],
        plane: Option<Receiver>,
        factors: ColourMatrix,
    ) -> Self {
        let first = segments[0];
        let spread_m = segments
            .iter()
            .map(|segment| segment.ray.origin.distance(first.ray.origin))
            .fold(0.0, f64::max);
        // A traced ray that returns sooner is no artefact.
        let nearest_own_m = segments
            .iter()
            .filter_map(|segment| match segment.landing {
                SegmentEnd::Specular { object, distance_m } if object == first.from => Some(distance_m),
                _ => None,
            })
            .fold(f64::INFINITY, f64::min);
        Self {
            receivers: spreader.receivers,
            shape,
            plane,
            factors,
            media: first.media,
            absorbs: spreader.absorbs(first),
            from: (first.from, first.from_group),
            skin_m: spread_m.min(0.5 * nearest_own_m),
            origins: segments.iter().map(|segment| segment.ray.origin).collect(),
            lit: segments.iter().find_map(|segment| segment.landing.receiver()),
            queries: 0,
        }
    }

    /// Receiver that a traced ray of the patch lights.
    pub fn lit(&self) -> Option<Receiver> {
        self.lit
    }

    /// Whether all rays are extrapolated from one traced ray.
    pub fn are_around_one(&self) -> bool {
        self.origins.len() == 1
    }

    /// The ray at a point of the patch, with its hit.
    pub fn vertex(&mut self, at: DVec2) -> VirtualVertex {
        self.queries += 1;
        let ray = self.shape.ray(at);
        match self.plane {
            Some(receiver) => self.on_plane(receiver, &ray),
            None => self.anywhere(ray),
        }
    }

    fn on_plane(&self, receiver: Receiver, ray: &Ray) -> VirtualVertex {
        let met = self
            .receivers
            .get(receiver)
            .and_then(|surface| surface.plane)
            .and_then(|plane| plane.meet(ray));
        match met {
            Some((texel, distance)) => VirtualVertex {
                place: LandingPoint::On {
                    receiver,
                    island: 0,
                    texel,
                    facet: None,
                },
                ray: *ray,
                transmittance: self.transmittance(distance * ray.direction.length()),
                deposit: 1.0,
            },
            None => nowhere(*ray),
        }
    }

    fn transmittance(&self, distance_m: f64) -> LinearSrgb {
        if self.absorbs {
            let left = self
                .media
                .transmittance(self.receivers.tracer.scene(), distance_m);
            self.factors.apply(left)
        } else {
            LinearSrgb::WHITE
        }
    }

    fn anywhere(&self, ray: Ray) -> VirtualVertex {
        let Some(direction) = ray.direction.try_normalize() else {
            return nowhere(ray);
        };
        let ray = Ray { direction, ..ray };
        let Some((hit, distance_m)) = self.closest_hit(ray) else {
            return nowhere(ray);
        };
        let tracer = self.receivers.tracer;
        let kind = tracer.scene().material_of(hit.object).surface;
        let deposit = match kind {
            SurfaceKind::Diffuse => 1.0,
            SurfaceKind::Coated | SurfaceKind::Varied => {
                tracer.interact(&hit, direction, &self.media).deposit.luminance()
            }
            _ => 0.0,
        };
        let place = if kind.is_receiver() {
            self.place_on(&hit, direction)
        } else {
            LandingPoint::Onward
        };
        VirtualVertex {
            place,
            ray,
            transmittance: self.transmittance(distance_m),
            deposit,
        }
    }

    /// Closest hit, ignoring the surface that the ray leaves, behind which its interpolated origin may lie.
    fn closest_hit(&self, mut ray: Ray) -> Option<(SurfaceHit, f64)> {
        let mut before_m = 0.0;
        for _ in 0..4 {
            let hit = self.receivers.tracer.closest_hit(&ray)?;
            let distance_m = before_m + hit.distance_m;
            let group = self.receivers.tracer.smoothing_group(hit.object, hit.triangle);
            if (hit.object as u32, group) != self.from || distance_m > self.skin_m {
                return Some((hit, distance_m));
            }
            ray = hit.spawn(ray.direction);
            before_m = distance_m;
        }
        let hit = self.receivers.tracer.closest_hit(&ray)?;
        Some((hit, before_m + hit.distance_m))
    }

    fn place_on(&self, hit: &SurfaceHit, direction: DVec3) -> LandingPoint {
        let receiver = Receiver::new(hit.object, Side::met(direction, hit.geometric_normal));
        // Interpolated rays may start behind a plane that all traced ones start in front of.
        let is_astray = |surface: &ReceiverSurface| {
            let mut origins = self.origins.iter();
            surface
                .plane
                .is_some_and(|plane| origins.all(|origin| plane.hides(*origin)))
        };
        match self.receivers.get(receiver) {
            Some(surface) if is_astray(surface) => LandingPoint::Refused,
            Some(surface) => LandingPoint::On {
                receiver,
                island: surface.island(hit.triangle as u32),
                texel: surface.texel(
                    hit.triangle as u32,
                    DVec2::new(hit.barycentric[1], hit.barycentric[2]),
                ),
                facet: Some((hit.triangle as u32, hit.point)),
            },
            None => LandingPoint::Refused,
        }
    }
}

fn nowhere(ray: Ray) -> VirtualVertex {
    VirtualVertex {
        place: LandingPoint::Nowhere,
        ray,
        transmittance: LinearSrgb::WHITE,
        deposit: 0.0,
    }
}
