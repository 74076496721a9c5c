//! Groups triangles of a map that continue each other smoothly: light is not interpolated across a crease or a cut.

use std::collections::HashMap;

use glam::DVec2;

use crate::illumination::Chart;
use crate::illumination::islands::root;
use crate::scene::Mesh;

/// Neighbouring triangles of one smooth piece meet at less than 30°.
const MIN_COSINE: f64 = 0.866;

/// Both ends of an edge in the map, the lower one first.
type Side = [(u64, u64); 2];

/// The smooth piece of each triangle, counted from 0. Triangles of a piece are connected by edges that they share in
/// the map and that are not creases of the surface.
pub fn smooth_pieces(mesh: &Mesh, chart: &Chart) -> Vec<u32> {
    let count = chart.corner_uvs.len();
    let mut parent: Vec<u32> = (0..count as u32).collect();
    let mut at: HashMap<Side, u32> = HashMap::with_capacity(count * 2);
    for (triangle, corners) in chart.corner_uvs.iter().enumerate() {
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let side = side(corners[from], corners[to]);
            let other = *at.entry(side).or_insert(triangle as u32);
            let cosine = mesh.face_normal(triangle).dot(mesh.face_normal(other as usize));
            if cosine >= MIN_COSINE {
                let (a, b) = (root(&mut parent, triangle as u32), root(&mut parent, other));
                parent[a.max(b) as usize] = a.min(b);
            }
        }
    }
    let mut number = HashMap::new();
    (0..count as u32)
        .map(|triangle| {
            let next = number.len() as u32;
            *number.entry(root(&mut parent, triangle)).or_insert(next)
        })
        .collect()
}

fn side(a: DVec2, b: DVec2) -> Side {
    // Adding zero turns −0 into +0.
    let [a, b] = [a, b].map(|corner| ((corner.x + 0.0).to_bits(), (corner.y + 0.0).to_bits()));
    [a.min(b), a.max(b)]
}
