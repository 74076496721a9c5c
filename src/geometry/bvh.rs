//! The triangle hierarchy for rays, built by obvhs in single precision, and the same packed for devices.

use super::Ray;
use super::wide::{WideBvh, WideRay};
use glam::{DVec3, Vec3A};
use obvhs::{
    BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, builder::build_bvh2},
};

/// Boxes are widened by this fraction of the scene's size, so that the rounding of the single-precision box test cannot
/// lose a hit: origin, direction and slab distances err by at most some 2⁻²⁰ of the size.
pub const BOX_MARGIN: f32 = 1.0 / (1 << 19) as f32;

/// Four triangles are tested at once, and a node's boxes take as long as that: with up to eight triangles in a leaf,
/// and nodes as dear as five, rays through 674 to 61,000 triangles of glass were found to take 4 to 9 % less time than
/// with four and three.
const BUILD: BvhBuildParams = BvhBuildParams {
    max_prims_per_leaf: 8,
    collapse_traversal_cost: 5.0,
    ..BvhBuildParams::medium_build()
};

/// Slot of no triangle.
pub const NO_SLOT: u32 = u32::MAX;

/// Rays that start farther than this many radii from the centre of a scene or an instance are advanced before the box
/// tests, or before they are transformed into object space: these would lose precision at that distance.
pub const FAR_RADII: f64 = 4.0;

/// A bounding volume hierarchy over triangles or boxes.
///
/// Single-precision coordinates are relative to the triangles' centre and scaled by a power of two to a radius of about
/// one, so that scenes that are far away, tiny or huge keep their precision.
pub struct TriangleBvh {
    bvh: Bvh2,
    /// Corners by slot, in the order of the leaves.
    corners: Vec<[DVec3; 3]>,
    /// For ray traversal.
    wide: WideBvh,
    frame: Frame,
}

/// Single-precision coordinates for the inside of a sphere: (point − `centre`) · `scale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// [m].
    pub centre: DVec3,
    /// Single-precision units per metre, a power of two: the sphere's radius is between 1/2 and 1.
    pub scale: f64,
    radius_m: f64,
}

impl std::fmt::Debug for TriangleBvh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TriangleBvh")
            .field("triangles", &self.corners.len())
            .finish_non_exhaustive()
    }
}

impl TriangleBvh {
    /// Corners must be finite; degenerate triangles are allowed and never hit.
    pub fn build(triangles: &[[DVec3; 3]]) -> Self {
        let frame = Frame::around(triangles.iter().flatten());
        Self::over(triangles, frame, BUILD, |corner| frame.local(corner))
    }

    /// Over boxes given by their minimum and maximum corner [m], in an enclosing frame.
    pub fn over_boxes(boxes: &[(DVec3, DVec3)], frame: Frame) -> Self {
        let build = BvhBuildParams {
            max_prims_per_leaf: 1,
            ..BUILD
        };
        let corners: Vec<[DVec3; 3]> = boxes.iter().map(|&(low, high)| [low, high, high]).collect();
        // A triangle shrunk to a point is never clearly missed: its box decides.
        Self::over(&corners, frame, build, |_| DVec3::ZERO)
    }

    fn over(
        triangles: &[[DVec3; 3]],
        frame: Frame,
        build: BvhBuildParams,
        tested: impl Fn(DVec3) -> DVec3,
    ) -> Self {
        let aabbs: Vec<Aabb> = triangles.iter().map(|corners| frame.aabb(corners)).collect();
        let mut build_time = std::time::Duration::ZERO;
        let bvh = build_bvh2(&aabbs, build, &mut build_time);
        let corners: Vec<[DVec3; 3]> = bvh
            .primitive_indices
            .iter()
            .map(|&triangle| triangles[triangle as usize])
            .collect();
        let singles: Vec<[DVec3; 3]> = corners.iter().map(|corners| corners.map(&tested)).collect();
        Self {
            wide: WideBvh::new(&bvh, &singles),
            bvh,
            corners,
            frame,
        }
    }

