//! `ring` and `nephroid`: a mirror cylinder around the centre of the floor, lit by a lamp and by a grazing sun.

use glam::DVec3;

use super::{parts, shapes};
use crate::scene::{Mesh, Scene};
use crate::units::{Flux, Irradiance};

/// Segments around the ring: the meshing error is 0.14 % of the lit ring's map at 256².
pub const SEGMENTS: u32 = 1024;

/// Cylinder wall around the y axis, upwards from `base`, that reflects inwards and has its normals there [m].
pub fn cylinder(base: DVec3, radius: f64, height: f64) -> Mesh {
    shapes::sheet(SEGMENTS, 1, |u, v| {
        let (sine, cosine) = (std::f64::consts::TAU * u.fract()).sin_cos();
        let outward = DVec3::new(cosine, 0.0, sine);
        (base + outward * radius + DVec3::Y * (height * v), -outward)
    })
}

/// A ring of radius 1 m and height 0.5 m under a point light of 100 W.
pub fn ring() -> Scene {
    let mut scene = unlit();
    scene.lights.push(parts::point_light(
        "light",
        DVec3::new(-0.7, 1.2, 0.0),
        Flux(100.0),
    ));
    scene
}

/// The same ring under a sun of 1 W/m², 20 degrees above the horizon: the caustic of a coffee cup.
pub fn nephroid() -> Scene {
    let mut scene = unlit();
    let (sine, cosine) = 20.0_f64.to_radians().sin_cos();
    scene.lights.push(parts::sun(
        "light",
        DVec3::new(cosine, -sine, 0.0),
        Irradiance(1.0),
    ));
    scene
}

fn unlit() -> Scene {
    let mut scene = parts::reference_scene(1.0);
    parts::add(
        &mut scene,
        "ring",
        cylinder(DVec3::ZERO, 1.0, 0.5),
        parts::mirror(),
    );
    scene
}
