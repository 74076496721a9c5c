//! How normals turn along surfaces: the shape operator, per vertex, interpolated like the normals.
//!
//! Within one triangle the interpolated normal has a derivative that is wrong by O(edge length) against the surface
//! that the mesh stands for; averaged over the triangles around a vertex it is right to second order on regular
//! meshes.

use glam::{DMat3, DVec3};

use crate::scene::Mesh;

/// Derivative of the unit normal by position [1/m], symmetric 3×3: `dn = S·dp` for a step dp along the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ShapeOperator {
    /// xx, xy, xz, yy, yz, zz: single precision is far below the error of any mesh.
    entries: [f32; 6],
}

/// Shape operators at the vertices of a mesh.
#[derive(Clone, Debug)]
pub struct NormalField {
    vertices: Vec<ShapeOperator>,
}

impl NormalField {
    /// Averages each vertex's triangles by area.
    pub fn new(mesh: &Mesh) -> Self {
        let mut sums = vec![(DMat3::ZERO, 0.0_f64); mesh.positions.len()];
        for (triangle, vertices) in mesh.triangles.iter().enumerate() {
            let Some((operator, area_m2)) = of_triangle(mesh, triangle) else {
                continue;
            };
            for &vertex in vertices {
                let sum = &mut sums[vertex as usize];
                *sum = (sum.0 + operator * area_m2, sum.1 + area_m2);
            }
        }
        let vertices = sums
            .into_iter()
            .map(|(sum, area_m2)| {
                if area_m2 > 0.0 {
                    ShapeOperator::from_matrix(sum * area_m2.recip())
                } else {
                    ShapeOperator::default()
                }
            })
            .collect();
        Self { vertices }
    }

    /// The normal's change [1] for a step along the surface [m] at a point of a triangle.
    pub fn turn(&self, mesh: &Mesh, triangle: usize, barycentric: [f64; 3], step: DVec3) -> DVec3 {
        mesh.triangles[triangle]
            .iter()
            .zip(barycentric)
            .map(|(&vertex, weight)| self.vertices[vertex as usize].apply(step) * weight)
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

/// The linear map that takes a triangle's edges to the differences of its corner normals and its normal to zero, with
/// the triangle's area [m²]; `None` without area.
fn of_triangle(mesh: &Mesh, triangle: usize) -> Option<(DMat3, f64)> {
    let [a, b, c] = mesh.corners(triangle);
    let [na, nb, nc] = mesh.corner_normals(triangle);
    let (dual_b, dual_c) = dual_edges(b - a, c - a)?;
    let outer = |column: DVec3, row: DVec3| DMat3::from_cols(column * row.x, column * row.y, column * row.z);
    Some((
        outer(nb - na, dual_b) + outer(nc - na, dual_c),
        mesh.triangle_area_m2(triangle),
    ))
}

/// Vectors in the plane of two edges whose products with (edge 1, edge 2) are (1, 0) and (0, 1) [1/m].
pub(super) fn dual_edges(e1: DVec3, e2: DVec3) -> Option<(DVec3, DVec3)> {
    let normal = e1.cross(e2);
    let squared = normal.length_squared();
    (squared > 0.0 && squared.is_finite()).then(|| (e2.cross(normal) / squared, normal.cross(e1) / squared))
}

/// The change of the interpolated, normalised normal [1] for a step [m] within one triangle.
pub fn turn_within(mesh: &Mesh, triangle: usize, barycentric: [f64; 3], step: DVec3) -> DVec3 {
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
