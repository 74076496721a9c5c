//! Adjacency of the triangles of a mesh.

use glam::DVec3;
use rayon::slice::ParallelSliceMut;

use super::InScene;
use crate::geometry::numbered;

/// No neighbour across this edge, or no unique one.
const BORDER: u32 = u32::MAX;

/// Neighbours across the edges of each triangle.
#[derive(Clone, Debug)]
pub struct Adjacency {
    /// Per edge, four times the neighbour's index plus the number of its edge.
    across: Vec<[u32; 3]>,
}

/// Directed edge: welded ends in ascending order, whether it runs that way, triangle, first corner.
type HalfEdge = (u32, u32, bool, u32, u8);

impl Adjacency {
    /// Vertices at the same position are welded, since normals and texture coordinates split them. An edge of more than
    /// two triangles, or of two with opposite winding, is a border, because the surface has no unique continuation
    /// there.
    pub fn of<'a>(mesh: impl Into<InScene<'a>>) -> Self {
        let mesh = mesh.into();
        // Single precision, as in files, since computed positions may differ by rounding.
        let single = |position: DVec3| (position + DVec3::ZERO).as_vec3().to_array().map(f32::to_bits);
        let vertices = numbered(mesh.positions().map(single));
        let mut edges: Vec<HalfEdge> = Vec::with_capacity(3 * mesh.triangle_count());
        for (index, triangle) in mesh.triangles().enumerate() {
            let welded = triangle.map(|vertex| vertices[vertex as usize]);
            for corner in 0..3u8 {
                let (a, b) = (welded[usize::from(corner)], welded[usize::from(corner + 1) % 3]);
                edges.push((a.min(b), a.max(b), a < b, index as u32, corner));
            }
        }
        edges.par_sort_unstable();
        let mut across = vec![[BORDER; 3]; mesh.triangle_count()];
        for edge in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            if let [a, b] = edge
                && a.2 != b.2
            {
                across[a.3 as usize][usize::from(a.4)] = b.3 << 2 | u32::from(b.4);
                across[b.3 as usize][usize::from(b.4)] = a.3 << 2 | u32::from(a.4);
            }
        }
        Self { across }
    }

    /// The triangle across the edge that runs from corner `edge` to the next, and its corner where the same edge starts
    /// in its own winding; `None` at a border.
    pub fn beyond(&self, triangle: usize, edge: usize) -> Option<(usize, usize)> {
        let next = self.across[triangle][edge];
        (next != BORDER).then_some(((next >> 2) as usize, (next & 3) as usize))
    }

    /// All neighbours of a triangle.
    pub fn around(&self, triangle: usize) -> impl Iterator<Item = usize> {
        (0..3).filter_map(move |edge| Some(self.beyond(triangle, edge)?.0))
    }
}
