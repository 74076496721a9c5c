//! The exhibits along the back wall: water in a stone basin, a prism in a beam, and a block that projects a picture.

use glam::DVec3;

use super::picture::Block;
use super::{patterns, room};
use crate::optics::LinearSrgb;
use crate::scene::builtin::pool::Basin;
use crate::scene::builtin::prism::Prism;
use crate::scene::builtin::{parts, shapes};
use crate::scene::{Light, Scene};
use crate::units::Flux;

/// Centre of the basin on the floor [m].
pub const BASIN: DVec3 = DVec3::new(-1.4, 0.0, -1.0);
/// Centre of the prism [m].
pub const PRISM: DVec3 = DVec3::new(-0.5, PEDESTAL_M + 0.5 * PRISM_LENGTH_M + GAP_M, -0.78);
/// Height of the water surface [m].
pub const WATER_M: f64 = 0.74;

const PEDESTAL_M: f64 = 1.34;
const PRISM_LENGTH_M: f64 = 0.14;
/// Dense flint: n_d = 1.785, V_d = 25.8.
const FLINT: &str = "785258";
/// Gap between an exhibit and its support [m]: coincident faces would have no order.
const GAP_M: f64 = 0.001;

pub fn add(scene: &mut Scene) {
    let stone = patterns::add(scene, "stone", 0.9, |place| {
        patterns::stone(place, DVec3::new(168.0, 160.0, 148.0))
    });
    add_basin(scene, stone);
    add_prism(scene, stone);
    add_block(scene, stone);
}

/// Adds a box for something to stand on; each face has a map of its own.
fn add_stand(scene: &mut Scene, name: &str, top: DVec3, half_m: f64, material: usize) {
    let half = DVec3::new(half_m, 0.5 * top.y, half_m);
    let middle = top - DVec3::Y * half.y;
    let (right, up, front) = (DVec3::X * half.x, DVec3::Y * half.y, DVec3::Z * half.z);
    let sides = [
        ("top", up, right, -front),
        ("front", front, right, up),
        ("back", -front, -right, up),
        ("right", right, -front, up),
        ("left", -right, front, up),
    ];
    room::add_faces(scene, (name, material), middle, &sides);
}

fn add_basin(scene: &mut Scene, stone: usize) {
    let mosaic = patterns::add(scene, "mosaic", 0.6, |place| {
        patterns::tiles(
            place,
            16,
            [DVec3::new(88.0, 142.0, 146.0), DVec3::new(150.0, 160.0, 156.0)],
        )
    });
    let basin = Basin {
        centre: BASIN,
        half_m: [0.58, 0.4],
        wall_m: 0.07,
        rim_m: 0.8,
        bottom_m: 0.46,
        water_m: WATER_M,
        waves: &[
            (0.0022, [31.0, 6.0], 1.0),
            (0.002, [-12.0, 34.0], 2.0),
            (0.0016, [24.0, 31.0], 0.0),
            (0.0013, [40.0, -23.0], 4.0),
            (0.0009, [-9.0, -58.0], 5.0),
        ],
    };
    let first = scene.objects.len();
    basin.add(scene, mosaic, stone);
    let water = scene.objects.len() - 1;
    for object in &mut scene.objects[first..water] {
        let mesh = object.mesh_in_scene_mut();
        *mesh = room::in_metres(std::mem::take(mesh));
    }
}

/// Half sides of the slit for the beam, and of the plate around it [m].
const SLIT_HALF_M: [f64; 2] = [0.0014, 0.03];
const PLATE_HALF_M: f64 = 0.05;
/// Distances from light to slit and from slit to prism [m].
const TO_SLIT_M: f64 = 0.45;
const TO_PRISM_M: f64 = 0.22;

fn prism() -> (Prism, f64) {
    let n = parts::glass(FLINT).ior;
    let (sine, cosine) = 8.0_f64.to_radians().sin_cos();
    // Upright; yellow light arrives along the back wall and is deflected towards it.
    let prism = Prism {
        centroid: PRISM,
        along_base: DVec3::new(cosine, 0.0, -sine),
        to_base: DVec3::new(-sine, 0.0, -cosine),
        side_m: 0.09,
    };
    (prism, n)
}

fn add_prism(scene: &mut Scene, stone: usize) {
    add_stand(scene, "prism pedestal", PRISM.with_y(PEDESTAL_M), 0.085, stone);
    let (prism, n) = prism();
    parts::add(scene, "prism", prism.mesh(PRISM_LENGTH_M), parts::glass(FLINT));
    let direction = prism.incoming(n);
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

/// Centre of the spectrum on the back wall [m].
pub fn spectrum() -> DVec3 {
    let (prism, n) = prism();
    let (exit, direction) = (prism.exit(), prism.outgoing(n));
    exit + direction * ((room::Z[0] - exit.z) / direction.z)
}

/// Light that reaches the slit, at minimum deviation.
pub fn prism_beam() -> Light {
    let (prism, n) = prism();
    let direction = prism.incoming(n);
    let from = prism.entry() - direction * (TO_PRISM_M + TO_SLIT_M);
    let half_angle_rad = 0.8 * PLATE_HALF_M / TO_SLIT_M;
    parts::beam("prism beam", from, direction, half_angle_rad, Flux(0.4))
}

/// Centre of the block, and position of its light [m].
const BLOCK: DVec3 = DVec3::new(1.0, 1.27, -0.8);
pub const BLOCK_LAMP: DVec3 = DVec3::new(-0.3, 1.5, 0.4);

pub fn block() -> Block {
    let forward = (BLOCK - BLOCK_LAMP).normalize();
    Block {
        centre: BLOCK,
        forward,
        side_m: 0.24,
        thickness_m: 0.025,
        from_lamp_m: BLOCK.distance(BLOCK_LAMP),
        to_picture_m: (room::Z[0] - BLOCK.z) / forward.z,
        ior: 1.49,
    }
}

/// Centre of the block's picture on the back wall [m].
pub fn picture() -> DVec3 {
    let block = block();
    block.centre + block.forward * block.to_picture_m
}

fn add_block(scene: &mut Scene, stone: usize) {
    let block = block();
    parts::add(
        scene,
        "block",
        block.mesh(),
        parts::dielectric("acrylic", block.ior),
    );
    // Blocks light that would pass beside the block.
    let black = parts::material(scene, parts::matte("black frame", LinearSrgb::grey(0.02)));
    let half_m = 0.5 * block.side_m - 0.002;
    let (centre, axes) = (block.centre - block.forward * 0.004, block.axes());
    parts::add_slit(
        scene,
        ("block frame", black),
        centre,
        axes,
        ([half_m, half_m], half_m + 0.07),
        shapes::rectangle,
    );
    let foot = block.centre + block.forward * (0.5 * block.thickness_m);
    add_stand(
        scene,
        "block pedestal",
        foot.with_y(BLOCK.y - 0.5 * block.side_m - 0.012),
        0.03,
        stone,
    );
}
