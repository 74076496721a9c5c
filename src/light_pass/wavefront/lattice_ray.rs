//! The result of one light ray: the segments that leave specular surfaces along its tree of paths, with their
//! derivatives.

use glam::{DVec2, DVec3};

use super::kept_rays::TracedRay;
use crate::geometry::Ray;
use crate::illumination::Receiver;
use crate::light_pass::path::PathSignature;
use crate::optics::LinearSrgb;
use crate::transport::{MediumStack, RayDifferential};

/// An outgoing ray after a specular event. Flux is per unit area of the launch domain's unit square.
#[derive(Clone, Copy, Debug)]
pub struct PathSegment {
    /// The path up to and including the event; where the ray goes from here is not part of it.
    pub signature: PathSignature,
    pub ray: Ray,
    /// Derivatives of the ray by the coordinates of the unit square.
    pub differential: RayDifferential,
    /// Flux that leaves the surface [W per unit square, per channel].
    pub flux_w: LinearSrgb,
    /// Bodies that the ray is inside of.
    pub media: MediumStack,
    /// Object that it leaves.
    pub from: u32,
    /// Smoothing group of the object that it leaves.
    pub from_group: u32,
    pub landing: SegmentEnd,
}

/// What an outgoing ray hits next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SegmentEnd {
    Escaped,
    /// A surface without a map: it only scatters or absorbs.
    Specular {
        /// Index into `Scene::objects`.
        object: u32,
        /// From the ray's origin [m].
        distance_m: f64,
    },
    /// A surface with an illumination map.
    Receiver {
        receiver: Receiver,
        /// Index into the object's triangles.
        triangle: u32,
        /// Second and third barycentric coordinate.
        barycentric: DVec2,
        /// From the ray's origin [m].
        distance_m: f64,
    },
}

impl SegmentEnd {
    /// Distance to the hit [m]; infinite without one.
    pub fn distance_m(&self) -> f64 {
        match *self {
            Self::Escaped => f64::INFINITY,
            Self::Specular { distance_m, .. } | Self::Receiver { distance_m, .. } => distance_m,
        }
    }

    /// The receiver hit.
    pub fn receiver(&self) -> Option<Receiver> {
        match *self {
            Self::Escaped | Self::Specular { .. } => None,
            Self::Receiver { receiver, .. } => Some(receiver),
        }
    }

    /// The object hit.
    pub fn object(&self) -> Option<u32> {
        match *self {
            Self::Escaped => None,
            Self::Specular { object, .. } => Some(object),
            Self::Receiver { receiver, .. } => Some(receiver.object() as u32),
        }
    }
}

impl PathSegment {
    /// The hit point [m]; `None` without a hit.
    pub fn landing_point(&self) -> Option<DVec3> {
        let distance_m = self.landing.distance_m();
        distance_m.is_finite().then(|| self.ray.at(distance_m))
    }
}

/// How a specular surface split the light of one path [W per unit square, per channel]: what no field accounts for
/// continues in outgoing segments or goes into a map.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceFluxRecord {
    /// The path up to and including the surface.
    pub signature: PathSignature,
    /// Whether it is the first surface that the light hits.
    pub first: bool,
    pub incident: LinearSrgb,
    pub absorbed: LinearSrgb,
    /// Beyond the depth limit.
    pub depth: LinearSrgb,
    /// Below the branch threshold.
    pub threshold: LinearSrgb,
    /// Of a ray with too many branches.
    pub unresolved: LinearSrgb,
    /// Of branches with non-finite numbers.
    pub non_finite: LinearSrgb,
    /// Of effects that are switched off.
    pub switched_off: LinearSrgb,
    /// Taken by the surface itself: as direct light at first hits, later by its map.
    pub taken: LinearSrgb,
}

/// One traced light ray.
#[derive(Clone, Debug, Default)]
pub struct LatticeRay {
    /// Start in the unit square of its face.
    pub square: DVec2,
    /// Outgoing rays, ascending by signature.
    pub segments: Vec<PathSegment>,
    /// Specular surfaces hit, ascending by signature.
    pub nodes: Vec<SurfaceFluxRecord>,
    /// Distance to the first hit [m], if that is opaque.
    pub stopped_m: Option<f64>,
    /// Flux whose first hit is not specular [W per unit square, per channel].
    pub not_emitted: LinearSrgb,
    /// Largest luminance of any segment's flux [W per unit square].
    pub brightest_w: f64,
    /// Cells across and down the unit square that the bumps along its path require.
    pub bump_cells: DVec2,
    /// Whether bumps along its path are finer than any cell.
    pub is_rough: bool,
    /// Closest-hit queries; 0 where the cache had every hit.
    pub queries: u32,
    /// Its hits, unless the cache had all of them.
    pub fresh: Option<Box<TracedRay>>,
}

impl LatticeRay {
    /// Index of the segment with a signature.
    pub fn find(&self, signature: PathSignature) -> Option<usize> {
        // With so few segments, linear search is fastest.
        self.segments
            .iter()
            .position(|segment| segment.signature == signature)
    }

    /// Index of the surface record with a signature.
    pub fn find_node(&self, signature: PathSignature) -> Option<usize> {
        self.nodes.iter().position(|node| node.signature == signature)
    }
}
