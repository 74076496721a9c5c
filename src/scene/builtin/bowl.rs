//! `bowl`: a cut bowl of lead glass on a white table, under one small lamp.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;

use super::{parts, shapes};
use crate::optics::LinearSrgb;
use crate::scene::{Mesh, Scene};
use crate::units::Flux;

/// Flint glass, a third of it lead.
const GLASS: &str = "F2";
/// Corners of the cut outside, around.
const CORNERS: u32 = 14;
/// Segments of the smooth inside around for each corner.
const FINER: u32 = 6;
/// Radius and height above the foot of each ring of corners, from the foot to the rim [m]; every other ring is turned by
/// half a corner.
const RINGS_M: [[f64; 2]; 4] = [[0.055, 0.0], [0.1, 0.03], [0.13, 0.068], [0.14, 0.1]];
/// Radius of the inside at the rim [m].
const INSIDE_M: f64 = 0.128;
/// Depth of the inside [m].
const DEPTH_M: f64 = 0.084;
/// Height of the foot above the table: faces in the same place would have no order [m].
const GAP_M: f64 = 0.001;

/// The bowl, 28 cm wide and 10 cm high, and a lamp of 20 W (13,660 lm) of daylight behind it.
pub fn build() -> Scene {
    let mut scene = Scene::default();
    let table = shapes::floor([-1.5, 1.5], [-1.5, 1.0], 0.0);
    parts::add(
        &mut scene,
        "floor",
        table,
        parts::matte("white", LinearSrgb::grey(0.8)),
    );
    parts::add(&mut scene, "bowl", bowl(CORNERS), parts::glass(GLASS));
    let lamp = parts::point_light("lamp", DVec3::new(0.5, 0.62, -0.4), Flux(20.0));
    scene.lights.push(parts::daylight(lamp));
    scene.cameras = vec![
        parts::look("camera", [-0.12, 0.52, 0.58], [-0.07, 0.0, 0.02], 0.7),
        parts::look("caustic", [-0.3, 0.35, 0.45], [-0.25, 0.0, 0.18], 0.6),
    ];
    scene
}

/// Closed: flat facets outside and below, a flat rim, a smooth inside; its foot around the origin. `corners` around are cut.
pub(super) fn bowl(corners: u32) -> Mesh {
    let mut mesh = Mesh::default();
    add_foot(&mut mesh, corners);
    for ring in 1..RINGS_M.len() {
        add_band(&mut mesh, ring, corners);
    }
    add_rim(&mut mesh, corners);
    shapes::append(&mut mesh, &inside(corners));
    mesh
}

/// A corner of a ring; the first is also the last, bit for bit.
fn corner(ring: usize, index: u32, corners: u32) -> DVec3 {
    let turned = if ring % 2 == 1 { 0.5 } else { 0.0 };
    let angle = TAU * (f64::from(index % corners) + turned) / f64::from(corners);
    let [radius_m, height_m] = RINGS_M[ring];
    let (sine, cosine) = angle.sin_cos();
    DVec3::new(radius_m * cosine, GAP_M + height_m, radius_m * sine)
}

fn add_foot(mesh: &mut Mesh, corners: u32) {
    let middle = DVec3::Y * GAP_M;
    for index in 0..corners {
        shapes::append(
            mesh,
            &shapes::facet([middle, corner(0, index, corners), corner(0, index + 1, corners)]),
        );
    }
}

/// The triangles between a ring and the one below.
fn add_band(mesh: &mut Mesh, ring: usize, corners: u32) {
    let below = ring - 1;
    // The corner above lies half a corner after the one below, or before it.
    let shift = below % 2;
    for index in 0..corners {
        let [low, next_low] = [corner(below, index, corners), corner(below, index + 1, corners)];
        let top = |step: u32| corner(ring, index + step + shift as u32, corners);
        shapes::append(mesh, &shapes::facet([low, top(0), next_low]));
        // The rim is finer: the facet below it shares its corners.
        let is_rim = ring + 1 == RINGS_M.len();
        let pieces = if is_rim { FINER } else { 1 };
        for piece in 0..pieces {
            let [from, to] = [piece, piece + 1].map(|step| between(top(0), top(1), step, pieces));
            shapes::append(mesh, &shapes::facet([next_low, from, to]));
        }
    }
}

/// A point on the way from one corner to the next, at a step of so many; the corners themselves bit for bit.
fn between(from: DVec3, to: DVec3, step: u32, steps: u32) -> DVec3 {
    match step {
        0 => from,
        _ if step == steps => to,
        _ => from + (to - from) * (f64::from(step) / f64::from(steps)),
    }
}

/// The flat ring between the cut edge and the smooth inside.
fn add_rim(mesh: &mut Mesh, corners: u32) {
    let last = RINGS_M.len() - 1;
    let outer = |step: u32| {
        let (index, piece) = (step / FINER, step % FINER);
        between(
            corner(last, index, corners),
            corner(last, index + 1, corners),
            piece,
            FINER,
        )
    };
    let inner = |step: u32| inside_at(f64::from(step) / f64::from(corners * FINER), 0.0).0;
    for step in 0..corners * FINER {
        let [a, b] = [outer(step), outer(step + 1)];
        let [c, d] = [inner(step + 1), inner(step)];
        shapes::append(mesh, &shapes::facet([a, c, b]));
        shapes::append(mesh, &shapes::facet([a, d, c]));
    }
}

/// The lower half of an ellipsoid, hollow side up.
fn inside(corners: u32) -> Mesh {
    shapes::sheet(corners * FINER, 20, inside_at)
}

/// Position and normal of the inside: `u` around, `v` from the rim to the bottom.
fn inside_at(u: f64, v: f64) -> (DVec3, DVec3) {
    let (sine, cosine) = (TAU * u.fract()).sin_cos();
    let (down, out) = if v == 1.0 {
        (1.0, 0.0)
    } else {
        (FRAC_PI_2 * v).sin_cos()
    };
    let rim = RINGS_M[RINGS_M.len() - 1][1] + GAP_M;
    let position = DVec3::new(
        INSIDE_M * out * cosine,
        rim - DEPTH_M * down,
        INSIDE_M * out * sine,
    );
    let normal = DVec3::new(-out * cosine / INSIDE_M, down / DEPTH_M, -out * sine / INSIDE_M);
    (position, normal.normalize())
}
