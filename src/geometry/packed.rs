//! The triangle hierarchy in single precision, for the device.

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

/// Nodes and triangles in the coordinates of a [`Frame`](super::bvh::Frame). The margin of the boxes covers all
/// rounding of single precision.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedBvh {
    /// The root is first; empty without triangles.
    pub nodes: Vec<PackedNode>,
    /// Corners of the triangle in each slot, local.
    pub corners: Vec<[[f32; 3]; 3]>,
    /// Index of the triangle in each slot, in the order given to [`TriangleBvh::build`](super::TriangleBvh::build).
    pub triangles: Vec<u32>,
    /// Largest number of ancestors of a node.
    pub depth: usize,
}

/// Number of ancestors of the deepest node.
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