    /// Calls `meet` with the slots of all triangles or boxes that a ray may hit before `end_m`, roughly front to back.
    /// `meet` returns the distance [m] at which to end the search, infinite for no change; `None` ends it at once.
    #[inline(always)]
    pub fn search(&self, ray: &Ray, end_m: f64, meet: impl FnMut(u32) -> Option<f64>) {
        self.search_from(ray, NO_SLOT, end_m, meet);
    }

    /// The same for a ray that leaves the triangle in a slot: it does not meet that one again.
    #[inline(always)]
    pub fn search_from(&self, ray: &Ray, left: u32, end_m: f64, mut meet: impl FnMut(u32) -> Option<f64>) {
        let (local, advanced_m) = self.frame.local_ray(ray, left, end_m);
        self.wide.search(local, |slot| match meet(slot as u32) {
            Some(end_m) if end_m.is_finite() => self.frame.local_distance(end_m, advanced_m),
            Some(_) => f32::INFINITY,
            None => -1.0,
        });
    }

    /// `None` without triangles.
    pub fn root(&self) -> Option<Node<'_>> {
        (!self.corners.is_empty()).then_some(Node {
            hierarchy: self,
            index: 0,
        })
    }

    /// The hierarchy for devices, in its own frame or in a larger one around it.
    pub fn packed(&self, frame: &Frame) -> PackedBvh {
        // Boxes that move to another frame are rounded once more, and so widened once more.
        let local = |place: DVec3| to_single(frame.local(place));
        let placed = |corner: Vec3A, margin: f32| {
            let is_same = *frame == self.frame;
            let placed = if is_same {
                corner
            } else {
                local(self.frame.place(corner)) + margin
            };
            placed.to_array()
        };

        // Without triangles there is no node to visit, whatever the builder returns.
        let count = if self.corners.is_empty() {
            0
        } else {
            self.bvh.nodes.len()
        };
        let nodes = self.bvh.nodes[..count].iter().map(|node| PackedNode {
            low: placed(node.aabb().min, -BOX_MARGIN),
            first: node.first_index,
            high: placed(node.aabb().max, BOX_MARGIN),
            count: node.prim_count,
        });
        let nodes: Vec<PackedNode> = nodes.collect();
        let corners = self.corners.iter();
        PackedBvh {
            corners: corners
                .map(|corners| corners.map(|corner| local(corner).to_array()))
                .collect(),
            triangles: self.bvh.primitive_indices.clone(),
            depth: depth(&nodes),
            nodes,
        }
    }

    /// Frame of the single-precision coordinates.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Index of the triangle or box in a slot, in the order given to the constructor.
    pub fn triangle(&self, slot: u32) -> u32 {
        self.bvh.primitive_indices[slot as usize]
    }

    /// Corners of the triangle in a slot [m].
    pub fn corners(&self, slot: u32) -> &[DVec3; 3] {
        &self.corners[slot as usize]
    }
}

