//! Smoothing groups: regions of a mesh over which the shading normal is continuous. Creases, flat facets and separate
//! pieces divide them.

use std::collections::HashMap;

use glam::DVec3;

use crate::geometry::{DisjointSets, bits, numbered};
use crate::scene::Mesh;

/// Normals at a shared position that agree to this much per component are equal [1].
const NORMAL_STEP: f64 = 1e-4;

/// Group of every triangle, numbered from 0 in the order of first triangles.
pub fn smoothing_groups(mesh: &Mesh) -> Vec<u32> {
    let mut groups = DisjointSets::new(mesh.positions.len());
    for &[a, b, c] in &mesh.triangles {
        groups.join(a as usize, b as usize);
        groups.join(b as usize, c as usize);
    }
    join_split_vertices(mesh, &mut groups);
    numbered(mesh.triangles.iter().map(|&[a, ..]| groups.root(a)))
}

/// Merges vertices of equal position and normal that other attributes (texture coordinates) split. Split vertices lie
/// on the borders of groups: a single group has none.
fn join_split_vertices(mesh: &Mesh, groups: &mut DisjointSets) {
    if (1..mesh.positions.len() as u32).all(|vertex| groups.root(vertex) == groups.root(0)) {
        return;
    }
    let rounded = |v: DVec3| v.to_array().map(|x| (x / NORMAL_STEP).round() as i64);
    let mut seen = HashMap::new();
    for (vertex, (position, normal)) in mesh.positions.iter().zip(&mesh.normals).enumerate() {
        let twin = *seen.entry((bits(*position), rounded(*normal))).or_insert(vertex);
        groups.join(twin, vertex);
    }
}
