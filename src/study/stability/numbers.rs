//! Sizes, distances, counts and densities at the ends of what numbers bear.

use glam::{DMat3, DVec3};

use super::laws::{deposited_w, emitted_w, maps_apart, off, same_bits, solid_angle_sr};
use super::scenes::{at, glass_ball, lamp, room, transformed, upright_mirror};
use super::{Bench, Case, Effort, Group};
use crate::error::Result;
use crate::illumination::accumulator::{FluxAccumulator, FluxUnit};
use crate::optics::LinearSrgb;
use crate::scene::Scene;
use crate::scene::builtin::{self, parts, shapes};
use crate::settings::{BakeSettings, Estimator};

/// Cases of numbers.
pub const CASES: &[Case] = &[
    Case::quick("scaled-1e-4-to-1e5", Group::Numbers, any_scale),
    Case::quick("a-billion-rays-per-steradian", Group::Numbers, dense_rays),
    Case::quick("small-deposits-in-one-texel", Group::Numbers, small_deposits),
    Case::quick("sixty-four-threads", Group::Numbers, many_threads),
];

/// Far smaller and far larger: candela fall off as 1/s², so that E does.
fn any_scale(bench: &mut Bench) -> Result<()> {
    for scene in [upright_mirror(), glass_ball(3)] {
        let one = bench.bake(&scene, &at(1e3, 32))?;
        for scale in [1e-4, 1e-2, 1e2, 1e5] {
            let scaled = transformed(scene.clone(), DMat3::IDENTITY, scale, DVec3::ZERO);
            let result = bench.bake(&scaled, &at(1e3, 32))?;
            let off = maps_apart(&result.maps, &one.maps, 1.0 / (scale * scale));
            bench.law("E goes as 1/s²", off, 1e-4);
        }
    }
    Ok(())
}

/// A small mirror, sampled as densely as the whole sky never could be.
fn dense_rays(bench: &mut Bench) -> Result<()> {
    let half_m = 0.5 * 1e-3_f64.sqrt();
    let mut scene = room(2.5);
    let mirror = shapes::rectangle(DVec3::new(0.0, 1.0, 0.0), DVec3::X * half_m, DVec3::Z * half_m);
    let seen_sr = solid_angle_sr(&mirror, DVec3::ZERO);
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    lamp(&mut scene, DVec3::ZERO);
    let density_per_sr = if bench.effort == Effort::Long { 1e9 } else { 3e7 };
    let settings = BakeSettings {
        estimator: Estimator::Splat,
        sigma: Estimator::Splat.default_sigma(),
        ..at(density_per_sr, 16)
    };
    let result = bench.bake(&scene, &settings)?;
    bench.law(
        "what is sent is I times the solid angle",
        off(emitted_w(&result), seen_sr),
        0.01,
    );
    bench.law(
        "all of it arrives",
        off(deposited_w(&result), emitted_w(&result)),
        1e-6,
    );
    Ok(())
}

/// Deposits of a hundred-millionth into a texel, by exact sums.
fn small_deposits(bench: &mut Bench) -> Result<()> {
    let count: u32 = if bench.effort == Effort::Long {
        100_000_000
    } else {
        5_000_000
    };
    let unit = FluxUnit::for_power(100.0);
    let deposit = unit.count(LinearSrgb::grey(1e-6));
    let mut accumulator = FluxAccumulator::new(1, 1);
    for _ in 0..count {
        for (sum, deposit) in accumulator.texels_mut()[0].iter_mut().zip(deposit) {
            *sum += deposit;
        }
    }
    let sum = unit.flux_w(accumulator.texels()[0]);
    bench.law(
        "the sum is that of all deposits",
        off(sum.g, 1e-6 * f64::from(count)),
        1e-9,
    );
    Ok(())
}

/// Any number of threads gives the same bits.
fn many_threads(bench: &mut Bench) -> Result<()> {
    let scenes: Vec<Scene> = ["ring", "ball"]
        .iter()
        .filter_map(|name| builtin::build(name))
        .collect();
    for scene in scenes {
        for estimator in [Estimator::Wavefront, Estimator::Splat] {
            let with = |threads| BakeSettings {
                estimator,
                sigma: estimator.default_sigma(),
                threads,
                ..at(2e3, 32)
            };
            let one = bench.bake(&scene, &with(1))?;
            let many = bench.bake(&scene, &with(64))?;
            bench.must("the same map, bit for bit", same_bits(&one, &many));
            bench.must(
                "the same ledgers and counts",
                one.ledgers == many.ledgers && one.counts == many.counts,
            );
        }
    }
    Ok(())
}
