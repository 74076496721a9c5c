//! Triangle meshes with vertex normals.

use glam::{DVec2, DVec3};

/// Indexed triangles in scene coordinates. Counter-clockwise corners face outwards; vertex normals are unit and kept
/// as the file has them, since smooth normals carry the shape between the vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions [m].
    pub positions: Vec<DVec3>,
    /// Unit vertex normals, one per position. Flat-shaded meshes have their corners split.
    pub normals: Vec<DVec3>,
    /// TEXCOORD_0, one per position (v downwards, as glTF has it).
    pub uv0: Option<Vec<DVec2>>,
    /// TEXCOORD_1, one per position.
    pub uv1: Option<Vec<DVec2>>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Corner positions of a triangle [m].
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        let [a, b, c] = self.triangles[triangle];
        [
            self.positions[a as usize],
            self.positions[b as usize],
            self.positions[c as usize],
        ]
    }

    /// Vertex normals of a triangle.
    pub fn corner_normals(&self, triangle: usize) -> [DVec3; 3] {
        let [a, b, c] = self.triangles[triangle];
        [
            self.normals[a as usize],
            self.normals[b as usize],
            self.normals[c as usize],
        ]
    }

    /// Unit normal of a triangle by its winding; zero for a degenerate one.
    pub fn face_normal(&self, triangle: usize) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Smallest box, as minimum and maximum corner [m]; `None` without vertices.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let first = *self.positions.first()?;
        Some(
            self.positions
                .iter()
                .fold((first, first), |(low, high), p| (low.min(*p), high.max(*p))),
        )
    }

    /// Total area [m²].
    pub fn area_m2(&self) -> f64 {
        (0..self.triangles.len())
            .map(|triangle| {
                let [a, b, c] = self.corners(triangle);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum()
    }
}
