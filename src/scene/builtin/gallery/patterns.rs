//! The gallery's procedural textures: noise-based, deterministic, and periodic where they tile.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

use crate::optics::LinearSrgb;
use crate::scene::builtin::parts;
use crate::scene::texture::Wrap;
use crate::scene::{Scene, Texture, TextureRef};

/// Texels per side.
const SIDE: u32 = 512;

/// An sRGB-encoded colour [0, 255].
type Code = DVec3;

/// Adds a diffuse material with an image that covers `size_m` [m] and repeats; `colour` returns the sRGB code at a
/// point of the unit square.
pub fn add(scene: &mut Scene, name: &str, size_m: f64, colour: impl Fn(DVec2) -> Code + Sync) -> usize {
    let texel = |index: u32| {
        let place = DVec2::new(f64::from(index % SIDE) + 0.5, f64::from(index / SIDE) + 0.5);
        let [r, g, b] = colour(place / f64::from(SIDE)).to_array().map(|code| code as u8);
        [r, g, b, u8::MAX]
    };
    scene.textures.push(Arc::new(Texture {
        name: name.into(),
        width: SIDE,
        height: SIDE,
        rgba: (0..SIDE * SIDE).into_par_iter().map(texel).collect(),
        wrap: [Wrap::Repeat; 2],
        is_nearest: false,
    }));
    let mut material = parts::matte(name, LinearSrgb::WHITE);
    material.base_colour_texture = Some(TextureRef {
        texture: scene.textures.len() - 1,
        uv_set: 0,
        uv_transform: DMat3::from_scale(DVec2::splat(1.0 / size_m)),
    });
    parts::material(scene, material)
}

/// Hash of a lattice point, uniform in [0, 1].
fn hash(x: i32, y: i32, seed: u32) -> f64 {
    let mut bits = (x as u32).wrapping_mul(0x9e37_79b1) ^ (y as u32).wrapping_mul(0x85eb_ca77) ^ seed;
    for factor in [0x7feb_352d_u32, 0x846c_a68b] {
        bits = (bits ^ (bits >> 16)).wrapping_mul(factor);
    }
    f64::from(bits ^ (bits >> 16)) / f64::from(u32::MAX)
}

/// Smooth noise in [0, 1], with period 1 and `cells` lattice cells per period across and down.
fn noise(place: DVec2, cells: [i32; 2], seed: u32) -> f64 {
    let at = place * DVec2::new(f64::from(cells[0]), f64::from(cells[1]));
    let (low, part) = (at.floor(), at - at.floor());
    let ease = part * part * (DVec2::splat(3.0) - 2.0 * part);
    let corner = |dx: i32, dy: i32| {
        let (x, y) = (low.x as i32 + dx, low.y as i32 + dy);
        hash(x.rem_euclid(cells[0]), y.rem_euclid(cells[1]), seed)
    };
    let row = |dy: i32| corner(0, dy) + (corner(1, dy) - corner(0, dy)) * ease.x;
    row(0) + (row(1) - row(0)) * ease.y
}

/// Sum of several octaves of noise, the coarsest with `cells`.
fn turbulence(place: DVec2, cells: [i32; 2], octaves: u32, seed: u32) -> f64 {
    let octave = |index: u32| {
        noise(place, cells.map(|count| count << index), seed + index) * 0.5_f64.powi(index as i32)
    };
    (0..octaves).map(octave).sum::<f64>() / (2.0 - 0.5_f64.powi(octaves as i32 - 1))
}

/// 1 within `half` of an integer and 0 beyond, with an edge of width `soft`.
fn line(value: f64, half: f64, soft: f64) -> f64 {
    let off = (value - value.round()).abs();
    ((half - off) / soft + 0.5).clamp(0.0, 1.0)
}

/// Wooden boards along u, with grain and pores.
pub fn wood(place: DVec2, boards: i32, [dark, light]: [Code; 2]) -> Code {
    let board = (place.y * f64::from(boards)).floor();
    let seed = 1000 + board as u32 * 17;
    let waver = turbulence(place, [2, 8], 3, seed);
    let rings = 0.5 + 0.5 * (TAU * (9.0 * waver + 5.0 * place.y * f64::from(boards))).sin();
    let fibre = turbulence(place, [6, 256], 2, seed + 5);
    let pores = noise(place, [24, 256], seed + 9).powi(6);
    let tone = 0.2 * rings.powi(2) + 0.6 * fibre + 0.24 * hash(board as i32, 3, 7) - 0.35 * pores;
    let gap = line(place.y * f64::from(boards), 0.006, 0.012);
    (dark + (light - dark) * tone.clamp(0.0, 1.0)) * (1.0 - 0.75 * gap)
}

/// Trowelled plaster of a mean colour.
pub fn plaster(place: DVec2, mean: Code) -> Code {
    let clouds = turbulence(place, [3, 3], 5, 11) - 0.5;
    let strokes = turbulence(place, [24, 8], 3, 23) - 0.5;
    mean * (1.0 + 0.06 * clouds + 0.07 * strokes)
}

/// Stone with grain and a few veins.
pub fn stone(place: DVec2, mean: Code) -> Code {
    let clouds = turbulence(place, [3, 4], 5, 31);
    let vein = line(3.0 * clouds + place.x, 0.012, 0.05);
    let grain = noise(place, [170, 170], 37) - 0.5;
    mean * (0.84 + 0.34 * clouds + 0.16 * grain - 0.14 * vein)
}

/// Square tiles of varying tone between joints.
pub fn tiles(place: DVec2, across: i32, [tile, joint]: [Code; 2]) -> Code {
    let at = place * f64::from(across);
    let tone =
        0.86 + 0.28 * hash(at.x as i32, at.y as i32, 41) + 0.1 * (turbulence(place, [8, 8], 4, 43) - 0.5);
    let between = line(at.x, 0.02, 0.02).max(line(at.y, 0.02, 0.02));
    (tile * tone).lerp(joint, between)
}
