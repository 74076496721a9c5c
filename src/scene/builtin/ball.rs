//! `ball`: a glass ball with a lamp on its axis.

use glam::DVec3;

use super::{parts, shapes};
use crate::scene::Scene;
use crate::units::Flux;

/// Radius 0.5 m, n = 1.5, centred 0.8 m above the floor; a point light of 100 W at 3 m.
pub fn build() -> Scene {
    let mut scene = parts::reference_scene(0.6);
    // 327,680 triangles: the focus magnifies the remaining meshing error, 0.5 % of its map at 256².
    let ball = shapes::sphere(DVec3::new(0.0, 0.8, 0.0), 0.5, 7);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    scene.lights.push(parts::point_light(
        "light",
        DVec3::new(0.0, 3.0, 0.0),
        Flux(100.0),
    ));
    scene
}
