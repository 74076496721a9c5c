//! Glassware turned on a lathe: the goblet and its wine.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::scene::Mesh;
use crate::scene::builtin::shapes;

/// Surface of revolution about the y axis through points (radius, height) [m] of its outline, smooth except where one
/// curve ends and the next begins. With the axis to the left, the interior lies to the left of the outline's direction.
/// The mesh has `around` segments, and `rows` rows between two points.
pub fn turned(curves: &[&[[f64; 2]]], [around, rows]: [u32; 2]) -> Mesh {
    let mut mesh = Mesh::default();
    for curve in curves {
        let points: Vec<DVec2> = curve.iter().map(|point| DVec2::from_array(*point)).collect();
        let pieces = points.len() as u32 - 1;
        let part = shapes::sheet(around, pieces * rows, |u, v| {
            let along = v * f64::from(pieces);
            let piece = (along as usize).min(points.len() - 2);
            let (at, slope) = between(&points, piece, along - piece as f64);
            let (sine, cosine) = (TAU * u.fract()).sin_cos();
            let around = |radius: f64, height: f64| DVec3::new(radius * cosine, height, radius * sine);
            (around(at.x, at.y), around(slope.y, -slope.x).normalize())
        });
        shapes::append(&mut mesh, &part);
    }
    mesh
}

/// Position and derivative of a curve through `points`, at `part` of the way from one to the next: cubic, with the
/// slopes of parabolas through three neighbours. It meets the axis at a right angle.
fn between(points: &[DVec2], piece: usize, part: f64) -> (DVec2, DVec2) {
    let mirrored = |point: DVec2| DVec2::new(-point.x, point.y);
    let end = points.len() - 1;
    let slope = |index: usize| {
        let (here, is_on_axis) = (points[index], points[index].x == 0.0);
        let before = index.checked_sub(1).map(|index| points[index]);
        let after = points.get(index + 1).copied();
        let before = before.or(after.filter(|_| is_on_axis).map(mirrored));
        let after = after.or(before.filter(|_| is_on_axis).map(mirrored));
        match (before, after) {
            (Some(before), Some(after)) => {
                let (d0, d1) = ((here - before).length(), (after - here).length());
                ((here - before) * (d1 / d0) + (after - here) * (d0 / d1)) / (d0 + d1)
            }
            (Some(before), None) => (here - before).normalize(),
            (None, Some(after)) => (after - here).normalize(),
            (None, None) => DVec2::X,
        }
    };
    let (from, to) = (points[piece], points[(piece + 1).min(end)]);
    let length = (to - from).length();
    let (m0, m1) = (slope(piece) * length, slope((piece + 1).min(end)) * length);
    let (t, t2, t3) = (part, part * part, part * part * part);
    let at = from * (2.0 * t3 - 3.0 * t2 + 1.0)
        + m0 * (t3 - 2.0 * t2 + t)
        + to * (3.0 * t2 - 2.0 * t3)
        + m1 * (t3 - t2);
    let derivative =
        (from - to) * (6.0 * t2 - 6.0 * t) + m0 * (3.0 * t2 - 4.0 * t + 1.0) + m1 * (3.0 * t2 - 2.0 * t);
    (at, derivative)
}

/// Outline of the glass, 18 cm high, with a stem so short that the sun is focused on the table.
pub const WINE_GLASS_M: [[f64; 2]; 29] = [
    [0.0, 0.002],
    [0.02, 0.002],
    [0.036, 0.001],
    [0.0405, 0.0012],
    [0.0418, 0.0017],
    [0.0422, 0.0025],
    [0.0418, 0.0033],
    [0.0405, 0.0039],
    [0.02, 0.0085],
    [0.0085, 0.0155],
    [0.0062, 0.024],
    [0.014, 0.0365],
    [0.0335, 0.055],
    [0.048, 0.082],
    [0.051, 0.109],
    [0.0475, 0.142],
    [0.0415, 0.1805],
    [0.0412, 0.1815],
    [0.0405, 0.182],
    [0.0398, 0.1815],
    [0.0395, 0.1805],
    [0.0455, 0.142],
    [0.0489, 0.109],
    [0.0459, 0.0825],
    [0.032, 0.0578],
    [0.016, 0.0452],
    [0.0105, 0.0432],
    [0.005, 0.0423],
    [0.0, 0.042],
];

/// Outline of its wine: the side lies within the glass, so that there is no air between them.
pub const WINE_M: [&[[f64; 2]]; 2] = [
    &[
        [0.0, 0.0412],
        [0.005, 0.0415],
        [0.0105, 0.0424],
        [0.016, 0.0442],
        [0.0328, 0.0565],
        [0.047, 0.0823],
        [0.0494, 0.099],
    ],
    &[[0.0494, 0.099], [0.0, 0.099]],
];
