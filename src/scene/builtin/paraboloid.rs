//! `paraboloid`: an off-axis concave mirror that gathers the sun to a focus below the floor; closed form.

use glam::DVec3;

use super::{parts, shapes};
use crate::scene::{Mesh, Scene};
use crate::units::Irradiance;

/// Unit, from the mirror towards the sun.
const AXIS: DVec3 = DVec3::new(-0.8, 0.6, 0.0);
const FOCUS: DVec3 = DVec3::new(0.0, -0.5, 0.0);
const FOCAL_LENGTH_M: f64 = 0.5;
/// From the focus to the middle of the mirror; of any length.
const AIM: DVec3 = DVec3::new(0.3, 0.953_939_201_416_945_5, 0.0);
const RADIUS_M: f64 = 0.4;

/// Focal length 0.5 m, circular aperture of radius 0.4 m across the beam; a sun of 1 W/m² shines along its axis.
pub fn build() -> Scene {
    let mut scene = parts::reference_scene(0.5);
    parts::add(&mut scene, "paraboloid", dish(), parts::mirror());
    scene.lights.push(parts::sun("light", -AXIS, Irradiance(1.0)));
    scene
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
        let (sine, cosine) = (std::f64::consts::TAU * u.fract()).sin_cos();
        let across = middle_across + (across_1 * cosine + across_2 * sine) * (RADIUS_M * v);
        let along = across.length_squared() / (4.0 * FOCAL_LENGTH_M) - FOCAL_LENGTH_M;
        let normal = AXIS - across / (2.0 * FOCAL_LENGTH_M);
        (FOCUS + across + AXIS * along, normal.normalize())
    })
}
