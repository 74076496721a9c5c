//! What the room shows: a basin of water, a mirror ring in the sun, a cut bowl, a ball before a mirror, a prism in a beam.

use glam::DVec3;

use super::room;
use crate::optics::LinearSrgb;
use crate::scene::builtin::basin::Basin;
use crate::scene::builtin::pool::Wave;
use crate::scene::builtin::prism::Prism;
use crate::scene::builtin::ring::cylinder;
use crate::scene::builtin::{bowl, parts, shapes};
use crate::scene::{Light, Scene};
use crate::units::Flux;

/// Middle of the basin on the floor [m].
pub const BASIN: DVec3 = DVec3::new(-0.5, 0.0, 0.75);
/// Middle of the ring, on its table [m].
pub const RING: DVec3 = DVec3::new(2.25, TABLE_M, 0.05);
/// Middle of the bowl's foot [m].
pub const BOWL: DVec3 = DVec3::new(-2.5, SIDEBOARD_M, -1.95);
/// Middle of the ball [m].
pub const BALL: DVec3 = DVec3::new(-1.0, SIDEBOARD_M + BALL_M + GAP_M, -1.95);
/// Middle of the prism [m].
pub const PRISM: DVec3 = DVec3::new(0.9, PEDESTAL_M + 0.5 * PRISM_LENGTH_M + GAP_M, -1.7);

/// Heights of what they stand on [m].
const TABLE_M: f64 = 0.74;
const SIDEBOARD_M: f64 = 0.8;
const PEDESTAL_M: f64 = 1.05;

/// The bowl's cuts around.
const BOWL_CORNERS: u32 = 8;

const BALL_M: f64 = 0.13;
const PRISM_LENGTH_M: f64 = 0.14;
/// Dense flint: n_d = 1.785, V_d = 25.8.
const FLINT: &str = "785258";
/// Above what a thing stands on: faces in the same place would have no order [m].
const GAP_M: f64 = 0.001;

/// All of them.
pub fn add(scene: &mut Scene) {
    let white = parts::material(scene, parts::matte("white lacquer", LinearSrgb::grey(0.78)));
    add_basin(scene, white);
    add_ring(scene);
    add_sideboard(scene, white);
    add_prism(scene, white);
}

/// A box that something stands on: its top has a map of its own.
fn add_stand(scene: &mut Scene, name: &str, x: [f64; 2], z: [f64; 2], y: [f64; 2], material: usize) {
    parts::add_with(scene, &format!("{name} top"), shapes::floor(x, z, y[1]), material);
    let middle = DVec3::new(0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]), 0.5 * (z[0] + z[1]));
    let right = DVec3::X * (0.5 * (x[1] - x[0]));
    let up = DVec3::Y * (0.5 * (y[1] - y[0]));
    let front = DVec3::Z * (0.5 * (z[1] - z[0]));
    let sides = [
        ("front", front, right, up),
        ("back", -front, -right, up),
        ("right", right, -front, up),
        ("left", -right, front, up),
    ];
    for (side, offset, u, v) in sides {
        let face = shapes::rectangle(middle + offset, u, v);
        parts::add_with(scene, &format!("{name} {side}"), face, material);
    }
}

fn add_basin(scene: &mut Scene, walls: usize) {
    let tiles = parts::material(scene, parts::matte("tiles", LinearSrgb::new(0.26, 0.42, 0.46)));
    let basin = Basin {
        centre: BASIN,
        half_m: [0.65, 0.45],
        wall_m: 0.06,
        rim_m: 0.46,
        bottom_m: 0.05,
        water_m: 0.41,
        quads: [272, 200],
        waves: &[
            Wave::new(0.0075, [24.0, 5.0], 1.0),
            Wave::new(0.0065, [-8.0, 22.0], 2.0),
            Wave::new(0.004, [19.0, 21.0], 0.0),
            Wave::new(0.0025, [32.0, -23.0], 4.0),
        ],
    };
    basin.add(scene, tiles, walls);
}

fn add_ring(scene: &mut Scene) {
    let (x, z) = ([RING.x - 0.62, RING.x + 0.62], [RING.z - 0.5, RING.z + 0.5]);
    // Grey: the sun alone would leave no room for what the ring adds.
    let slate = parts::material(scene, parts::matte("slate", LinearSrgb::grey(0.2)));
    add_stand(scene, "table", x, z, [0.0, TABLE_M], slate);
    let ring = cylinder(RING + DVec3::Y * GAP_M, 0.27, 0.11);
    parts::add(scene, "ring", ring, parts::mirror());
}

