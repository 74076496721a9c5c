//! `mirror`: a plane mirror and a lamp; its caustic has a closed form.

use glam::DVec3;

use super::{parts, shapes};
use crate::scene::Scene;
use crate::units::Flux;

/// A vertical mirror of 0.6 m × 0.5 m, rotated by 15 degrees about y; a point light of 100 W.
pub fn build() -> Scene {
    let (sine, cosine) = 15.0_f64.to_radians().sin_cos();
    let half_across = DVec3::new(sine, 0.0, cosine) * 0.3;
    let mut scene = parts::reference_scene(1.0);
    let mirror = shapes::rectangle(DVec3::new(0.8, 0.45, 0.0), half_across, DVec3::Y * 0.25);
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    scene.lights.push(parts::point_light(
        "light",
        DVec3::new(-0.1, 1.2, 0.1),
        Flux(100.0),
    ));
    scene
}
