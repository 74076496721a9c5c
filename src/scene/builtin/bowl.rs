//! `bowl`: a cut bowl of lead glass on a white table, under one small lamp.

use glam::DVec3;

use super::cut_glass::CutGlass;
use super::{parts, shapes};
use crate::optics::LinearSrgb;
use crate::scene::Scene;
use crate::units::Flux;

/// Flint glass with a third of lead.
const GLASS: &str = "F2";
const BOWL: CutGlass = CutGlass {
    corners: 14,
    rings_m: &[[0.055, 0.0], [0.1, 0.03], [0.13, 0.068], [0.14, 0.1]],
    inside_m: 0.128,
    depth_m: 0.084,
    squareness: 2.0,
};

/// The bowl, 28 cm wide and 10 cm high, and a point light of 20 W (13,660 lm) of daylight behind it.
pub fn build() -> Scene {
    let mut scene = Scene::default();
    let table = shapes::floor([-1.5, 1.5], [-1.5, 1.0], 0.0);
    parts::add(
        &mut scene,
        "floor",
        table,
        parts::matte("white", LinearSrgb::grey(0.8)),
    );
    parts::add(&mut scene, "bowl", BOWL.mesh(), parts::glass(GLASS));
    let lamp = parts::point_light("lamp", DVec3::new(0.5, 0.62, -0.4), Flux(20.0));
    scene.lights.push(parts::daylight(lamp));
    scene.cameras = vec![
        parts::look("camera", [-0.12, 0.52, 0.58], [-0.07, 0.0, 0.02], 0.7),
        parts::look("caustic", [-0.3, 0.35, 0.45], [-0.25, 0.0, 0.18], 0.6),
    ];
    scene
}
