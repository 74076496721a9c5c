//! `showroom`: mirror ring, glass ball and water basin on one floor; the scene that the program opens with.

use glam::DVec3;

use super::pool::{Wave, water};
use super::ring::cylinder;
use super::{parts, shapes};
use crate::optics::LinearSrgb;
use crate::scene::{Camera, Light, Scene};
use crate::units::{Flux, Irradiance};

/// Floor of 6.4 m × 3.6 m with walls behind and to the right; sun from the front left, 38 degrees high, so that the ring
/// shows the coffee cup's cusp, and a lamp over the middle that lights the shadows.
pub fn build() -> Scene {
    let mut scene = Scene::default();
    add_room(&mut scene);
    parts::add(
        &mut scene,
        "ring",
        cylinder(DVec3::new(-1.05, 0.0, 0.3), 0.5, 0.3),
        parts::mirror(),
    );
    let ball = shapes::sphere(DVec3::new(-0.05, 0.36, -0.2), 0.27, 6);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    add_basin(&mut scene);
    scene.lights = lights();
    scene.cameras = cameras();
    scene
}

fn add_room(scene: &mut Scene) {
    let floor = shapes::floor([-3.2, 3.2], [-1.6, 2.0], 0.0);
    parts::add(
        scene,
        "floor",
        floor,
        parts::matte("plaster", LinearSrgb::new(0.62, 0.6, 0.56)),
    );
    parts::add(
        scene,
        "back wall",
        shapes::rectangle(DVec3::new(0.0, 0.8, -1.6), DVec3::X * 3.2, DVec3::Y * 0.8),
        parts::matte("blue wall", LinearSrgb::new(0.3, 0.42, 0.55)),
    );
    parts::add(
        scene,
        "right wall",
        shapes::rectangle(DVec3::new(3.2, 0.8, 0.2), DVec3::Z * 1.8, DVec3::Y * 0.8),
        parts::matte("red wall", LinearSrgb::new(0.58, 0.32, 0.24)),
    );
}

/// Inner half width and depth of the basin [m].
const BASIN_HALF_M: [f64; 2] = [0.52, 0.46];
const BASIN_WALL_M: f64 = 0.05;
const BASIN_CENTRE: DVec3 = DVec3::new(1.15, 0.0, 0.15);
const BASIN_RIM_M: f64 = 0.38;
const WATER_LEVEL_M: f64 = 0.34;

/// Four walls around a bright bottom a little above the floor, and the water. Every face is an object of its own,
/// since each is plane and gets its own map. The sheet of water ends inside the walls, so that no light slips past it.
fn add_basin(scene: &mut Scene) {
    scene
        .materials
        .push(parts::matte("basin", LinearSrgb::new(0.66, 0.72, 0.72)));
    let material = scene.materials.len() - 1;
    let [half_x, half_z] = BASIN_HALF_M;
    let bottom = shapes::floor(
        [BASIN_CENTRE.x - half_x, BASIN_CENTRE.x + half_x],
        [BASIN_CENTRE.z - half_z, BASIN_CENTRE.z + half_z],
        0.01,
    );
    parts::add_with(scene, "basin bottom", bottom, material);
    for (side, outward, half_inner, half_along) in [
        ("left", DVec3::NEG_X, half_x, half_z),
        ("right", DVec3::X, half_x, half_z),
        ("back", DVec3::NEG_Z, half_z, half_x),
        ("front", DVec3::Z, half_z, half_x),
    ] {
        add_basin_wall(scene, side, outward, half_inner, half_along, material);
    }
    let wave = |amplitude_m, kx, kz, phase_rad| Wave {
        amplitude_m,
        wave_vector: [kx, kz],
        phase_rad,
    };
    let waves = [
        wave(0.004, 31.0, 6.0, 1.0),
        wave(0.004, -9.0, 27.0, 2.0),
        wave(0.003, 22.0, 24.0, 0.0),
        wave(0.002, 36.0, -25.0, 4.0),
    ];
    let surface = water(
        BASIN_CENTRE + DVec3::Y * WATER_LEVEL_M,
        BASIN_HALF_M.map(|half| half + 0.5 * BASIN_WALL_M),
        [256, 216],
        &waves,
    );
    parts::add(scene, "water", surface, parts::dielectric("water", 1.333));
}

fn add_basin_wall(
    scene: &mut Scene,
    side: &str,
    outward: DVec3,
    half_inner: f64,
    half_along: f64,
    material: usize,
) {
    let up = DVec3::Y * (0.5 * BASIN_RIM_M);
    let along = DVec3::Y.cross(outward);
    let (inner, outer) = (half_inner, half_inner + BASIN_WALL_M);
    let at = |distance: f64| BASIN_CENTRE + outward * distance;
    let inside = shapes::rectangle(at(inner) + up, -along * half_along, up);
    let outside = shapes::rectangle(at(outer) + up, along * (half_along + BASIN_WALL_M), up);
    let rim = shapes::rectangle(
        at(0.5 * (inner + outer)) + 2.0 * up,
        along * (half_along + BASIN_WALL_M),
        -outward * (0.5 * BASIN_WALL_M),
    );
    parts::add_with(scene, &format!("basin {side} inside"), inside, material);
    parts::add_with(scene, &format!("basin {side} outside"), outside, material);
    parts::add_with(scene, &format!("basin {side} rim"), rim, material);
}

fn lights() -> Vec<Light> {
    let sun = parts::sun("sun", DVec3::new(0.6, -0.62, -0.5), Irradiance(1.6));
    let lamp = parts::point_light("lamp", DVec3::new(-0.4, 1.9, 0.8), Flux(12.0));
    vec![
        Light {
            colour: LinearSrgb::new(1.08, 0.99, 0.86),
            ..sun
        },
        Light {
            colour: LinearSrgb::new(0.95, 1.0, 1.15),
            ..lamp
        },
    ]
}

fn cameras() -> Vec<Camera> {
    vec![
        Camera::look_at(
            "overview",
            DVec3::new(0.05, 1.75, 2.9),
            DVec3::new(0.08, 0.12, 0.0),
            0.72,
        ),
        Camera::look_at(
            "ring",
            DVec3::new(-1.6, 1.0, 1.6),
            DVec3::new(-1.0, 0.05, 0.25),
            0.7,
        ),
        Camera::look_at(
            "basin",
            DVec3::new(0.8, 1.3, 1.4),
            DVec3::new(1.18, 0.1, 0.05),
            0.7,
        ),
    ]
}
