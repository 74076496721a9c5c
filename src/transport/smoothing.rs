//! Smoothing groups: regions of a mesh over which the shading normal is continuous. Creases, flat facets and separate
//! pieces divide them.

use std::collections::HashMap;

use glam::DVec3;

use crate::geometry::{bits, numbered};
use crate::scene::Mesh;

/// Normals at a shared position that agree to this much per component are equal [1].
const NORMAL_STEP: f64 = 1e-4;

/// Group of every triangle, numbered from 0 in the order of first triangles.
pub fn smoothing_groups(mesh: &Mesh) -> Vec<u32> {
    let mut groups = Groups::new(mesh.positions.len());
    for &[a, b, c] in &mesh.triangles {
        groups.join(a, b);
        groups.join(b, c);
    }
    join_split_vertices(mesh, &mut groups);
    numbered(mesh.triangles.iter().map(|&[a, ..]| groups.root(a)))
}

/// Merges vertices of equal position and normal that other attributes (texture coordinates) split. Split vertices lie
/// on the borders of groups: a single group has none.
fn join_split_vertices(mesh: &Mesh, groups: &mut Groups) {
    let first = groups.root(0);
    if (0..mesh.positions.len() as u32).all(|vertex| groups.root(vertex) == first) {
        return;
    }
    let rounded = |v: DVec3| v.to_array().map(|x| (x / NORMAL_STEP).round() as i64);
    let mut seen = HashMap::new();
    for (vertex, (position, normal)) in mesh.positions.iter().zip(&mesh.normals).enumerate() {
        let twin = *seen
            .entry((bits(*position), rounded(*normal)))
            .or_insert(vertex as u32);
        groups.join(twin, vertex as u32);
    }
}

/// Disjoint sets of vertices (union-find).
struct Groups {
    parents: Vec<u32>,
}

impl Groups {
    fn new(count: usize) -> Self {
        Self {
            parents: (0..count as u32).collect(),
        }
    }

    fn root(&mut self, mut vertex: u32) -> u32 {
        if self.parents.is_empty() {
            return vertex;
        }
        while self.parents[vertex as usize] != vertex {
            let above = self.parents[self.parents[vertex as usize] as usize];
            self.parents[vertex as usize] = above;
            vertex = above;
        }
        vertex
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        // The lower index becomes the root, so that the result depends on the order of the triangles alone.
        self.parents[a.max(b) as usize] = a.min(b);
    }
}
