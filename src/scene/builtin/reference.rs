//! Scenes with a known caustic: mirrors and glass of simple shapes over a grey floor.

use std::f64::consts::TAU;

use glam::DVec3;

use super::{parts, shapes};
use crate::scene::{Mesh, Scene};
use crate::units::{Flux, Irradiance};

/// Segments around a ring: the meshing error is 0.14 % of the lit ring's map at 256².
const SEGMENTS: u32 = 1024;

/// Adds a point light of 100 W.
fn under_a_lamp(mut scene: Scene, position: DVec3) -> Scene {
    let lamp = parts::point_light("light", position, Flux(100.0));
    scene.lights.push(lamp);
    scene
}

/// Adds a sun of 1 W/m².
fn in_the_sun(mut scene: Scene, direction: DVec3) -> Scene {
    scene.lights.push(parts::sun("light", direction, Irradiance(1.0)));
    scene
}

/// Cylinder wall around the y axis, upwards from `base`, that reflects inwards and has its normals there [m].
pub fn cylinder(base: DVec3, radius: f64, height: f64) -> Mesh {
    shapes::sheet(SEGMENTS, 1, |u, v| {
        let (sine, cosine) = (TAU * u.fract()).sin_cos();
        let outward = DVec3::new(cosine, 0.0, sine);
        (base + outward * radius + DVec3::Y * (height * v), -outward)
    })
}

fn unlit_ring() -> Scene {
    let mut scene = parts::reference_scene(1.0);
    let ring = cylinder(DVec3::ZERO, 1.0, 0.5);
    parts::add(&mut scene, "ring", ring, parts::mirror());
    scene
}

/// `ring`: a mirror ring of radius 1 m and height 0.5 m around the centre of the floor, under a lamp.
pub fn ring() -> Scene {
    under_a_lamp(unlit_ring(), DVec3::new(-0.7, 1.2, 0.0))
}

/// `nephroid`: the same ring under a sun 20 degrees above the horizon: the caustic of a coffee cup.
pub fn nephroid() -> Scene {
    let (sine, cosine) = 20.0_f64.to_radians().sin_cos();
    in_the_sun(unlit_ring(), DVec3::new(cosine, -sine, 0.0))
}

/// `ball`: a glass ball of radius 0.5 m, n = 1.5, centred 0.8 m above the floor; a lamp on its axis at 3 m.
pub fn ball() -> Scene {
    let mut scene = parts::reference_scene(0.6);
    // 327,680 triangles: the focus magnifies the remaining meshing error, 0.5 % of its map at 256².
    let ball = shapes::sphere(DVec3::new(0.0, 0.8, 0.0), 0.5, 7);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    under_a_lamp(scene, DVec3::new(0.0, 3.0, 0.0))
}

/// `mirror`: a vertical mirror of 0.6 m × 0.5 m, rotated by 15 degrees about y, and a lamp; closed form.
pub fn mirror() -> Scene {
    let (sine, cosine) = 15.0_f64.to_radians().sin_cos();
    let half_across = DVec3::new(sine, 0.0, cosine) * 0.3;
    let mut scene = parts::reference_scene(1.0);
    let mirror = shapes::rectangle(DVec3::new(0.8, 0.45, 0.0), half_across, DVec3::Y * 0.25);
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    under_a_lamp(scene, DVec3::new(-0.1, 1.2, 0.1))
}

/// `slab`: a plate of 8 m × 8 m × 0.3 m, n = 1.5, 0.4 m above the floor, and a lamp at 2 m; closed form.
pub fn slab() -> Scene {
    let mut scene = parts::reference_scene(1.0);
    let slab = shapes::cuboid(DVec3::new(-4.0, 0.4, -4.0), DVec3::new(4.0, 0.7, 4.0));
    parts::add(&mut scene, "slab", slab, parts::dielectric("glass", 1.5));
    under_a_lamp(scene, DVec3::new(0.1, 2.0, -0.05))
}

/// Unit, from the paraboloid towards the sun.
const AXIS: DVec3 = DVec3::new(-0.8, 0.6, 0.0);
const FOCUS: DVec3 = DVec3::new(0.0, -0.5, 0.0);
const FOCAL_LENGTH_M: f64 = 0.5;
/// From the focus to the middle of the paraboloid; of any length.
const AIM: DVec3 = DVec3::new(0.3, 0.953_939_201_416_945_5, 0.0);
const RADIUS_M: f64 = 0.4;

/// `paraboloid`: an off-axis concave mirror that gathers the sun to a focus below the floor; closed form. Focal length
/// 0.5 m, circular aperture of radius 0.4 m across the beam.
pub fn paraboloid() -> Scene {
    let mut scene = parts::reference_scene(0.5);
    parts::add(&mut scene, "paraboloid", dish(), parts::mirror());
    in_the_sun(scene, -AXIS)
}

/// Points P = F + w + h·axis with w normal to the axis and |P − F| = h + 2f, hence h = w²/4f − f, as concentric circles
/// of w around the middle. The normal is along axis − w/2f, on the side of the focus.
fn dish() -> Mesh {
    let aim = AIM.normalize();
    let across_1 = DVec3::Z;
    let across_2 = AXIS.cross(across_1);
    let middle = aim * (2.0 * FOCAL_LENGTH_M / (1.0 - aim.dot(AXIS)));
    let middle_across = middle - AXIS * middle.dot(AXIS);
    shapes::sheet(512, 96, |u, v| {
        let (sine, cosine) = (TAU * u.fract()).sin_cos();
        let across = middle_across + (across_1 * cosine + across_2 * sine) * (RADIUS_M * v);
        let along = across.length_squared() / (4.0 * FOCAL_LENGTH_M) - FOCAL_LENGTH_M;
        let normal = AXIS - across / (2.0 * FOCAL_LENGTH_M);
        (FOCUS + across + AXIS * along, normal.normalize())
    })
}
