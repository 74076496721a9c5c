//! Rays, triangles and hierarchies. Knows nothing of materials or light.

pub mod bvh;
pub mod cube_face;
mod disjoint_sets;
pub mod enclosure;
pub mod frustum;
pub mod polygon;
pub mod ray;
pub mod sampling;
pub mod triangle;
mod wide;

pub use bvh::{PackedBvh, PackedNode, TriangleBvh};
pub use disjoint_sets::DisjointSets;
pub use frustum::Frustum;
pub use ray::Ray;

use std::collections::HashMap;
use std::hash::Hash;

/// Numbers values in the order of their first occurrence; equal ones share a number.
pub fn numbered<K: Eq + Hash>(values: impl IntoIterator<Item = K>) -> Vec<u32> {
    let mut known = HashMap::new();
    let number = |value: K| {
        let next = known.len() as u32;
        *known.entry(value).or_insert(next)
    };
    values.into_iter().map(number).collect()
}

/// A point as a key: equal points have equal bits.
pub fn bits(point: glam::DVec3) -> [u64; 3] {
    // Adding zero turns −0 into +0.
    (point + glam::DVec3::ZERO).to_array().map(f64::to_bits)
}
