//! Groups triangles of a map that continue each other smoothly: light is not interpolated across a crease or a cut.

use std::collections::HashMap;

use glam::DVec2;

use crate::geometry::DisjointSets;
use crate::illumination::Chart;
use crate::scene::Mesh;

/// Neighbouring triangles of one smooth piece meet at less than 30°.
const MIN_COSINE: f64 = 0.866;

/// Both ends of an edge in the map, the lower one first.
type Side = [(u64, u64); 2];

/// The smooth piece of each triangle, counted from 0. Triangles of a piece are connected by edges that they share in
/// the map and that are not creases of the surface.
pub fn smooth_pieces(mesh: &Mesh, chart: &Chart) -> Vec<u32> {
    let mut pieces = DisjointSets::new(chart.corner_uvs.len());
    let mut at: HashMap<Side, usize> = HashMap::with_capacity(chart.corner_uvs.len() * 2);
    for (triangle, corners) in chart.corner_uvs.iter().enumerate() {
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let other = *at.entry(side(corners[from], corners[to])).or_insert(triangle);
            let cosine = mesh.face_normal(triangle).dot(mesh.face_normal(other));
            if cosine >= MIN_COSINE {
                pieces.join(triangle, other);
            }
        }
    }
    pieces.sets()
}

fn side(a: DVec2, b: DVec2) -> Side {
    // Adding zero turns −0 into +0.
    let [a, b] = [a, b].map(|corner| ((corner.x + 0.0).to_bits(), (corner.y + 0.0).to_bits()));
    [a.min(b), a.max(b)]
}
