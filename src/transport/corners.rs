//! Sharp edges of a mesh (borders and creases), and its sharp corners, where they turn. A silhouette follows the edges
//! and kinks at the corners.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::geometry::{bits, numbered};
use crate::scene::InScene;

/// Cosine of the angle of a turn above which a border counts as smooth.
const SMOOTH_TURN: f64 = 0.97;

/// Cosine of the angle between face normals above which they belong to one side.
const SAME_SIDE: f64 = 0.97;

/// Fewest sides around a vertex that make it a corner.
const SIDES_AT_A_CORNER: usize = 3;

/// Larger meshes are taken for smooth shapes [triangles].
const MAX_TRIANGLES: usize = 1 << 14;

/// A mesh with more corners is faceted: the lattice has to resolve them itself.
const MAX_CORNERS: usize = 64;

/// The same limit for edges.
const MAX_EDGES: usize = 1 << 12;

/// A mesh with vertices at equal positions merged.
struct WeldedMesh {
    /// Vertex positions [m].
    points: Vec<DVec3>,
    /// Face normals around each vertex, one per side.
    sides: Vec<Vec<DVec3>>,
    /// Keyed by vertices, the lower index first.
    edges: BTreeMap<(usize, usize), JoinedEdge>,
}

#[derive(Default)]
struct JoinedEdge {
    /// Adjacent triangles.
    count: usize,
    /// Face normal of the first adjacent triangle.
    normal: DVec3,
    /// Whether another adjacent triangle belongs to a different side.
    is_crease: bool,
}

impl WeldedMesh {
    /// `None` above [`MAX_TRIANGLES`].
    fn new(mesh: InScene) -> Option<Self> {
        if mesh.triangle_count() > MAX_TRIANGLES {
            return None;
        }
        let point_of = numbered(mesh.positions().map(bits));
        let mut points: Vec<DVec3> = Vec::new();
        for (position, point) in mesh.positions().zip(&point_of) {
            if *point as usize == points.len() {
                points.push(position);
            }
        }
        let mut sides: Vec<Vec<DVec3>> = vec![Vec::new(); points.len()];
        let mut edges: BTreeMap<(usize, usize), JoinedEdge> = BTreeMap::new();
        for (triangle, vertices) in mesh.triangles().enumerate() {
            let normal = mesh.face_normal(triangle);
            let corners = vertices.map(|vertex| point_of[vertex as usize] as usize);
            for (i, &corner) in corners.iter().enumerate() {
                if sides[corner].iter().all(|side| side.dot(normal) < SAME_SIDE) {
                    sides[corner].push(normal);
                }
                let next = corners[(i + 1) % 3];
                let edge = edges.entry((corner.min(next), corner.max(next))).or_default();
                if edge.count == 0 {
                    edge.normal = normal;
                }
                edge.count += 1;
                edge.is_crease |= edge.normal.dot(normal) < SAME_SIDE;
            }
        }
        Some(Self { points, sides, edges })
    }
}

/// Sharp corners [m]; empty where there are too many or the mesh is too fine.
pub fn sharp_corners(mesh: InScene) -> Vec<DVec3> {
    let Some(WeldedMesh { points, sides, edges }) = WeldedMesh::new(mesh) else {
        return Vec::new();
    };
    let mut border: Vec<Vec<usize>> = vec![Vec::new(); points.len()];
    for (&(a, b), _) in edges.iter().filter(|(_, edge)| edge.count == 1) {
        border[a].push(b);
        border[b].push(a);
    }
    let turns = |corner: usize| match border[corner][..] {
        [before, after] => {
            let along = |to: usize| (points[to] - points[corner]).normalize_or_zero();
            -along(before).dot(along(after)) < SMOOTH_TURN
        }
        ref ends => !ends.is_empty(),
    };
    let corners: Vec<DVec3> = (0..points.len())
        .filter(|&corner| turns(corner) || sides[corner].len() >= SIDES_AT_A_CORNER)
        .map(|corner| points[corner])
        .collect();
    if corners.len() > MAX_CORNERS {
        Vec::new()
    } else {
        corners
    }
}

/// End points [m] of each sharp edge; empty where there are too many or the mesh is too fine.
pub fn sharp_edges(mesh: InScene) -> Vec<[DVec3; 2]> {
    let Some(joined) = WeldedMesh::new(mesh) else {
        return Vec::new();
    };
    let is_sharp = |edge: &JoinedEdge| edge.count == 1 || edge.is_crease;
    let sharp = joined.edges.iter().filter(|(_, edge)| is_sharp(edge));
    let edges: Vec<[DVec3; 2]> = sharp
        .map(|(&(a, b), _)| [joined.points[a], joined.points[b]])
        .filter(|[a, b]| a != b)
        .collect();
    if edges.len() > MAX_EDGES {
        Vec::new()
    } else {
        edges
    }
}
