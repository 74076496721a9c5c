//! `showroom`: mirror ring, glass ball and water basin on one floor.

use glam::DVec3;

use super::pool::Basin;
use super::reference::cylinder;
use super::{parts, shapes};
use crate::optics::LinearSrgb;
use crate::scene::{Camera, Light, Scene};
use crate::units::{Flux, Irradiance};

/// Floor of 6.4 m × 3.6 m with walls behind and to the right. A sun from the front left, 38 degrees high, draws the
/// cusp of a coffee cup in the ring, and a point light over the middle fills the shadows.
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

fn add_basin(scene: &mut Scene) {
    let material = parts::material(scene, parts::matte("basin", LinearSrgb::new(0.66, 0.72, 0.72)));
    let basin = Basin {
        centre: DVec3::new(1.15, 0.0, 0.15),
        half_m: [0.52, 0.46],
        wall_m: 0.05,
        rim_m: 0.38,
        bottom_m: 0.01,
        water_m: 0.34,
        waves: &[
            (0.004, [31.0, 6.0], 1.0),
            (0.004, [-9.0, 27.0], 2.0),
            (0.003, [22.0, 24.0], 0.0),
            (0.002, [36.0, -25.0], 4.0),
        ],
    };
    basin.add(scene, material, material);
}

fn lights() -> Vec<Light> {
    let tinted = |light: Light, colour: [f64; 3]| Light {
        colour: LinearSrgb::from(colour),
        ..light
    };
    let sun = parts::sun("sun", DVec3::new(0.6, -0.62, -0.5), Irradiance(1.6));
    let lamp = parts::point_light("lamp", DVec3::new(-0.4, 1.9, 0.8), Flux(12.0));
    vec![tinted(sun, [1.08, 0.99, 0.86]), tinted(lamp, [0.95, 1.0, 1.15])]
}

fn cameras() -> Vec<Camera> {
    vec![
        parts::look("overview", [0.05, 1.75, 2.9], [0.08, 0.12, 0.0], 0.72),
        parts::look("ring", [-1.6, 1.0, 1.6], [-1.0, 0.05, 0.25], 0.7),
        parts::look("basin", [0.8, 1.3, 1.4], [1.18, 0.1, 0.05], 0.7),
    ]
}
