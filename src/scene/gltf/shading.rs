//! Vertex normals: repaired where the file has bad ones, made where it has none.

use glam::DVec3;

use super::report::Report;
use crate::scene::Mesh;

/// How far from 1 [relative] the length of a normal may be before it is worth a word; 8-bit normals stay within it.
const UNIT_TOLERANCE: f64 = 0.02;

/// Splits all corners and gives each triangle its own normal, as glTF wants where normals are missing.
pub fn shade_flat(mesh: &mut Mesh) {
    let order: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    let normals: Vec<DVec3> = (0..mesh.triangles.len())
        .map(|triangle| mesh.face_normal(triangle))
        .collect();
    let split = |values: &Option<Vec<_>>| {
        let values = values.as_ref()?;
        Some(order.iter().map(|vertex| values[*vertex as usize]).collect())
    };
    *mesh = Mesh {
        positions: order
            .iter()
            .map(|vertex| mesh.positions[*vertex as usize])
            .collect(),
        normals: normals.iter().flat_map(|normal| [*normal; 3]).collect(),
        uv0: split(&mesh.uv0),
        uv1: split(&mesh.uv1),
        triangles: (0..mesh.triangles.len() as u32)
            .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
            .collect(),
    };
}

/// Brings all normals to length 1. Those that are zero or not finite are taken from the triangles around the vertex,
/// weighted by area. Every vertex is part of a triangle that has an area.
pub fn repair(mesh: &mut Mesh, lengths_in_file: impl Iterator<Item = f64>, owner: &str, report: &mut Report) {
    let (mut replaced, mut rescaled) = (0, 0);
    let mut around: Option<Vec<DVec3>> = None;
    for (vertex, length) in lengths_in_file.enumerate() {
        let unit = mesh.normals[vertex]
            .try_normalize()
            .filter(|_| length > 0.0 && length.is_finite());
        rescaled += usize::from(unit.is_some() && (length - 1.0).abs() > UNIT_TOLERANCE);
        mesh.normals[vertex] = unit.unwrap_or_else(|| {
            replaced += 1;
            let around = around.get_or_insert_with(|| face_normals_around(mesh));
            around[vertex]
        });
    }
    if replaced > 0 {
        report.warn(
            owner,
            format!("{replaced} normals are zero or not finite and were taken from the triangles"),
            "export the normals again",
        );
    }
    if rescaled > 0 {
        report.warn(
            owner,
            format!("{rescaled} normals are not of length 1 and were brought to it"),
            "export the normals again",
        );
    }
}

fn face_normals_around(mesh: &Mesh) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    let mut any = sums.clone();
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(triangle);
        for vertex in mesh.triangles[triangle] {
            sums[vertex as usize] += (b - a).cross(c - a);
            any[vertex as usize] = mesh.face_normal(triangle);
        }
    }
    // Triangles back to back cancel: then any one of them is as good.
    sums.iter()
        .zip(any)
        .map(|(sum, any)| sum.try_normalize().unwrap_or(any))
        .collect()
}
