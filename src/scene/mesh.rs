//! Triangle meshes with vertex normals.

use glam::{DAffine3, DMat3, DVec2, DVec3};

use crate::optics::LinearSrgb;

/// A normal of a length that differs from 1 by no more is unit, squared [1].
const UNIT: f64 = 4.0 * f64::EPSILON;

/// Indexed triangles. Counter-clockwise corners face outwards; vertex normals are kept as the file has them, since
/// smooth normals carry the shape between the vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions [m].
    pub positions: Vec<DVec3>,
    /// Vertex normals, one per position: unit in scene coordinates. In those of a file's mesh they have any length, or 0
    /// where the triangles around the vertex give them. Flat-shaded meshes have their corners split.
    pub normals: Vec<DVec3>,
    /// TEXCOORD_0, one per position (v downwards, as glTF has it).
    pub uv0: Option<Vec<DVec2>>,
    /// TEXCOORD_1, one per position.
    pub uv1: Option<Vec<DVec2>>,
    /// COLOR_0 in linear light, one per position, where it varies: multiplies the base colour.
    pub colours: Option<Vec<[f32; 3]>>,
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

    /// What the base colour is multiplied by at a place of a triangle: white without colours.
    pub fn colour(&self, triangle: usize, barycentric: [f64; 3]) -> LinearSrgb {
        let Some(colours) = &self.colours else {
            return LinearSrgb::WHITE;
        };
        let corners = self.triangles[triangle].iter().zip(barycentric);
        let colour = corners.fold(LinearSrgb::BLACK, |sum, (&vertex, weight)| {
            sum + LinearSrgb::from(colours[vertex as usize].map(f64::from)) * weight
        });
        colour.map(|channel| channel.clamp(0.0, 1.0))
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

    /// Area of a triangle [m²].
    pub fn triangle_area_m2(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Total area [m²].
    pub fn area_m2(&self) -> f64 {
        (0..self.triangles.len())
            .map(|triangle| self.triangle_area_m2(triangle))
            .sum()
    }

    /// The same mesh where a transform puts it, with unit normals. A mirroring transform turns the triangles, so that
    /// they stay wound counter-clockwise about the outside.
    #[must_use]
    pub fn placed(&self, world_from_object: &DAffine3) -> Self {
        let linear = world_from_object.matrix3;
        let is_mirrored = linear.determinant() < 0.0;
        let turn = |&[a, b, c]: &[u32; 3]| if is_mirrored { [a, c, b] } else { [a, b, c] };
        let place = |position: &DVec3| world_from_object.transform_point3(*position);
        let mut placed = Self {
            positions: self.positions.iter().map(place).collect(),
            normals: Vec::new(),
            uv0: self.uv0.clone(),
            uv1: self.uv1.clone(),
            colours: self.colours.clone(),
            triangles: self.triangles.iter().map(turn).collect(),
        };
        let cofactors = cofactors(linear);
        let sign = if is_mirrored { -1.0 } else { 1.0 };
        let is_shifted = linear == DMat3::IDENTITY;
        let mut around: Option<Vec<DVec3>> = None;
        let normal = |(vertex, normal): (usize, &DVec3)| {
            let normal = cofactors * *normal * sign;
            if is_shifted && (normal.length_squared() - 1.0).abs() <= UNIT {
                return normal;
            }
            normal
                .try_normalize()
                .unwrap_or_else(|| around.get_or_insert_with(|| placed.normals_around())[vertex])
        };
        placed.normals = self.normals.iter().enumerate().map(normal).collect();
        placed
    }

    /// Normals of the triangles around each vertex, weighted by area; every vertex is part of a triangle with an area.
    fn normals_around(&self) -> Vec<DVec3> {
        // Added to anything, −0 leaves its sign.
        let mut sums = vec![DVec3::splat(-0.0); self.positions.len()];
        let mut any = sums.clone();
        for triangle in 0..self.triangles.len() {
            let [a, b, c] = self.corners(triangle);
            for vertex in self.triangles[triangle] {
                sums[vertex as usize] += (b - a).cross(c - a);
                any[vertex as usize] = self.face_normal(triangle);
            }
        }
        // Triangles back to back cancel: then any one of them is as good.
        sums.iter()
            .zip(any)
            .map(|(sum, any)| sum.try_normalize().unwrap_or(any))
            .collect()
    }
}

/// What turns normals as a linear map turns the surface: its inverse transpose without the division, so that flattened
/// objects have normals too.
pub fn cofactors(linear: DMat3) -> DMat3 {
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y))
}
