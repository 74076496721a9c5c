//! `spectrum`: thin beams of daylight on a prism and a ball, after the test scene of the paper's colour plates 3 and 4.
//! The prism bends its beam to the wall as a spectrum, the ball sends its own back to it as a piece of a rainbow.

use glam::DVec3;

use super::prism::{GLASS, Prism};
use super::{parts, shapes};
use crate::optics::LinearSrgb;
use crate::scene::{Light, Scene};
use crate::units::Flux;

/// Half-angle of the beams [degrees]: much less than the 2.5 over which the prism disperses white light.
const BEAM_HALF_ANGLE_DEG: f64 = 0.2;
/// z of the wall [m].
const WALL_Z: f64 = -0.6;
/// Radius of the ball [m].
const BALL_M: f64 = 0.06;
/// Gap between table and both exhibits [m]: coincident faces would have no order.
const GAP_M: f64 = 0.001;

/// A white table of 2.6 m × 1.6 m before a white wall, dimly lit from above.
pub fn build() -> Scene {
    let mut scene = Scene::default();
    let white = || parts::matte("white", LinearSrgb::grey(0.8));
    parts::add(
        &mut scene,
        "floor",
        shapes::floor([-1.3, 1.3], [WALL_Z, 1.0], 0.0),
        white(),
    );
    let wall = shapes::rectangle(DVec3::new(0.0, 0.5, WALL_Z), DVec3::X * 1.3, DVec3::Y * 0.5);
    parts::add(&mut scene, "wall", wall, white());
    let glass = parts::glass(GLASS);
    let n = glass.ior;
    let (prism, ball) = (prism(n), DVec3::new(0.25, BALL_M + GAP_M, 0.25));
    parts::add(&mut scene, "prism", prism.mesh(0.1), glass);
    let glass = scene.materials.len() - 1;
    parts::add_with(&mut scene, "ball", shapes::sphere(ball, BALL_M, 6), glass);
    scene.lights = vec![
        parts::daylight(prism_beam(&prism, n)),
        parts::daylight(rainbow_beam(ball, n)),
        parts::point_light("lamp", DVec3::new(-0.2, 0.75, 0.5), Flux(1.5)),
    ];
    scene.cameras = vec![
        parts::look("camera", [0.05, 0.5, 1.2], [0.07, 0.0, -0.2], 0.72),
        parts::look("spectrum", [0.4, 0.12, -0.2], [0.56, 0.05, WALL_Z], 0.5),
        parts::look("rainbow", [0.0, 0.12, -0.2], [0.03, 0.06, WALL_Z], 0.5),
    ];
    scene
}

/// Upright prism, oriented so that yellow light leaves it at 50 degrees to the wall's normal.
fn prism(n: f64) -> Prism {
    let turn = (0.5 * n).asin() - 30.0_f64.to_radians();
    let (sine, cosine) = (50.0_f64.to_radians() + turn).sin_cos();
    Prism {
        centroid: DVec3::new(-0.45, 0.05 + GAP_M, 0.25),
        along_base: DVec3::new(sine, 0.0, -cosine),
        to_base: DVec3::new(-cosine, 0.0, -sine),
        side_m: 0.06,
    }
}

/// Starts 30 cm before the prism, at minimum deviation.
fn prism_beam(prism: &Prism, n: f64) -> Light {
    let direction = prism.incoming(n);
    beam(
        "prism beam",
        prism.entry() - direction * 0.3,
        direction,
        Flux(0.002),
    )
}

/// Starts just before the wall, horizontally, at the offset from the ball's centre of the rainbow ray. There the
/// deviation by one internal reflection is stationary, so that a beam of some width stays one beam per colour (R.
/// Descartes, 1637). sin² of its angle of incidence is (4 − n²)/3.
fn rainbow_beam(ball: DVec3, n: f64) -> Light {
    let offset_m = BALL_M * ((4.0 - n * n) / 3.0).sqrt();
    let position = DVec3::new(ball.x + offset_m, ball.y, WALL_Z + 0.05);
    beam("ball beam", position, DVec3::Z, Flux(0.006))
}

fn beam(name: &str, position: DVec3, direction: DVec3, power: Flux) -> Light {
    parts::beam(name, position, direction, BEAM_HALF_ANGLE_DEG.to_radians(), power)
}
