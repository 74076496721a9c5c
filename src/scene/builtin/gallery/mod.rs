//! `gallery`: a room to walk through, with low sun on a table of glass, and along the wall the caustics of water, a
//! prism, and a lens that was designed to project a picture.

mod exhibits;
mod glassware;
mod patterns;
mod picture;
mod room;
mod table;

use glam::DVec3;

use super::parts;
use crate::optics::LinearSrgb;
use crate::scene::{Camera, Light, LightSize, Scene};
use crate::units::{Flux, Irradiance};

/// A room of 4.6 m × 4.5 m, 2.7 m high: a sun of 1.8 W/m² through the window in its right wall, three spots.
pub fn build() -> Scene {
    let mut scene = Scene::default();
    room::add(&mut scene);
    table::add(&mut scene);
    exhibits::add(&mut scene);
    scene.lights = lights();
    scene.environment = room::sky();
    scene.cameras = cameras();
    scene
}

/// Colour of filament lamps.
const WARM: LinearSrgb = LinearSrgb::new(1.12, 0.98, 0.8);

/// Colour of the low sun.
const SUN: LinearSrgb = LinearSrgb::new(1.07, 0.99, 0.88);

fn lights() -> Vec<Light> {
    let tinted = |light: Light, colour: LinearSrgb| Light { colour, ..light };
    let water = exhibits::BASIN.with_y(exhibits::WATER_M);
    let basin_lamp = water + DVec3::new(0.35, 1.15, 1.4);
    let block = exhibits::block();
    vec![
        Light {
            size: LightSize::Angle {
                diameter_rad: 0.53_f64.to_radians(),
            },
            ..tinted(parts::sun("sun", room::SUN_DIRECTION, Irradiance(1.8)), SUN)
        },
        tinted(
            parts::beam("basin spot", basin_lamp, water - basin_lamp, 0.17, Flux(0.5)),
            WARM,
        ),
        tinted(
            parts::beam("block spot", exhibits::BLOCK_LAMP, block.forward, 0.1, Flux(0.07)),
            WARM,
        ),
        parts::daylight(exhibits::prism_beam()),
    ]
}

fn cameras() -> Vec<Camera> {
    let look = |name: &str, from: [f64; 3], to: DVec3, fov_rad: f64| {
        Camera::look_at(name, DVec3::from_array(from), to, fov_rad)
    };
    vec![
        look("overview", [0.28, 1.24, 1.46], DVec3::new(0.14, 0.93, -0.3), 0.84),
        look(
            "wine glass",
            [0.1, 1.22, 0.85],
            table::WINE_GLASS + DVec3::new(-0.16, 0.04, 0.0),
            0.6,
        ),
        look(
            "tumbler",
            [0.62, 1.08, 0.62],
            table::TUMBLER + DVec3::new(-0.08, 0.03, 0.0),
            0.5,
        ),
        look("ring", [-0.25, 1.3, 1.15], table::RING, 0.5),
        look("mirror", [0.15, 1.2, 0.9], table::MIRROR, 0.5),
        look(
            "basin",
            [-1.1, 1.5, 0.3],
            exhibits::BASIN + DVec3::new(0.0, 0.85, -0.2),
            0.95,
        ),
        look(
            "prism",
            [0.2, 1.6, 0.1],
            exhibits::PRISM.lerp(exhibits::spectrum(), 0.42),
            0.8,
        ),
        look("picture", [1.9, 1.45, 0.35], block_and_picture(), 0.75),
    ]
}

fn block_and_picture() -> DVec3 {
    exhibits::block().centre.lerp(exhibits::picture(), 0.6)
}
