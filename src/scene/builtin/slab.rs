//! `slab`: a plane-parallel glass plate under a lamp; its caustic layer has a closed form.

use glam::DVec3;

use super::{parts, shapes};
use crate::scene::Scene;
use crate::units::Flux;

/// A plate of 8 m × 8 m × 0.3 m, n = 1.5, 0.4 m above the floor; a point light of 100 W at 2 m.
pub fn build() -> Scene {
    let mut scene = parts::reference_scene(1.0);
    let slab = shapes::cuboid(DVec3::new(-4.0, 0.4, -4.0), DVec3::new(4.0, 0.7, 4.0));
    parts::add(&mut scene, "slab", slab, parts::dielectric("glass", 1.5));
    scene.lights.push(parts::point_light(
        "light",
        DVec3::new(0.1, 2.0, -0.05),
        Flux(100.0),
    ));
    scene
}
