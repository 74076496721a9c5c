//! The result of one light ray: the segments that leave specular surfaces along its tree of paths, with their
//! derivatives.

use glam::{DVec2, DVec3};

use super::kept_rays::TracedRay;
use crate::geometry::Ray;
use crate::illumination::Receiver;
use crate::light_pass::caustic::path::PathSignature;
use crate::optics::LinearSrgb;
use crate::transport::{MediumStack, RayDifferential};

/// An outgoing ray after a specular event. Flux is per unit area of the launch domain's unit square.
#[derive(Clone, Copy, Debug)]
pub struct PathSegment {
    /// The way up to and with the event; where the ray goes from here is no part of it.
    pub signature: PathSignature,
    /// Starts at the specular surface.
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
    /// Where it goes.
    pub landing: SegmentEnd,
}

/// What an outgoing ray meets next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SegmentEnd {
    /// Nothing.
    Escaped,
    /// A surface that sends all of it on or absorbs it.
    Specular {
        /// Index into `Scene::objects`.
        object: u32,
        /// From the ray's origin [m].
        distance_m: f64,
    },
    /// A surface with an illumination map.
    Receiver {
        /// Which.
        receiver: Receiver,
        /// Index into the object's triangles.
        triangle: u32,
        /// Of the triangle's second and third corner.
        barycentric: DVec2,
        /// From the ray's origin [m].
        distance_m: f64,
    },
}

impl SegmentEnd {
    /// Distance to what is met [m]; infinite where it is nothing.
    pub fn distance_m(&self) -> f64 {
        match *self {
            Self::Escaped => f64::INFINITY,
            Self::Specular { distance_m, .. } | Self::Receiver { distance_m, .. } => distance_m,
        }
    }

    /// The receiver that is met.
    pub fn receiver(&self) -> Option<Receiver> {
        match *self {
            Self::Escaped | Self::Specular { .. } => None,
            Self::Receiver { receiver, .. } => Some(receiver),
        }
    }

    /// The object that is met.
    pub fn object(&self) -> Option<u32> {
        match *self {
            Self::Escaped => None,
            Self::Specular { object, .. } => Some(object),
            Self::Receiver { receiver, .. } => Some(receiver.object() as u32),
        }
    }
}

impl PathSegment {
    /// The point that is met [m].
    pub fn landing_point(&self) -> Option<DVec3> {
        let distance_m = self.landing.distance_m();
        distance_m.is_finite().then(|| self.ray.at(distance_m))
    }
}

/// What a specular surface did with the light of one path [W per unit square, per channel]: what is not in the
/// accounts goes on in strands, or into a map.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceFluxRecord {
    /// The way here, with the surface.
    pub signature: PathSignature,
    /// Whether it is the first surface that the light meets.
    pub first: bool,
    /// Arrived here.
    pub incident: LinearSrgb,
    /// Became heat.
    pub absorbed: LinearSrgb,
    /// Would have gone on beyond the depth limit.
    pub depth: LinearSrgb,
    /// Would have gone on below the branch threshold.
    pub threshold: LinearSrgb,
    /// Would have made too many branches of one ray.
    pub unresolved: LinearSrgb,
    /// Met a number that is not finite.
    pub non_finite: LinearSrgb,
    /// Would have needed an effect that is switched off.
    pub switched_off: LinearSrgb,
    /// Taken by the surface itself as direct light (first hits) or, later, by its map.
    pub taken: LinearSrgb,
}

/// One traced light ray.
#[derive(Clone, Debug, Default)]
pub struct LatticeRay {
    /// Where it was traced, in the unit square of its face.
    pub square: DVec2,
    /// Outgoing rays, in ascending order of their signatures.
    pub strands: Vec<PathSegment>,
    /// Specular surfaces met, in ascending order of their signatures.
    pub nodes: Vec<SurfaceFluxRecord>,
    /// Distance to its first hit [m], where no light goes through what it met.
    pub stopped_m: Option<f64>,
    /// Flux whose first hit is not specular [W per unit square, per channel].
    pub not_emitted: LinearSrgb,
    /// Largest flux of any strand, luminance [W per unit square].
    pub brightest_w: f64,
    /// Cells across and down the unit square that detail of the normals on its way asks for.
    pub bump_cells: DVec2,
    /// Whether detail of the normals is finer than any cell.
    pub is_rough: bool,
    /// Closest-hit queries; 0 where all that it met was known.
    pub segments: u32,
    /// What it met, where not all of that was known.
    pub fresh: Option<Box<TracedRay>>,
}

impl LatticeRay {
    /// Index of the strand of a signature.
    pub fn find(&self, signature: PathSignature) -> Option<usize> {
        // A handful of strands: a plain search is fastest.
        self.strands
            .iter()
            .position(|strand| strand.signature == signature)
    }

    /// Index of the node of a signature.
    pub fn find_node(&self, signature: PathSignature) -> Option<usize> {
        self.nodes.iter().position(|node| node.signature == signature)
    }
}
