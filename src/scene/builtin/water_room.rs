//! `water-room`: an indoor pool at night. A lamp under the water casts the caustics of its waves on walls and ceiling,
//! a spot above it casts them on the bottom.

use glam::DVec3;

use super::pool::add_rippled;
use super::{parts, shapes};
use crate::optics::LinearSrgb;
use crate::scene::{Light, LightKind, Scene};
use crate::units::RadiantIntensity;

/// Half sides of the room along x and z, its height, and half sides of the pool [m].
const ROOM_M: [f64; 2] = [3.2, 2.3];
const HEIGHT_M: f64 = 2.8;
const POOL_M: [f64; 2] = [2.2, 1.2];
/// Heights of the bottom and of the water surface; the deck is at 0 [m].
const BOTTOM_M: f64 = -1.3;
const WATER_M: f64 = -0.08;
/// Position of the lamp under the water [m].
const LAMP_M: DVec3 = DVec3::new(-0.35, -1.2, -0.1);

/// The room with its pool.
pub fn build() -> Scene {
    let mut scene = Scene::default();
    add_room(&mut scene);
    add_pool(&mut scene);
    scene.lights = vec![lamp(), spot()];
    scene.cameras = vec![
        parts::look("corner", [2.9, 1.55, 2.0], [-1.2, 0.75, -1.4], 1.0),
        parts::look("ceiling", [0.0, 0.5, 1.9], [0.0, 2.6, -1.2], 1.1),
        parts::look("pool", [2.6, 1.5, 1.8], [-0.4, -0.6, -0.2], 0.9),
    ];
    scene
}

fn add_room(scene: &mut Scene) {
    let plaster = parts::material(scene, parts::matte("plaster", LinearSrgb::new(0.5, 0.48, 0.45)));
    let stone = parts::material(scene, parts::matte("stone", LinearSrgb::new(0.3, 0.28, 0.26)));
    let [x, z] = ROOM_M;
    let [pool_x, pool_z] = POOL_M;
    for (name, across, along) in [
        ("deck behind", [-x, x], [-z, -pool_z]),
        ("deck before", [-x, x], [pool_z, z]),
        ("deck left", [-x, -pool_x], [-pool_z, pool_z]),
        ("deck right", [pool_x, x], [-pool_z, pool_z]),
    ] {
        parts::add_with(scene, name, shapes::floor(across, along, 0.0), stone);
    }
    let up = DVec3::Y * (0.5 * HEIGHT_M);
    add_four_sides(scene, ("wall", plaster), up, ROOM_M, up);
    let ceiling = shapes::rectangle(DVec3::Y * HEIGHT_M, DVec3::X * x, DVec3::Z * z);
    parts::add_with(scene, "ceiling", ceiling, plaster);
}

/// Adds the vertical sides of a box, which face inwards: its centre, half sides along x and z, and half its height.
fn add_four_sides(
    scene: &mut Scene,
    (name, material): (&str, usize),
    centre: DVec3,
    [x, z]: [f64; 2],
    half_up: DVec3,
) {
    for (side, inward, half_along) in [
        ("behind", DVec3::Z * z, DVec3::X * x),
        ("before", DVec3::NEG_Z * z, DVec3::NEG_X * x),
        ("left", DVec3::X * x, DVec3::NEG_Z * z),
        ("right", DVec3::NEG_X * x, DVec3::Z * z),
    ] {
        let mesh = shapes::rectangle(centre - inward, half_along, half_up);
        parts::add_with(scene, &format!("{name} {side}"), mesh, material);
    }
}

fn add_pool(scene: &mut Scene) {
    let tiles = parts::material(scene, parts::matte("tiles", LinearSrgb::new(0.55, 0.72, 0.76)));
    let [x, z] = POOL_M;
    parts::add_with(scene, "floor", shapes::floor([-x, x], [-z, z], BOTTOM_M), tiles);
    let middle = DVec3::Y * (0.5 * BOTTOM_M);
    add_four_sides(scene, ("side", tiles), middle, POOL_M, -middle);
    let waves = [
        (0.004, [5.0, 2.0], 0.0),
        (0.003, [-4.0, 9.0], 1.0),
        (0.0022, [17.0, 7.0], 2.0),
        (0.0018, [-13.0, 19.0], 3.0),
        (0.0015, [24.0, -15.0], 4.0),
        (0.001, [-9.0, -29.0], 5.0),
    ];
    let depth_m = WATER_M - BOTTOM_M;
    add_rippled(scene, DVec3::Y * WATER_M, POOL_M, &waves, depth_m);
}

/// Under the water, shining up within the critical angle of the surface.
fn lamp() -> Light {
    let kind = LightKind::Spot {
        position: LAMP_M,
        direction: DVec3::Y,
        intensity: RadiantIntensity(9.0),
        inner_cone_rad: 0.45,
        outer_cone_rad: 0.8,
    };
    Light {
        colour: LinearSrgb::new(0.78, 1.04, 1.16),
        ..Light::new("lamp", kind)
    }
}

/// Above the pool.
fn spot() -> Light {
    let position = DVec3::new(2.9, 2.6, -2.0);
    let kind = LightKind::Spot {
        position,
        direction: (DVec3::new(-0.5, WATER_M, 0.2) - position).normalize(),
        intensity: RadiantIntensity(22.0),
        inner_cone_rad: 0.2,
        outer_cone_rad: 0.36,
    };
    Light {
        colour: LinearSrgb::new(1.16, 0.98, 0.72),
        ..Light::new("spot", kind)
    }
}
