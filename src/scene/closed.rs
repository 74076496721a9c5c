//! Whether a mesh bounds a solid.

use std::collections::HashMap;

use glam::DVec3;

use crate::scene::Mesh;

/// Whether every edge is passed as often in one direction as in the other; vertices are one where their positions are
/// equal bit by bit, since normals and texture coordinates split them.
pub fn is_closed(mesh: &Mesh) -> bool {
    let mut welded = HashMap::with_capacity(mesh.positions.len());
    let vertices: Vec<usize> = mesh
        .positions
        .iter()
        .map(|position| {
            let next = welded.len();
            // Adding zero makes minus zero plus zero.
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
