//! Vessels of cut glass: bowl and tumbler; `bowl`, a cut bowl of lead glass on a white table, under one small lamp.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;

use super::{parts, shapes};
use crate::optics::LinearSrgb;
use crate::scene::{Mesh, Scene};
use crate::units::Flux;

/// Segments of the smooth inside per facet of the outside.
const FINER: u32 = 6;
/// Gap between foot and table [m]: coincident faces would have no order.
const GAP_M: f64 = 0.001;

#[derive(Clone, Copy, Debug)]
pub struct CutGlass {
    /// Corners of each ring of the cut outside.
    pub corners: u32,
    /// Radius and height above the foot of each ring of corners, from the foot to the rim [m]; every other ring is
    /// rotated by half a corner.
    pub rings_m: &'static [[f64; 2]],
    /// Inner radius at the rim [m].
    pub inside_m: f64,
    /// Depth of the inside [m].
    pub depth_m: f64,
    /// Exponent of the inner profile: 2 is half an ellipsoid, larger is closer to a cylinder.
    pub squareness: f64,
}

/// Flint glass with a third of lead.
const GLASS: &str = "F2";
const BOWL: CutGlass = CutGlass {
    corners: 14,
    rings_m: &[[0.055, 0.0], [0.1, 0.03], [0.13, 0.068], [0.14, 0.1]],
    inside_m: 0.128,
    depth_m: 0.084,
    squareness: 2.0,
};

/// The bowl, 28 cm wide and 10 cm high, and a point light of 20 W (13,660 lm) of daylight behind it.
pub fn bowl() -> Scene {
    let mut scene = Scene::default();
    let table = shapes::floor([-1.5, 1.5], [-1.5, 1.0], 0.0);
    let white = parts::matte("white", LinearSrgb::grey(0.8));
    parts::add(&mut scene, "floor", table, white);
    parts::add(&mut scene, "bowl", BOWL.mesh(), parts::glass(GLASS));
    let lamp = parts::point_light("lamp", DVec3::new(0.5, 0.62, -0.4), Flux(20.0));
    scene.lights.push(parts::daylight(lamp));
    scene.cameras = vec![
        parts::look("camera", [-0.12, 0.52, 0.58], [-0.07, 0.0, 0.02], 0.7),
        parts::look("caustic", [-0.3, 0.35, 0.45], [-0.25, 0.0, 0.18], 0.6),
    ];
    scene
}

impl CutGlass {
    /// Closed mesh: flat facets outside and below, a flat rim, a smooth inside; its foot around the origin.
    pub fn mesh(&self) -> Mesh {
        let mut mesh = Mesh::default();
        self.add_foot(&mut mesh);
        for ring in 1..self.rings_m.len() {
            self.add_band(&mut mesh, ring);
        }
        self.add_rim(&mut mesh);
        // The lower half of an ellipsoid, or of a superellipsoid, concave side up.
        let inside = shapes::sheet(self.corners * FINER, 20, |u, v| self.inside_at(u, v));
        shapes::append(&mut mesh, &inside);
        mesh
    }

    /// A corner of a ring; the first and the last are equal bit for bit.
    fn corner(&self, ring: usize, index: u32) -> DVec3 {
        let turned = if ring % 2 == 1 { 0.5 } else { 0.0 };
        let angle = TAU * (f64::from(index % self.corners) + turned) / f64::from(self.corners);
        let [radius_m, height_m] = self.rings_m[ring];
        let (sine, cosine) = angle.sin_cos();
        DVec3::new(radius_m * cosine, GAP_M + height_m, radius_m * sine)
    }

    fn add_foot(&self, mesh: &mut Mesh) {
        let middle = DVec3::Y * GAP_M;
        for index in 0..self.corners {
            shapes::append(
                mesh,
                &shapes::facet([middle, self.corner(0, index), self.corner(0, index + 1)]),
            );
        }
    }

    /// Triangles between a ring and the one below.
    fn add_band(&self, mesh: &mut Mesh, ring: usize) {
        let below = ring - 1;
        // The corner above is half a corner after the one below, or before it.
        let shift = below % 2;
        for index in 0..self.corners {
            let [low, next_low] = [self.corner(below, index), self.corner(below, index + 1)];
            let top = |step: u32| self.corner(ring, index + step + shift as u32);
            shapes::append(mesh, &shapes::facet([low, top(0), next_low]));
            // The rim has more segments: the facet below it shares their corners.
            let is_rim = ring + 1 == self.rings_m.len();
            let pieces = if is_rim { FINER } else { 1 };
            for piece in 0..pieces {
                let [from, to] = [piece, piece + 1].map(|step| between(top(0), top(1), step, pieces));
                shapes::append(mesh, &shapes::facet([next_low, from, to]));
            }
        }
    }

    /// Flat ring between the cut edge and the smooth inside.
    fn add_rim(&self, mesh: &mut Mesh) {
        let last = self.rings_m.len() - 1;
        let outer = |step: u32| {
            let (index, piece) = (step / FINER, step % FINER);
            between(
                self.corner(last, index),
                self.corner(last, index + 1),
                piece,
                FINER,
            )
        };
        let inner = |step: u32| {
            self.inside_at(f64::from(step) / f64::from(self.corners * FINER), 0.0)
                .0
        };
        for step in 0..self.corners * FINER {
            let [a, b] = [outer(step), outer(step + 1)];
            let [c, d] = [inner(step + 1), inner(step)];
            shapes::append(mesh, &shapes::facet([a, c, b]));
            shapes::append(mesh, &shapes::facet([a, d, c]));
        }
    }

    /// Position and normal of the inside: `u` around the axis, `v` from rim to bottom.
    fn inside_at(&self, u: f64, v: f64) -> (DVec3, DVec3) {
        let (sine, cosine) = (TAU * u.fract()).sin_cos();
        let (down, out) = if v == 1.0 {
            (1.0, 0.0)
        } else {
            let (sine, cosine) = (FRAC_PI_2 * v).sin_cos();
            let power = 2.0 / self.squareness;
            (sine.powf(power), cosine.powf(power))
        };
        let rim = self.rings_m[self.rings_m.len() - 1][1] + GAP_M;
        let position = DVec3::new(
            self.inside_m * out * cosine,
            rim - self.depth_m * down,
            self.inside_m * out * sine,
        );
        let steep = |part: f64| part.powf(self.squareness - 1.0);
        let (sideways, up) = (steep(out) / self.inside_m, steep(down) / self.depth_m);
        let normal = DVec3::new(-sideways * cosine, up, -sideways * sine);
        (position, normal.normalize())
    }
}

/// Interpolates from one corner to the next; both ends are exact bit for bit.
fn between(from: DVec3, to: DVec3, step: u32, steps: u32) -> DVec3 {
    match step {
        0 => from,
        _ if step == steps => to,
        _ => from + (to - from) * (f64::from(step) / f64::from(steps)),
    }
}
