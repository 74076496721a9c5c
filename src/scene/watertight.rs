//! Whether a mesh is closed and bounds a solid.

use crate::geometry::enclosure::edge_traversals;
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
    edge_traversals(&mesh.positions, &mesh.triangles).all(|(forwards, backwards)| forwards == backwards)
}
