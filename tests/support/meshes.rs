//! Meshes shared by the tests.

use crate::prelude::*;

pub use nephroid::scene::builtin::shapes::cuboid;

/// A parallelogram with a corner and two sides. It faces −(side_u × side_v), so that u × v = −normal as on the floors
/// of the reference scenes. TEXCOORD_0 runs from 0 to 1 along the sides.
pub fn quad(corner: DVec3, side_u: DVec3, side_v: DVec3) -> Mesh {
    let normal = side_v.cross(side_u).normalize();
    Mesh {
        positions: vec![corner, corner + side_u, corner + side_u + side_v, corner + side_v],
        normals: vec![normal; 4],
        uv0: Some(vec![DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y]),
        uv1: None,
        colours: None,
        triangles: vec![[0, 2, 1], [0, 3, 2]],
    }
}

/// The square |x|, |z| ≤ half in the plane y = height, facing up.
pub fn floor(half: f64, height: f64) -> Mesh {
    quad(
        dvec3(-half, height, -half),
        DVec3::X * 2.0 * half,
        DVec3::Z * 2.0 * half,
    )
}

/// A grid over the surface r(s, t), s and t in [0, 1], facing ∂r/∂s × ∂r/∂t.
pub fn grid(columns: usize, rows: usize, place: impl Fn(f64, f64) -> DVec3) -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..=rows {
        for column in 0..=columns {
            let (s, t) = (column as f64 / columns as f64, row as f64 / rows as f64);
            let h = 1e-6;
            let (ds, dt) = (
                place(s + h, t) - place(s - h, t),
                place(s, t + h) - place(s, t - h),
            );
            mesh.positions.push(place(s, t));
            mesh.normals
                .push(ds.cross(dt).try_normalize().unwrap_or(DVec3::Y));
        }
    }
    let index = |column: usize, row: usize| (row * (columns + 1) + column) as u32;
    for row in 0..rows {
        for column in 0..columns {
            let [a, b, c, d] = [
                index(column, row),
                index(column + 1, row),
                index(column + 1, row + 1),
                index(column, row + 1),
            ];
            mesh.triangles.push([a, b, c]);
            mesh.triangles.push([a, c, d]);
        }
    }
    mesh
}

/// A sphere, facing outwards, with exact normals.
pub fn sphere(centre: DVec3, radius: f64, columns: usize, rows: usize) -> Mesh {
    let mut mesh = grid(columns, rows, |s, t| {
        let (phi, theta) = (s * std::f64::consts::TAU, (1.0 - t) * std::f64::consts::PI);
        centre + radius * dvec3(theta.sin() * phi.cos(), -theta.cos(), theta.sin() * phi.sin())
    });
    // Watertight: vertices at the seam and at the poles are equal bit for bit.
    let stride = columns + 1;
    for row in 0..=rows {
        mesh.positions[row * stride + columns] = mesh.positions[row * stride];
    }
    for column in 0..=columns {
        mesh.positions[column] = centre + DVec3::Y * radius;
        mesh.positions[rows * stride + column] = centre - DVec3::Y * radius;
    }
    mesh.normals = mesh
        .positions
        .iter()
        .map(|position| (*position - centre).normalize())
        .collect();
    mesh
}

/// Both meshes as one; texture coordinates are kept only if both have them.
pub fn joined(mut a: Mesh, b: Mesh) -> Mesh {
    let offset = a.positions.len() as u32;
    a.positions.extend(b.positions);
    a.normals.extend(b.normals);
    let both = |a: Option<Vec<DVec2>>, b: Option<Vec<DVec2>>| Some([a?, b?].concat());
    a.uv0 = both(a.uv0, b.uv0);
    a.uv1 = both(a.uv1, b.uv1);
    a.triangles.extend(
        b.triangles
            .iter()
            .map(|triangle| triangle.map(|vertex| vertex + offset)),
    );
    a
}

/// The mesh inside out.
pub fn inside_out(mut mesh: Mesh) -> Mesh {
    mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    mesh
}

/// The mesh rotated about the origin, then translated.
pub fn moved(mut mesh: Mesh, rotation: DMat3, offset: DVec3) -> Mesh {
    for position in &mut mesh.positions {
        *position = rotation * *position + offset;
    }
    for normal in &mut mesh.normals {
        *normal = rotation * *normal;
    }
    mesh
}
