//! `gallery`: a room to walk through, with daylight through a window and an exhibit for each way that glass, mirrors and
//! water turn light.

mod exhibits;
mod room;

use glam::DVec3;

use super::parts;
use crate::optics::LinearSrgb;
use crate::scene::{Camera, Light, Scene};
use crate::units::{Flux, Irradiance};

/// A room of 7.2 m × 5.6 m, 3 m high: a sun of 0.8 W/m² through the window in its right wall, a spot on each exhibit.
pub fn build() -> Scene {
    let mut scene = Scene::default();
    room::add(&mut scene);
    exhibits::add(&mut scene);
    scene.lights = lights();
    scene.cameras = cameras();
    scene
}

/// Warm as filament lamps are.
const WARM: LinearSrgb = LinearSrgb::new(1.12, 0.98, 0.8);

/// Low daylight.
const SUN: LinearSrgb = LinearSrgb::new(1.1, 0.99, 0.84);

fn lights() -> Vec<Light> {
    let tinted = |light: Light, colour: LinearSrgb| Light { colour, ..light };
    let sun = parts::sun("sun", room::SUN_DIRECTION, Irradiance(0.8));
    let spots = [
        (
            "basin spot",
            exhibits::BASIN + DVec3::new(-0.5, 2.9, -0.3),
            exhibits::BASIN,
            0.27,
            Flux(4.5),
        ),
        (
            "bowl spot",
            exhibits::BOWL + DVec3::new(0.42, 0.62, -0.3),
            exhibits::BOWL + DVec3::Y * 0.04,
            0.24,
            Flux(0.02),
        ),
        (
            "ball spot",
            exhibits::BALL + DVec3::new(0.3, 0.75, -0.55),
            exhibits::BALL,
            0.16,
            Flux(0.035),
        ),
    ];
    let spots = spots.into_iter().map(|(name, from, to, half_angle_rad, power)| {
        tinted(parts::beam(name, from, to - from, half_angle_rad, power), WARM)
    });
    let mut lights = vec![tinted(sun, SUN)];
    lights.extend(spots);
    lights.push(parts::daylight(exhibits::prism_beam()));
    lights
}

fn cameras() -> Vec<Camera> {
    let look = |name: &str, from: [f64; 3], to: DVec3, fov_rad: f64| {
        Camera::look_at(name, DVec3::from_array(from), to, fov_rad)
    };
    vec![
        look("overview", [3.1, 1.8, 2.7], DVec3::new(-0.85, 0.62, -0.9), 0.85),
        look("basin", [-0.6, 1.5, 2.4], exhibits::BASIN + DVec3::Y * 0.2, 0.75),
        look("ring", [3.15, 1.55, 0.7], exhibits::RING, 0.62),
        look("bowl", [-2.1, 1.5, -0.9], exhibits::BOWL, 0.6),
        look("ball", [-0.6, 1.25, -0.7], exhibits::BALL, 0.6),
        look(
            "prism",
            [1.9, 1.5, -1.1],
            exhibits::PRISM.lerp(exhibits::spectrum(), 0.55),
            0.6,
        ),
    ]
}
