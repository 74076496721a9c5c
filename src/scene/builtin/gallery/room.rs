//! The room: floor, walls, ceiling, and a window.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::patterns;
use crate::scene::builtin::{parts, shapes};
use crate::scene::{Environment, Mesh, Scene};

/// Inner bounds [m].
pub const X: [f64; 2] = [-2.3, 2.3];
/// Inner bounds [m].
pub const Z: [f64; 2] = [-1.6, 2.9];
const HEIGHT_M: f64 = 2.7;

/// Opening in the right wall, along z and y [m].
const WINDOW_Z: [f64; 2] = [-0.9, 0.5];
const WINDOW_Y: [f64; 2] = [0.9, 2.4];
/// Depth of the wall at the opening [m].
const REVEAL_M: f64 = 0.14;
/// Direction of travel of the sun's light: 27 degrees downwards, in through the window.
pub const SUN_DIRECTION: DVec3 = DVec3::new(-0.8, -0.43, 0.22);

/// Radiance at the zenith, at the horizon, and of the land below it [W/(m² sr)].
const ZENITH: DVec3 = DVec3::new(0.05, 0.09, 0.19);
const HORIZON: DVec3 = DVec3::new(0.25, 0.24, 0.22);
const LAND: DVec3 = DVec3::new(0.045, 0.042, 0.03);

/// Sky as seen through the window and in reflections. It is not a light, since it would add little to the sun.
pub fn sky() -> Option<Arc<Environment>> {
    const ROWS: usize = 128;
    let row = |row: usize| {
        let elevation = (0.5 - (row as f64 + 0.5) / ROWS as f64) * std::f64::consts::PI;
        let above = HORIZON.lerp(ZENITH, elevation.sin().max(0.0).powf(0.6));
        let radiance = LAND.lerp(above, ((elevation + 0.02) / 0.04).clamp(0.0, 1.0));
        radiance.as_vec3().to_array()
    };
    Environment::new(1, ROWS, (0..ROWS).map(row).collect()).map(Arc::new)
}

/// Adds everything but the exhibits.
pub fn add(scene: &mut Scene) {
    let middle = DVec3::new(0.5 * (X[0] + X[1]), 0.5 * HEIGHT_M, 0.5 * (Z[0] + Z[1]));
    let (half_x, half_z) = (0.5 * (X[1] - X[0]), 0.5 * (Z[1] - Z[0]));
    let half_y = 0.5 * HEIGHT_M;
    let (right, up, front) = (DVec3::X * half_x, DVec3::Y * half_y, DVec3::Z * half_z);
    let tiles = patterns::add(scene, "floor tiles", 1.8, |place| {
        patterns::tiles(
            place,
            6,
            [DVec3::new(132.0, 104.0, 86.0), DVec3::new(92.0, 84.0, 78.0)],
        )
    });
    let plaster = patterns::add(scene, "plaster", 2.4, |place| {
        patterns::plaster(place, DVec3::new(218.0, 208.0, 192.0))
    });
    let faces = [
        ("floor", shapes::floor(X, Z, 0.0), tiles),
        ("ceiling", shapes::rectangle(middle + up, right, front), plaster),
        ("back wall", shapes::rectangle(middle - front, right, up), plaster),
        (
            "front wall",
            shapes::rectangle(middle + front, -right, up),
            plaster,
        ),
        (
            "left wall",
            shapes::rectangle(middle - right, -front, up),
            plaster,
        ),
    ];
    for (name, mesh, material) in faces {
        parts::add_with(scene, name, in_metres(mesh), material);
    }
    add_window_wall(scene, plaster);
}

/// Sets TEXCOORD_0 of a rectangle to metres along its sides, so that textures have the same scale everywhere. The
/// original coordinates become TEXCOORD_1, for maps.
#[must_use]
pub fn in_metres(mut mesh: Mesh) -> Mesh {
    mesh.uv1 = mesh.uv0.take();
    let [first, second, _, last] = mesh.positions[..] else {
        return mesh;
    };
    let [u, v] = [second - first, last - first].map(DVec3::normalize);
    // Relative to the scene's origin, so that textures continue across adjacent faces.
    let place = |position: &DVec3| DVec2::new(position.dot(u), -position.dot(v));
    mesh.uv0 = Some(mesh.positions.iter().map(place).collect());
    mesh
}

/// Adds rectangles with textures in metres: name, offset from `middle` and half axes [m] of each.
pub fn add_faces(
    scene: &mut Scene,
    (name, material): (&str, usize),
    middle: DVec3,
    faces: &[(&str, DVec3, DVec3, DVec3)],
) {
    for (face, offset, u, v) in faces {
        let mesh = in_metres(shapes::rectangle(middle + offset, *u, *v));
        parts::add_with(scene, &format!("{name} {face}"), mesh, material);
    }
}

/// Adds four pieces of wall around the opening, and the four sides of the opening.
fn add_window_wall(scene: &mut Scene, plaster: usize) {
    let x = X[1];
    let pieces = [
        ("below window", Z, [0.0, WINDOW_Y[0]]),
        ("above window", Z, [WINDOW_Y[1], HEIGHT_M]),
        ("behind window", [Z[0], WINDOW_Z[0]], WINDOW_Y),
        ("before window", [WINDOW_Z[1], Z[1]], WINDOW_Y),
    ];
    for (name, z, y) in pieces {
        let centre = DVec3::new(x, 0.5 * (y[0] + y[1]), 0.5 * (z[0] + z[1]));
        let piece = shapes::rectangle(
            centre,
            DVec3::Z * (0.5 * (z[1] - z[0])),
            DVec3::Y * (0.5 * (y[1] - y[0])),
        );
        parts::add_with(scene, name, in_metres(piece), plaster);
    }
    let centre = DVec3::new(
        x + 0.5 * REVEAL_M,
        0.5 * (WINDOW_Y[0] + WINDOW_Y[1]),
        0.5 * (WINDOW_Z[0] + WINDOW_Z[1]),
    );
    let depth = DVec3::X * (0.5 * REVEAL_M);
    let up = DVec3::Y * (0.5 * (WINDOW_Y[1] - WINDOW_Y[0]));
    let along = DVec3::Z * (0.5 * (WINDOW_Z[1] - WINDOW_Z[0]));
    let sides = [
        ("sill", -up, along, depth),
        ("lintel", up, depth, along),
        ("jamb behind", -along, depth, up),
        ("jamb before", along, up, depth),
    ];
    add_faces(scene, ("window", plaster), centre, &sides);
}
