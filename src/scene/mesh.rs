//! Triangle meshes with vertex normals.

use glam::{DAffine3, DMat3, DVec2, DVec3};

use crate::optics::LinearSrgb;

/// Largest deviation of a unit normal's squared length from 1.
const UNIT: f64 = 4.0 * f64::EPSILON;

/// Indexed triangles, counter-clockwise as seen from outside. Vertex normals are kept as the file has them, since
/// smooth normals carry the shape between the vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions [m].
    pub positions: Vec<DVec3>,
    /// Vertex normals, one per position: unit length in scene coordinates. In a file's mesh they have any length, or 0
    /// where they are to be computed from the adjacent triangles. Flat-shaded meshes have split vertices.
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

    /// Interpolated vertex colour, which multiplies the base colour; white without colours.
    pub fn colour(&self, triangle: usize, barycentric: [f64; 3]) -> LinearSrgb {
        InScene::from(self).colour(triangle, barycentric)
    }

    /// Unit normal of a triangle from its winding; zero for a degenerate triangle.
    pub fn face_normal(&self, triangle: usize) -> DVec3 {
        InScene::from(self).face_normal(triangle)
    }

    /// Bounding box, as minimum and maximum corner [m]; `None` without vertices.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        InScene::from(self).bounds()
    }

    /// Area of a triangle [m²].
    pub fn triangle_area_m2(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Total area [m²].
    pub fn area_m2(&self) -> f64 {
        InScene::from(self).area_m2()
    }

    /// The mesh transformed, with unit normals. A mirroring transform also swaps corners, so that triangles stay
    /// counter-clockwise as seen from outside.
    #[must_use]
    pub fn placed(&self, world_from_object: &DAffine3) -> Self {
        Placement::new(*world_from_object).of_mesh(self)
    }

    /// Area-weighted normals of the vertices; every vertex belongs to a triangle of non-zero area.
    fn normals_around(&self) -> Vec<DVec3> {
        // −0 is the neutral element of addition: it preserves the sign of zero.
        let mut sums = vec![DVec3::splat(-0.0); self.positions.len()];
        let mut any = sums.clone();
        for triangle in 0..self.triangles.len() {
            let [a, b, c] = self.corners(triangle);
            for vertex in self.triangles[triangle] {
                sums[vertex as usize] += (b - a).cross(c - a);
                any[vertex as usize] = self.face_normal(triangle);
            }
        }
        // Back-to-back triangles cancel; then the normal of any of them will do.
        sums.iter()
            .zip(any)
            .map(|(sum, any)| sum.try_normalize().unwrap_or(any))
            .collect()
    }
}

/// A transform prepared for meshes. Everything about a placed mesh is computed here, so that a full copy and single
/// triangles agree to the last bit.
#[derive(Clone, Debug)]
pub struct Placement {
    world_from_object: DAffine3,
    cofactors: DMat3,
    is_mirrored: bool,
    is_shifted: bool,
}

impl Placement {
    /// Prepares a transform.
    pub fn new(world_from_object: DAffine3) -> Self {
        let linear = world_from_object.matrix3;
        Self {
            cofactors: cofactors(linear),
            is_mirrored: linear.determinant() < 0.0,
            is_shifted: linear == DMat3::IDENTITY,
            world_from_object,
        }
    }

    /// Transform from mesh to scene coordinates.
    pub fn world_from_object(&self) -> &DAffine3 {
        &self.world_from_object
    }

    /// Corners of a mesh triangle in scene coordinates, in the order of the placed mesh [m].
    // Not inlined, to keep it out of loops over meshes without a placement.
    #[inline(never)]
    pub fn corners(&self, corners: &[DVec3; 3]) -> [DVec3; 3] {
        self.wound(corners.map(|corner| self.position(corner)))
    }

    fn position(&self, position: DVec3) -> DVec3 {
        self.world_from_object.transform_point3(position)
    }

    fn wound<T>(&self, [a, b, c]: [T; 3]) -> [T; 3] {
        if self.is_mirrored { [a, c, b] } else { [a, b, c] }
    }

    /// `None` if the normal must be computed from the adjacent triangles.
    fn normal(&self, normal: DVec3) -> Option<DVec3> {
        let normal = self.cofactors * normal * if self.is_mirrored { -1.0 } else { 1.0 };
        if self.is_shifted && (normal.length_squared() - 1.0).abs() <= UNIT {
            return Some(normal);
        }
        normal.try_normalize()
    }

