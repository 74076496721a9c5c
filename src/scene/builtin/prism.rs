//! `prism`: a glass prism at minimum deviation behind a slit. The position of each wavelength on the screen has a
//! closed form.
//!
//! `spectrum`: thin beams of daylight on a prism and a ball, after the test scene of the paper's colour plates 3 and 4.
//! The prism bends its beam to the wall as a spectrum, the ball sends its own back to it as a piece of a rainbow.

use glam::DVec3;

use super::{parts, shapes};
use crate::optics::LinearSrgb;
use crate::scene::{Light, Scene};
use crate::units::{Flux, Irradiance};

/// Silicate flint glass: n_d = 1.635, V_d = 57.7.
pub const GLASS: &str = "635577";

/// An equilateral prism, by its cross-section.
#[derive(Clone, Copy, Debug)]
pub struct Prism {
    /// Centroid of the cross-section [m].
    pub centroid: DVec3,
    /// Unit, direction of light inside it at minimum deviation: along the base.
    pub along_base: DVec3,
    /// Unit, from the apex to the base: the direction towards which light is deflected.
    pub to_base: DVec3,
    /// Side of the cross-section [m].
    pub side_m: f64,
}

impl Prism {
    /// Point where light enters at minimum deviation: the middle of the first face [m].
    pub fn entry(&self) -> DVec3 {
        let apothem_m = self.side_m / 12.0_f64.sqrt();
        self.centroid - self.along_base * (0.25 * self.side_m) - self.to_base * (0.5 * apothem_m)
    }

    /// Direction of incoming light at minimum deviation for an index `n`: inside it runs along the base, at 30 degrees
    /// to the normals of both faces.
    pub fn incoming(&self, n: f64) -> DVec3 {
        let turn_rad = (0.5 * n).asin() - 30.0_f64.to_radians();
        self.along_base * turn_rad.cos() - self.to_base * turn_rad.sin()
    }

    /// Point where this light leaves: the middle of the second face [m].
    pub fn exit(&self) -> DVec3 {
        self.entry() + self.along_base * (0.5 * self.side_m)
    }

    /// Direction in which it leaves, unit.
    pub fn outgoing(&self, n: f64) -> DVec3 {
        let incoming = self.incoming(n);
        incoming - self.to_base * (2.0 * incoming.dot(self.to_base))
    }

    /// Closed mesh of the prism with a length [m].
    pub fn mesh(&self, length_m: f64) -> crate::scene::Mesh {
        let edge = self.to_base.cross(self.along_base) * length_m;
        let apothem_m = self.side_m / 12.0_f64.sqrt();
        let end = self.centroid - edge * 0.5;
        let base = end + self.to_base * apothem_m;
        let half_base = self.along_base * (0.5 * self.side_m);
        let apex = end - self.to_base * (2.0 * apothem_m);
        shapes::prism([base - half_base, base + half_base, apex], edge)
    }
}

/// Half sides of the slit, across and along the prism's edges [m].
const SLIT_HALF_M: [f64; 2] = [0.0005, 0.01];
/// Distance from the slit to the prism along the beam [m].
const SLIT_DISTANCE_M: f64 = 0.3;
/// Half side of the black plate with the slit [m].
const PLATE_HALF_M: f64 = 0.5;

/// A prism of 6 cm length along z, apex up; a sun of 1 W/m² through a slit of 1 mm × 20 mm; a wall of 1.4 m × 1.4 m.
pub fn build() -> Scene {
    let prism = Prism {
        centroid: DVec3::Y,
        along_base: DVec3::X,
        to_base: DVec3::NEG_Y,
        side_m: 0.06,
    };
    let glass = parts::glass(GLASS);
    let direction = prism.incoming(glass.ior);
    let mut scene = Scene::default();
    let wall = shapes::rectangle(DVec3::new(1.5, 0.5, 0.0), DVec3::Z * 0.7, DVec3::Y * 0.7);
    let grey = parts::matte("wall", LinearSrgb::grey(0.5));
    parts::add(&mut scene, "wall", wall, grey);
    parts::add(&mut scene, "prism", prism.mesh(0.06), glass);
    add_slit(&mut scene, prism.entry() - direction * SLIT_DISTANCE_M, direction);
    scene.lights.push(parts::sun("light", direction, Irradiance(1.0)));
    scene.cameras = vec![
        parts::look("camera", [0.2, 1.0, 1.8], [0.6, 0.7, 0.0], 0.9),
        parts::look("spectrum", [1.2, 0.4, 0.2], [1.5, 0.3, 0.0], 0.6),
    ];
    scene
}

/// Adds four black plates around a slit across the light, with its long side along z.
fn add_slit(scene: &mut Scene, centre: DVec3, direction: DVec3) {
    let material = parts::material(scene, parts::matte("plate", LinearSrgb::BLACK));
    let across = DVec3::Z.cross(direction);
    let half_m = (SLIT_HALF_M, PLATE_HALF_M);
    parts::add_slit(
        scene,
        ("plate", material),
        centre,
        [across, DVec3::Z],
        half_m,
        |middle, u, v| shapes::rectangle(middle, v, u),
    );
}

/// Half-angle of the beams [degrees]: much less than the 2.5 over which the prism disperses white light.
const BEAM_HALF_ANGLE_DEG: f64 = 0.2;
/// z of the wall [m].
const WALL_Z: f64 = -0.6;
/// Radius of the ball [m].
const BALL_M: f64 = 0.06;
/// Gap between table and both exhibits [m]: coincident faces would have no order.
const GAP_M: f64 = 0.001;

/// A white table of 2.6 m × 1.6 m before a white wall, dimly lit from above.
pub fn spectrum() -> Scene {
    let mut scene = Scene::default();
    let white = || parts::matte("white", LinearSrgb::grey(0.8));
    let floor = shapes::floor([-1.3, 1.3], [WALL_Z, 1.0], 0.0);
    parts::add(&mut scene, "floor", floor, white());
    let wall = shapes::rectangle(DVec3::new(0.0, 0.5, WALL_Z), DVec3::X * 1.3, DVec3::Y * 0.5);
    parts::add(&mut scene, "wall", wall, white());
    let glass = parts::glass(GLASS);
    let n = glass.ior;
    let (prism, ball) = (upright_prism(n), DVec3::new(0.25, BALL_M + GAP_M, 0.25));
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
fn upright_prism(n: f64) -> Prism {
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
    let position = prism.entry() - direction * 0.3;
    beam("prism beam", position, direction, Flux(0.002))
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
