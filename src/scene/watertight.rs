//! Whether a mesh is closed and bounds a solid.

use std::collections::HashMap;

use glam::DVec3;

use crate::scene::{InScene, Mesh};

/// Smallest volume of a solid relative to a cube of the same surface area; anything flatter is a two-sided sheet.
const MIN_FILLED: f64 = 1e-6;

/// Whether a closed mesh encloses a volume in the scene, with its triangles wound to face outwards.
pub fn has_volume(mesh: InScene) -> bool {
    let middle = mesh.positions().next().unwrap_or_default();
    let volume_m3: f64 = (0..mesh.triangle_count())
        .map(|triangle| {
            let [a, b, c] = mesh.corners(triangle).map(|corner| corner - middle);
            a.dot(b.cross(c)) / 6.0
        })
        .sum();
    volume_m3 > MIN_FILLED * (mesh.area_m2() / 6.0).powf(1.5)
}

/// Whether every edge is traversed as often in one direction as in the other. Vertices at bitwise equal positions are
/// welded, since normals and texture coordinates split them.
pub fn is_closed(mesh: &Mesh) -> bool {
    let mut welded = HashMap::with_capacity(mesh.positions.len());
    let vertices: Vec<usize> = mesh
        .positions
        .iter()
        .map(|position| {
            let next = welded.len();
            // Adding zero turns −0 into +0.
            let bits = (*position + DVec3::ZERO).to_array().map(f64::to_bits);
            *welded.entry(bits).or_insert(next)
        })
        .collect();
    let mut balance: HashMap<(usize, usize), i64> = HashMap::with_capacity(mesh.triangles.len() * 3 / 2);
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| vertices[vertex as usize]);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let direction = if from < to { 1 } else { -1 };
            *balance.entry((from.min(to), from.max(to))).or_default() += direction;
        }
    }
    balance.values().all(|balance| *balance == 0)
}