    /// Copy of a mesh in scene coordinates.
    pub(super) fn of_mesh(&self, mesh: &Mesh) -> Mesh {
        let mut placed = Mesh {
            positions: mesh
                .positions
                .iter()
                .map(|&position| self.position(position))
                .collect(),
            normals: Vec::new(),
            uv0: mesh.uv0.clone(),
            uv1: mesh.uv1.clone(),
            colours: mesh.colours.clone(),
            triangles: mesh
                .triangles
                .iter()
                .map(|&triangle| self.wound(triangle))
                .collect(),
        };
        let mut around: Option<Vec<DVec3>> = None;
        let normal = |(vertex, normal): (usize, &DVec3)| {
            self.normal(*normal)
                .unwrap_or_else(|| around.get_or_insert_with(|| placed.normals_around())[vertex])
        };
        placed.normals = mesh.normals.iter().enumerate().map(normal).collect();
        placed
    }
}

/// A mesh in scene coordinates: stored in them, or transformed on access.
#[derive(Clone, Copy, Debug)]
pub struct InScene<'a> {
    mesh: &'a Mesh,
    /// `None` if the mesh is stored in scene coordinates.
    placement: Option<&'a Placement>,
}

impl<'a> From<&'a Mesh> for InScene<'a> {
    fn from(mesh: &'a Mesh) -> Self {
        Self::new(mesh, None)
    }
}

impl<'a> InScene<'a> {
    pub(super) fn new(mesh: &'a Mesh, placement: Option<&'a Placement>) -> Self {
        Self { mesh, placement }
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.mesh.triangles.len()
    }

    /// Vertex indices of a triangle.
    #[inline]
    pub fn triangle(&self, triangle: usize) -> [u32; 3] {
        let vertices = self.mesh.triangles[triangle];
        self.placement
            .map_or(vertices, |placement| placement.wound(vertices))
    }

    /// Vertex indices of all triangles.
    pub fn triangles(self) -> impl Iterator<Item = [u32; 3]> + 'a {
        (0..self.triangle_count()).map(move |triangle| self.triangle(triangle))
    }

    /// Position of a vertex [m].
    pub fn position(&self, vertex: usize) -> DVec3 {
        let position = self.mesh.positions[vertex];
        self.placement
            .map_or(position, |placement| placement.position(position))
    }

    /// Positions of all vertices [m].
    pub fn positions(self) -> impl Iterator<Item = DVec3> + 'a {
        (0..self.mesh.positions.len()).map(move |vertex| self.position(vertex))
    }

    /// Unit normal of a vertex. If it must be computed from adjacent triangles, this transforms the whole mesh.
    #[inline(never)]
    pub fn normal(&self, vertex: usize) -> DVec3 {
        let normal = self.mesh.normals[vertex];
        self.placement.map_or(normal, |placement| {
            let placed = placement.normal(normal);
            placed.unwrap_or_else(|| placement.of_mesh(self.mesh).normals[vertex])
        })
    }

    /// Corner positions of a triangle [m].
    #[inline]
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        match self.placement {
            None => self.mesh.corners(triangle),
            Some(placement) => placement.corners(&self.mesh.corners(triangle)),
        }
    }

    /// Unit vertex normals of a triangle.
    #[inline]
    pub fn corner_normals(&self, triangle: usize) -> [DVec3; 3] {
        match self.placement {
            None => self.mesh.corner_normals(triangle),
            Some(_) => self.triangle(triangle).map(|vertex| self.normal(vertex as usize)),
        }
    }

    /// Unit normal of a triangle from its winding; zero for a degenerate triangle.
    pub fn face_normal(&self, triangle: usize) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Bounding box, as minimum and maximum corner [m]; `None` without vertices.
    pub fn bounds(self) -> Option<(DVec3, DVec3)> {
        let mut positions = self.positions();
        let first = positions.next()?;
        Some(positions.fold((first, first), |(low, high), p| (low.min(p), high.max(p))))
    }

    /// Area of a triangle [m²].
    pub fn triangle_area_m2(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Total area [m²].
    pub fn area_m2(&self) -> f64 {
        (0..self.triangle_count())
            .map(|triangle| self.triangle_area_m2(triangle))
            .sum()
    }

    /// TEXCOORD_0 or TEXCOORD_1, one per vertex.
    pub fn uvs(&self, set: usize) -> Option<&'a [DVec2]> {
        let uvs = if set == 0 { &self.mesh.uv0 } else { &self.mesh.uv1 };
        uvs.as_deref()
    }

    /// Interpolated vertex colour, which multiplies the base colour; white without colours.
    pub fn colour(&self, triangle: usize, barycentric: [f64; 3]) -> LinearSrgb {
        let Some(colours) = &self.mesh.colours else {
            return LinearSrgb::WHITE;
        };
        let corners = self.triangle(triangle).into_iter().zip(barycentric);
        let colour = corners.fold(LinearSrgb::BLACK, |sum, (vertex, weight)| {
            sum + LinearSrgb::from(colours[vertex as usize].map(f64::from)) * weight
        });
        colour.map(|channel| channel.clamp(0.0, 1.0))
    }
}

/// Matrix that transforms normals under a linear map: the inverse transpose without the division by the determinant, so
/// that flattened objects have normals too.
pub fn cofactors(linear: DMat3) -> DMat3 {
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y))
}
