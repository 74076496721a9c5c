//! Whether a mesh is closed and bounds a solid.

use crate::geometry::enclosure::edge_traversals;
use crate::scene::{InScene, Mesh};

/// Smallest volume of a solid relative to a cube of the same surface area; anything flatter is a two-sided sheet.
const MIN_FILLED: f64 = 1e-6;

/// Volume that a closed mesh encloses in the scene; negative if its triangles face inwards. For a piece of a closed
/// surface, its part of the sum [m³].
pub fn volume_m3(mesh: InScene) -> f64 {
    let volumes = (0..mesh.triangle_count()).map(|triangle| {
        let [a, b, c] = mesh.corners(triangle);
        a.dot(b.cross(c)) / 6.0
    });
    volumes.sum()
}

/// Whether a closed mesh of a volume is more than a two-sided sheet.
pub fn has_extent(mesh: InScene, volume_m3: f64) -> bool {
    volume_m3.abs() > MIN_FILLED * (mesh.area_m2() / 6.0).powf(1.5)
}

/// Whether every edge is traversed as often in one direction as in the other. Vertices at bitwise equal positions are
/// welded, since normals and texture coordinates split them.
pub fn is_closed(mesh: &Mesh) -> bool {
    edge_traversals(&mesh.positions, &mesh.triangles).all(|(forwards, backwards)| forwards == backwards)
}