/// The bowl, and the ball before a mirror that shows the light behind it.
fn add_sideboard(scene: &mut Scene, white: usize) {
    add_stand(
        scene,
        "sideboard",
        [-3.1, -0.4],
        [-2.45, -1.45],
        [0.0, SIDEBOARD_M],
        white,
    );
    let bowl = shapes::moved(bowl::bowl(BOWL_CORNERS), BOWL);
    parts::add(scene, "bowl", bowl, parts::dielectric("lead glass", 1.62));
    let ball = shapes::sphere(BALL, BALL_M, 6);
    parts::add(scene, "ball", ball, parts::dielectric("glass", 1.5));
    let mirror = shapes::rectangle(
        BALL + DVec3::new(-0.1, 0.16, -0.42),
        DVec3::X * 0.4,
        DVec3::new(0.0, 0.3, -0.05),
    );
    parts::add(scene, "standing mirror", mirror, parts::mirror());
}

/// Half the sides of the slit that the beam goes through, and of the plate around it [m].
const SLIT_HALF_M: [f64; 2] = [0.0012, 0.03];
const PLATE_HALF_M: f64 = 0.05;
/// From lamp to slit and from slit to prism [m].
const TO_SLIT_M: f64 = 0.5;
const TO_PRISM_M: f64 = 0.25;

fn prism() -> (Prism, f64) {
    let n = parts::glass(FLINT).ior;
    // Upright; yellow light comes in along the back wall and leaves towards it.
    let prism = Prism {
        centroid: PRISM,
        along_base: DVec3::new(25.0_f64.to_radians().cos(), 0.0, -25.0_f64.to_radians().sin()),
        to_base: DVec3::new(-25.0_f64.to_radians().sin(), 0.0, -25.0_f64.to_radians().cos()),
        side_m: 0.09,
    };
    (prism, n)
}

fn add_prism(scene: &mut Scene, white: usize) {
    let (x, z) = ([PRISM.x - 0.16, PRISM.x + 0.16], [PRISM.z - 0.16, PRISM.z + 0.16]);
    add_stand(scene, "pedestal", x, z, [0.0, PEDESTAL_M], white);
    let (prism, n) = prism();
    parts::add(scene, "prism", prism.mesh(PRISM_LENGTH_M), parts::glass(FLINT));
    let direction = prism.incoming(n);
    add_card(scene, &prism, n, white);
    let black = parts::material(scene, parts::matte("black plate", LinearSrgb::BLACK));
    let centre = prism.entry() - direction * TO_PRISM_M;
    let across = DVec3::Y.cross(direction);
    let half_m = (SLIT_HALF_M, PLATE_HALF_M);
    parts::add_slit(
        scene,
        ("slit", black),
        centre,
        [across, DVec3::Y],
        half_m,
        shapes::rectangle,
    );
}

/// Half the sides of the card on the back wall [m].
const CARD_HALF_M: [f64; 2] = [0.2, 0.14];

/// Where the spectrum lands.
fn card_centre(prism: &Prism, n: f64) -> DVec3 {
    let (exit, direction) = (prism.exit(), prism.outgoing(n));
    let yellow = exit + direction * ((room::Z[0] + 0.01 - exit.z) / direction.z);
    // Blue goes farther than red.
    yellow - DVec3::X * 0.06
}

/// What the spectrum is seen on.
fn add_card(scene: &mut Scene, prism: &Prism, n: f64, white: usize) {
    let [half_x, half_y] = CARD_HALF_M;
    let card = shapes::rectangle(card_centre(prism, n), DVec3::X * half_x, DVec3::Y * half_y);
    parts::add_with(scene, "spectrum card", card, white);
}

/// Middle of the spectrum [m].
pub fn spectrum() -> DVec3 {
    let (prism, n) = prism();
    card_centre(&prism, n)
}

/// The beam through the slit, at minimum deviation.
pub fn prism_beam() -> Light {
    let (prism, n) = prism();
    let direction = prism.incoming(n);
    let from = prism.entry() - direction * (TO_PRISM_M + TO_SLIT_M);
    let half_angle_rad = 0.8 * PLATE_HALF_M / TO_SLIT_M;
    parts::beam("prism beam", from, direction, half_angle_rad, Flux(0.6))
}
