//! The shape operator of surfaces, per vertex, interpolated like the normals.
//!
//! Within one triangle the interpolated normal has a derivative that is wrong by O(edge length) against the surface
//! that the mesh stands for; averaged over the triangles around a vertex it is right to second order on regular
//! meshes.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use crate::scene::{InScene, Mesh};

/// Derivative of the unit normal with respect to position [1/m], symmetric 3×3: `dn = S·dp` for a step dp along the
/// surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShapeOperator {
    /// xx, xy, xz, yy, yz, zz. Single precision rounds far below the discretisation error of any mesh.
    entries: [f32; 6],
}

/// Shape operators at the vertices of a mesh.
#[derive(Clone, Debug)]
pub enum NormalField {
    /// Precomputed.
    Known(Vec<ShapeOperator>),
    /// Computed on demand from the triangles around a vertex: stored operators of a mesh with many instances would take
    /// more memory than everything else.
    Found(Arc<TrianglesAround>),
}

/// Triangles around each vertex of a mesh, ascending.
#[derive(Debug)]
pub struct TrianglesAround(Vec<Vec<u32>>);

impl TrianglesAround {
    pub fn of(mesh: &Mesh) -> Self {
        let mut around = vec![Vec::new(); mesh.positions.len()];
        for (triangle, vertices) in (0..).zip(&mesh.triangles) {
            vertices
                .iter()
                .for_each(|&vertex| around[vertex as usize].push(triangle));
        }
        Self(around)
    }

    /// Area-weighted average over the triangles around a vertex.
    fn operator(&self, mesh: InScene, vertex: usize) -> ShapeOperator {
        let (mut sum, mut sum_m2) = (DMat3::ZERO, 0.0);
        let triangles = self.0[vertex].iter();
        for (operator, area_m2) in triangles.filter_map(|&triangle| of_triangle(mesh, triangle as usize)) {
            sum += operator * area_m2;
            sum_m2 += area_m2;
        }
        if sum_m2 > 0.0 {
            ShapeOperator::from_matrix(sum * sum_m2.recip())
        } else {
            ShapeOperator::default()
        }
    }
}

impl NormalField {
    /// Precomputed, for a mesh in scene coordinates.
    pub fn new(mesh: &Mesh) -> Self {
        let around = TrianglesAround::of(mesh);
        let vertices = 0..mesh.positions.len();
        Self::Known(
            vertices
                .map(|vertex| around.operator(mesh.into(), vertex))
                .collect(),
        )
    }

    /// Change of the normal [1] for a step [m] along the surface at a point of a triangle.
    pub fn turn(&self, mesh: InScene, triangle: usize, barycentric: [f64; 3], step: DVec3) -> DVec3 {
        let corners = mesh.triangle(triangle).map(|vertex| vertex as usize);
        let operators = match self {
            Self::Known(vertices) => corners.map(|vertex| vertices[vertex]),
            Self::Found(around) => corners.map(|vertex| around.operator(mesh, vertex)),
        };
        let weighted = operators.iter().zip(barycentric);
        weighted
            .map(|(operator, weight)| operator.apply(step) * weight)
            .sum()
    }
}

impl ShapeOperator {
    fn from_matrix(matrix: DMat3) -> Self {
        let mean = (matrix + matrix.transpose()) * 0.5;
        let entry = |row: usize, column: usize| mean.col(column)[row] as f32;
        Self {
            entries: [
                entry(0, 0),
                entry(0, 1),
                entry(0, 2),
                entry(1, 1),
                entry(1, 2),
                entry(2, 2),
            ],
        }
    }

    fn apply(&self, v: DVec3) -> DVec3 {
        let [xx, xy, xz, yy, yz, zz] = self.entries.map(f64::from);
        DVec3::new(
            xx * v.x + xy * v.y + xz * v.z,
            xy * v.x + yy * v.y + yz * v.z,
            xz * v.x + yz * v.y + zz * v.z,
        )
    }
}

/// Linear map that takes a triangle's edges to the differences of its vertex normals, and its face normal to zero; with
/// the triangle's area [m²]. `None` for a degenerate triangle.
fn of_triangle(mesh: InScene, triangle: usize) -> Option<(DMat3, f64)> {
    let [a, b, c] = mesh.corners(triangle);
    let [na, nb, nc] = mesh.corner_normals(triangle);
    let (dual_b, dual_c) = dual_edges(b - a, c - a)?;
    let outer = |column: DVec3, row: DVec3| DMat3::from_cols(column * row.x, column * row.y, column * row.z);
    Some((
        outer(nb - na, dual_b) + outer(nc - na, dual_c),
        mesh.triangle_area_m2(triangle),
    ))
}

/// Dual basis of two edges within their plane [1/m]: dot products with (e1, e2) are (1, 0) and (0, 1). `None` if
/// degenerate.
pub(super) fn dual_edges(e1: DVec3, e2: DVec3) -> Option<(DVec3, DVec3)> {
    let normal = e1.cross(e2);
    let squared = normal.length_squared();
    (squared > 0.0 && squared.is_finite()).then(|| (e2.cross(normal) / squared, normal.cross(e1) / squared))
}

/// Change of the interpolated, normalised normal [1] for a step [m] within one triangle.
pub fn turn_within(mesh: InScene, triangle: usize, barycentric: [f64; 3], step: DVec3) -> DVec3 {
    let [a, b, c] = mesh.corners(triangle);
    let Some((dual_b, dual_c)) = dual_edges(b - a, c - a) else {
        return DVec3::ZERO;
    };
    let [na, nb, nc] = mesh.corner_normals(triangle);
    let [wa, wb, wc] = barycentric;
    let sum = na * wa + nb * wb + nc * wc;
    let length = sum.length();
    if length <= 0.0 {
        return DVec3::ZERO;
    }
    let change = ((nb - na) * dual_b.dot(step) + (nc - na) * dual_c.dot(step)) / length;
    let unit = sum / length;
    change - unit * unit.dot(change)
}
