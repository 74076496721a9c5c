//! The triangle hierarchy in single precision, for the device.

use glam::DVec3;

use super::TriangleBvh;

/// A node: its box and what is in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PackedNode {
    /// Minimum corner, local.
    pub low: [f32; 3],
    /// Of a leaf its first slot, of others the first of two neighbouring children.
    pub first: u32,
    /// Maximum corner, local.
    pub high: [f32; 3],
    /// Triangles of a leaf; 0 for other nodes.
    pub count: u32,
}

/// Nodes and triangles in local coordinates: relative to a centre and scaled to a radius of at most one, where the
/// boxes' margin covers all rounding of single precision.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedBvh {
    /// The root comes first; none without triangles.
    pub nodes: Vec<PackedNode>,
    /// Corners of the triangle in each slot, local.
    pub corners: Vec<[[f32; 3]; 3]>,
    /// Which triangle lies in each slot: its place in the order that they were given to [`TriangleBvh::build`].
    pub triangles: Vec<u32>,
    /// Local coordinates are (place − `centre`) · `scale` [m].
    pub centre: DVec3,
    /// Local units per metre, a power of two.
    pub scale: f64,
    /// Largest number of nodes above a node.
    pub depth: usize,
}

impl PackedBvh {
    /// The hierarchy over triangles with these corners [m], which must be finite.
    pub fn build(triangles: &[[DVec3; 3]]) -> Self {
        TriangleBvh::build(triangles).packed()
    }
}

/// Nodes above the deepest node.
pub(super) fn depth(nodes: &[PackedNode]) -> usize {
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
