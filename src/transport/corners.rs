//! Sharp corners of a mesh: where its border, or the creases between its sides, turn. A silhouette bends there at once.

use std::collections::HashMap;

use glam::DVec3;

use crate::scene::Mesh;

/// A border that turns by less is smooth [cosine of the angle].
const SMOOTH_TURN: f64 = 0.97;

/// Sides whose normals differ by less are one [cosine of the angle].
const SAME_SIDE: f64 = 0.97;

/// Sides that meet at a corner of a body, at least.
const SIDES_AT_A_CORNER: usize = 3;

/// Larger meshes stand for smooth shapes [triangles].
const MOST_TRIANGLES: usize = 1 << 14;

/// More corners than these are facets: the lattice has to resolve them by itself.
const MOST_CORNERS: usize = 64;

/// Sharp corners [m]; none where there are very many, or in a very fine mesh.
pub fn sharp_corners(mesh: &Mesh) -> Vec<DVec3> {
    if mesh.triangles.len() > MOST_TRIANGLES {
        return Vec::new();
    }
    let bits = |v: DVec3| (v + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut places: HashMap<[u64; 3], usize> = HashMap::new();
    let mut points: Vec<DVec3> = Vec::new();
    let corner_of: Vec<usize> = mesh
        .positions
        .iter()
        .map(|position| {
            *places.entry(bits(*position)).or_insert_with(|| {
                points.push(*position);
                points.len() - 1
            })
        })
        .collect();
    let mut sides: Vec<Vec<DVec3>> = vec![Vec::new(); points.len()];
    let mut edges: HashMap<(usize, usize), usize> = HashMap::new();
    for (triangle, vertices) in mesh.triangles.iter().enumerate() {
        let normal = mesh.face_normal(triangle);
        let corners = vertices.map(|vertex| corner_of[vertex as usize]);
        for (i, &corner) in corners.iter().enumerate() {
            if sides[corner].iter().all(|side| side.dot(normal) < SAME_SIDE) {
                sides[corner].push(normal);
            }
            let next = corners[(i + 1) % 3];
            *edges.entry((corner.min(next), corner.max(next))).or_default() += 1;
        }
    }
    let mut border: Vec<Vec<usize>> = vec![Vec::new(); points.len()];
    for (&(a, b), _) in edges.iter().filter(|(_, count)| **count == 1) {
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
    if corners.len() > MOST_CORNERS {
        Vec::new()
    } else {
        corners
    }
}
