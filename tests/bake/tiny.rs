//! Casters far smaller than a cell of the item buffer: none is missed, each deposits the light that falls on it.

use glam::DVec3;
use nephroid::light_pass::item_buffer::CELLS_PER_SIDE;
use nephroid::optics::LinearSrgb;
use nephroid::scene::Scene;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::settings::BakeSettings;
use nephroid::units::Flux;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use crate::tools::{at, bake, energy_fault};

const COUNT: usize = 1000;

/// Of them, every so many-th is baked alone: a tenth of a second each.
const EVERY: usize = 16;

/// 1 W/sr.
const POWER: Flux = Flux(4.0 * std::f64::consts::PI);

const LAMP: DVec3 = DVec3::new(0.013, -0.021, 0.034);

/// A square mirror: its middle, half-axes, and the solid angle that the lamp sees of it [sr].
#[derive(Clone, Copy)]
struct Tiny {
    centre: DVec3,
    half_u: DVec3,
    half_v: DVec3,
    seen_sr: f64,
}

/// Angle across a cell of the item buffer [rad].
fn cell_rad() -> f64 {
    let cells = 6.0 * (CELLS_PER_SIDE * CELLS_PER_SIDE) as f64;
    (4.0 * std::f64::consts::PI / cells).sqrt()
}

/// Solid angle of a triangle [sr] (van Oosterom and Strackee 1983).
fn solid_angle_sr([a, b, c]: [DVec3; 3]) -> f64 {
    let [la, lb, lc] = [a, b, c].map(DVec3::length);
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * a.dot(b.cross(c)).atan2(below).abs()
}

/// Somewhere around the lamp at 1 m, its width between two shares of a cell, tilted by up to 60 degrees.
fn tiny(random: &mut impl FnMut() -> f64, (least, most): (f64, f64)) -> Tiny {
    let z = 2.0 * random() - 1.0;
    let (sine, cosine) = (std::f64::consts::TAU * random()).sin_cos();
    let towards = DVec3::new((1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, z);
    let half_m = 0.5 * cell_rad() * least * (most / least).powf(random());
    let (x, y) = towards.any_orthonormal_pair();
    let (s, c) = (std::f64::consts::TAU * random()).sin_cos();
    let (ts, tc) = (random() * 60.0_f64.to_radians()).sin_cos();
    let across = x * c + y * s;
    let along = y * c - x * s;
    let (half_u, half_v) = (across * half_m, (along * tc + towards * ts) * half_m);
    let corners =
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(u, v)| towards + half_u * u + half_v * v);
    let [a, b, c, d] = corners;
    Tiny {
        centre: LAMP + towards,
        half_u,
        half_v,
        seen_sr: solid_angle_sr([a, b, c]) + solid_angle_sr([a, c, d]),
    }
}

/// Mirrors around a lamp in a closed room.
fn scene_of(mirrors: &[Tiny]) -> Scene {
    let mut scene = parts::reference_scene(3.0);
    let walls = shapes::cuboid(DVec3::splat(-2.5), DVec3::splat(2.5));
    let last = scene.objects.len() - 1;
    scene.objects[last].mesh = std::sync::Arc::new(walls);
    for (index, mirror) in mirrors.iter().enumerate() {
        let mesh = shapes::rectangle(mirror.centre, mirror.half_u, mirror.half_v);
        let white = nephroid::scene::Material {
            base_colour: LinearSrgb::WHITE,
            ..parts::mirror()
        };
        parts::add(&mut scene, &format!("mirror {index}"), mesh, white);
    }
    scene.lights.push(parts::point_light("lamp", LAMP, POWER));
    scene
}

fn deposited_w(mirrors: &[Tiny], density_per_sr: f64) -> f64 {
    flux_w(scene_of(mirrors), &at(density_per_sr, 16))
}

fn flux_w(scene: Scene, settings: &BakeSettings) -> f64 {
    let result = bake(scene, settings);
    assert_eq!(energy_fault(&result), None);
    result
        .ledgers
        .iter()
        .map(|ledger| ledger.energy_w.deposited)
        .sum()
}

fn generator(seed: u64) -> impl FnMut() -> f64 {
    let mut generator = Pcg64Mcg::seed_from_u64(seed);
    move || (generator.next_u64() >> 11) as f64 * (-53_f64).exp2()
}

#[test]
fn tiny_mirrors_deposit_what_falls_on_them_one_by_one() {
    let mut random = generator(11);
    let mirrors: Vec<Tiny> = (0..COUNT).map(|_| tiny(&mut random, (0.01, 1.0))).collect();
    let faults: Vec<(usize, f64, f64)> = mirrors
        .iter()
        .enumerate()
        .step_by(EVERY)
        .map(|(index, mirror)| {
            let ratio = deposited_w(&[*mirror], 25_000.0) / mirror.seen_sr;
            (index, ratio, mirror.seen_sr)
        })
        .collect();
    let worst = faults
        .iter()
        .map(|(_, ratio, _)| (ratio - 1.0).abs())
        .fold(0.0, f64::max);
    println!("{} mirrors, one by one: off by {worst:.4} at worst", faults.len());
    let wrong: Vec<_> = faults
        .iter()
        .filter(|(_, ratio, _)| (ratio - 1.0).abs() >= 0.05)
        .collect();
    assert!(wrong.is_empty(), "{wrong:?}");
    // And as they are in a bake of sixteen times the rays.
    for mirror in mirrors.iter().step_by(250) {
        let (usual, fine) = (
            deposited_w(&[*mirror], 25_000.0),
            deposited_w(&[*mirror], 400_000.0),
        );
        assert!((usual / fine - 1.0).abs() < 0.05, "{usual} W, {fine} W");
    }
}

#[test]
fn a_thousand_tiny_mirrors_in_one_room_deposit_what_falls_on_them() {
    for (seed, sizes) in [
        (1, (0.01, 0.03)),
        (2, (0.03, 0.1)),
        (3, (0.1, 0.3)),
        (4, (0.3, 1.0)),
    ] {
        let mut random = generator(seed);
        let mirrors: Vec<Tiny> = (0..COUNT).map(|_| tiny(&mut random, sizes)).collect();
        let seen_sr: f64 = mirrors.iter().map(|mirror| mirror.seen_sr).sum();
        let ratio = deposited_w(&mirrors, 25_000.0) / seen_sr;
        println!("{COUNT} mirrors of {sizes:?} cells in one room: {ratio:.4} of what falls on them");
        assert!((ratio - 1.0).abs() < 0.05, "{sizes:?}: {ratio}");
    }
}
