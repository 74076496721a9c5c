//! Sharp edges of a mesh: borders and creases. Silhouettes follow them.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::geometry::{bits, numbered};
use crate::scene::InScene;

/// Cosine of the angle between face normals above which an edge is no crease.
const SAME_SIDE: f64 = 0.97;

/// Larger meshes are taken for smooth shapes [triangles].
const MAX_TRIANGLES: usize = 1 << 14;

/// A mesh with more edges is faceted: squares have to resolve them themselves.
const MAX_EDGES: usize = 1 << 12;

/// An edge of a mesh whose vertices at equal positions are merged.
#[derive(Default)]
struct JoinedEdge {
    /// Adjacent triangles.
    count: usize,
    /// Face normal of the first adjacent triangle.
    normal: DVec3,
    /// Whether another adjacent triangle belongs to a different side.
    is_crease: bool,
}

/// End points [m] of each sharp edge; empty where there are too many or the mesh is too fine.
pub fn sharp_edges(mesh: InScene) -> Vec<[DVec3; 2]> {
    if mesh.triangle_count() > MAX_TRIANGLES {
        return Vec::new();
    }

    // Vertices are welded by position, since normals and texture coordinates split them.
    let point_of = numbered(mesh.positions().map(bits));
    let mut points: Vec<DVec3> = Vec::new();
    for (position, point) in mesh.positions().zip(&point_of) {
        if *point as usize == points.len() {
            points.push(position);
        }
    }

    // Keyed by vertices, the lower index first.
    let mut edges: BTreeMap<(usize, usize), JoinedEdge> = BTreeMap::new();
    for (triangle, vertices) in mesh.triangles().enumerate() {
        let normal = mesh.face_normal(triangle);
        let corners = vertices.map(|vertex| point_of[vertex as usize] as usize);
        for (i, &corner) in corners.iter().enumerate() {
            let next = corners[(i + 1) % 3];
            let edge = edges.entry((corner.min(next), corner.max(next))).or_default();
            if edge.count == 0 {
                edge.normal = normal;
            }
            edge.count += 1;
            edge.is_crease |= edge.normal.dot(normal) < SAME_SIDE;
        }
    }

    // An edge of a single triangle is a border; one between triangles that face different ways is a crease.
    let is_sharp = |edge: &JoinedEdge| edge.count == 1 || edge.is_crease;
    let sharp = edges.iter().filter(|(_, edge)| is_sharp(edge));
    let ends: Vec<[DVec3; 2]> = sharp
        .map(|(&(a, b), _)| [points[a], points[b]])
        .filter(|[a, b]| a != b)
        .collect();
    if ends.len() > MAX_EDGES { Vec::new() } else { ends }
}