impl Frame {
    /// Around points; of unit radius without any.
    pub fn around<'a>(points: impl Iterator<Item = &'a DVec3>) -> Self {
        let mut points = points.peekable();
        let is_empty = points.peek().is_none();
        let (low, high) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), point| {
            (low.min(*point), high.max(*point))
        });
        let (centre, radius_m) = if is_empty {
            (DVec3::ZERO, 1.0)
        } else {
            let centre = low * 0.5 + high * 0.5;
            (centre, (high - centre).length().max(f64::MIN_POSITIVE))
        };
        Self {
            centre,
            scale: (-radius_m.log2().ceil()).exp2(),
            radius_m,
        }
    }

    /// A point [m] in local coordinates.
    pub fn local(&self, point: DVec3) -> DVec3 {
        (point - self.centre) * self.scale
    }

    /// Inverse of [`Self::local`] [m].
    fn place(&self, local: Vec3A) -> DVec3 {
        // Exact except for the sum: the scale is a power of two.
        self.centre + local.as_dvec3() * (1.0 / self.scale)
    }

    fn aabb(&self, points: &[DVec3; 3]) -> Aabb {
        let aabb = Aabb::from_points(&points.map(|point| to_single(self.local(point))));
        Aabb::new(aabb.min - BOX_MARGIN, aabb.max + BOX_MARGIN)
    }

    /// The ray in single precision, and the distance [m] by which its origin was advanced.
    fn local_ray(&self, ray: &Ray, left: u32, limit_m: f64) -> (WideRay, f64) {
        let towards_centre = (self.centre - ray.origin).dot(ray.direction);
        let advanced_m = (towards_centre - FAR_RADII * self.radius_m).max(0.0);
        // A branch: the origin of most rays need not wait for the distance.
        let origin = if advanced_m > 0.0 {
            ray.at(advanced_m)
        } else {
            ray.origin
        };
        let origin = to_single(self.local(origin));
        // A negative zero would swap the slab planes.
        let direction = to_single(ray.direction) + Vec3A::ZERO;
        let limit = if limit_m.is_finite() {
            self.local_distance(limit_m, advanced_m)
        } else {
            f32::INFINITY
        };
        let local = WideRay {
            origin: origin.clamp(-Vec3A::MAX, Vec3A::MAX),
            direction,
            end: limit,
            left,
        };
        (local, advanced_m)
    }

    /// A distance [m] along the ray in single-precision units, rounded up so that the bound stays conservative.
    fn local_distance(&self, distance_m: f64, advanced_m: f64) -> f32 {
        (((distance_m - advanced_m) * self.scale).max(0.0) as f32).next_up() + BOX_MARGIN
    }
}

/// A node of the hierarchy, for traversals other than along rays.
#[derive(Clone, Copy, Debug)]
pub struct Node<'a> {
    hierarchy: &'a TriangleBvh,
    index: usize,
}

impl<'a> Node<'a> {
    /// Conservative bounding box of the node's triangles: minimum and maximum corner [m].
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let aabb = self.hierarchy.bvh.nodes[self.index].aabb();
        let frame = &self.hierarchy.frame;
        (frame.place(aabb.min), frame.place(aabb.max))
    }

    /// Child nodes; `None` for a leaf.
    pub fn children(&self) -> Option<[Node<'a>; 2]> {
        let node = &self.hierarchy.bvh.nodes[self.index];
        let child = |index: u32| Node {
            hierarchy: self.hierarchy,
            index: index as usize,
        };
        (!node.is_leaf()).then(|| [child(node.first_index), child(node.first_index + 1)])
    }

    /// Slots of a leaf's triangles; empty for inner nodes.
    pub fn slots(&self) -> std::ops::Range<u32> {
        let node = &self.hierarchy.bvh.nodes[self.index];
        node.first_index..node.first_index + node.prim_count
    }
}

pub(super) fn to_single(v: DVec3) -> Vec3A {
    Vec3A::new(v.x as f32, v.y as f32, v.z as f32)
}

/// A node: its box and its contents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PackedNode {
    /// Minimum corner, local.
    pub low: [f32; 3],
    /// First slot of a leaf, or first of the two adjacent children of an inner node.
    pub first: u32,
    /// Maximum corner, local.
    pub high: [f32; 3],
    /// Triangles of a leaf; 0 for inner nodes.
    pub count: u32,
}

/// Nodes and triangles in the coordinates of a [`Frame`]. The margin of the boxes covers all
/// rounding of single precision.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedBvh {
    /// The root is first; empty without triangles.
    pub nodes: Vec<PackedNode>,
    /// Corners of the triangle in each slot, local.
    pub corners: Vec<[[f32; 3]; 3]>,
    /// Index of the triangle in each slot, in the order given to [`TriangleBvh::build`].
    pub triangles: Vec<u32>,
    /// Largest number of ancestors of a node.
    pub depth: usize,
}

/// Number of ancestors of the deepest node.
fn depth(nodes: &[PackedNode]) -> usize {
    let mut deepest = 0;
    let mut waiting: Vec<(usize, usize)> = nodes.first().map(|_| (0, 0)).into_iter().collect();
    while let Some((index, above)) = waiting.pop() {
        deepest = deepest.max(above);
        let node = &nodes[index];
        if node.count == 0 {
            let first = node.first as usize;
            waiting.extend([(first, above + 1), (first + 1, above + 1)]);
        }
    }
    deepest
}
