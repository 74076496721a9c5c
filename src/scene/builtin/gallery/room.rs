//! The room: floor, walls, ceiling, and a window.

use glam::DVec3;

use crate::optics::LinearSrgb;
use crate::scene::Scene;
use crate::scene::builtin::{parts, shapes};

/// Inner borders [m].
pub const X: [f64; 2] = [-3.6, 3.6];
/// Inner borders [m].
pub const Z: [f64; 2] = [-2.6, 3.0];
/// Height [m].
pub const HEIGHT_M: f64 = 3.0;

/// The opening in the right wall: along it and up [m].
const WINDOW_Z: [f64; 2] = [-1.5, 0.5];
const WINDOW_Y: [f64; 2] = [0.8, 2.5];
/// How deep the wall is there [m].
const REVEAL_M: f64 = 0.18;
/// Where the sun goes: 36 degrees below the horizon, away from the window.
pub const SUN_DIRECTION: DVec3 = DVec3::new(-0.72, -0.55, 0.25);

/// Everything but what is shown in it.
pub fn add(scene: &mut Scene) {
    let middle = DVec3::new(0.5 * (X[0] + X[1]), 0.5 * HEIGHT_M, 0.5 * (Z[0] + Z[1]));
    let (half_x, half_z) = (0.5 * (X[1] - X[0]), 0.5 * (Z[1] - Z[0]));
    let half_y = 0.5 * HEIGHT_M;
    let (right, up, front) = (DVec3::X * half_x, DVec3::Y * half_y, DVec3::Z * half_z);
    let oak = parts::matte("oak", LinearSrgb::new(0.46, 0.34, 0.24));
    parts::add(scene, "floor", shapes::floor(X, Z, 0.0), oak);
    let ceiling = shapes::rectangle(middle + up, right, front);
    parts::add(
        scene,
        "ceiling",
        ceiling,
        parts::matte("ceiling", LinearSrgb::grey(0.8)),
    );
    let plaster = parts::material(scene, parts::matte("plaster", LinearSrgb::new(0.74, 0.72, 0.68)));
    let back = shapes::rectangle(middle - front, right, up);
    parts::add_with(scene, "back wall", back, plaster);
    let rear = shapes::rectangle(middle + front, -right, up);
    parts::add_with(scene, "front wall", rear, plaster);
    let left = parts::matte("blue wall", LinearSrgb::new(0.24, 0.36, 0.46));
    parts::add(
        scene,
        "left wall",
        shapes::rectangle(middle - right, -front, up),
        left,
    );
    add_window_wall(scene, plaster);
}

/// Four pieces around the opening, and its four sides.
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
        parts::add_with(scene, name, piece, plaster);
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
        ("window sill", -up, along, depth),
        ("window lintel", up, depth, along),
        ("window jamb behind", -along, depth, up),
        ("window jamb before", along, up, depth),
    ];
    for (name, offset, u, v) in sides {
        parts::add_with(scene, name, shapes::rectangle(centre + offset, u, v), plaster);
    }
}
