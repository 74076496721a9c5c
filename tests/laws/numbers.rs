//! Sizes, counts, densities and maps at the ends of what numbers bear.

use nephroid::illumination::accumulator::{FluxAccumulator, FluxUnit};
use nephroid::illumination::smoothing::spread;
use nephroid::settings::Sigma;

use crate::mirrors::paraboloid;
use support::laws::law::*;
use support::laws::scenes::*;
use support::laws::{Table, is_long};
use support::prelude::*;
use support::tools::{set, settings, to, transformed};

pub fn fill(t: &mut Table) {
    t.case("units-of-flux")
        .check("they keep their precision at any power", units_of_flux);
    t.case("coarse-map-on-a-finer-one")
        .check("every count is kept, and even light stays even", spread_map);
    let sized = |width, height| {
        set(to(0.01, 1), |s| {
            s.map_resolution = MapResolution::Fixed { width, height }
        })
    };
    for (name, scene) in [("mirror", before(upright())), ("ball", glass_ball(3))] {
        let scaled = t
            .case(format!("{name}-scaled-1e-4-to-1e5"))
            .bake(scene.clone(), 0.01, 32);
        for scale in [1e-4, 1e-2, 1e2, 1e5] {
            scaled
                .bake(
                    transformed(scene.clone(), DMat3::IDENTITY, scale, DVec3::ZERO),
                    0.01,
                    32,
                )
                .as_first("E goes as 1/s²", 1e-4, 1.0 / (scale * scale));
        }
        let resized = t
            .case(format!("{name}-on-maps-of-1-to-4000"))
            .bake(scene.clone(), 0.01, 32);
        for (width, height) in [(1, 1), (1, 2), (3, 1), (1, 1000), (1000, 1), (4, 4000)] {
            resized
                .bake_with(scene.clone(), sized(width, height))
                .watts_as_first("watts as of 32 × 32", 5e-3);
        }
    }
    // A small mirror, sampled as densely as the whole sky never could be.
    let half_m = 0.5 * 1e-3_f64.sqrt();
    let mirror = shapes::rectangle(DVec3::Y, DVec3::X * half_m, DVec3::Z * half_m);
    let seen_sr = solid_angle_sr(&mirror, DVec3::ZERO);
    let density_per_sr = if is_long() { 1e9 } else { 3e7 };
    t.case("a-billion-rays-per-steradian")
        .splat(room(2.5).mirror(mirror).lamp(DVec3::ZERO), density_per_sr, 16)
        .sent(seen_sr, 0.01)
        .ledger("all of it arrives", 1e-6, |energy| {
            off(energy.deposited, energy.emitted)
        });
    if is_long() {
        // All light of a focus in the finest map that 256 MB hold, the rest of which is dark.
        let little_memory = set(sized(16384, 16384), |s| s.memory_bytes = 256 << 20);
        t.case("maps-of-16384-with-one-lit-tile")
            .bake_with(paraboloid(), little_memory)
            .watts(0.64, 1e-3);
    }
    // Spreads from a millionth of a footprint to ten thousand of them.
    let of_sigma = |sigma, settings| set(settings, |s| s.sigma = Sigma::Constant(sigma));
    for sigma in [1e-6, 1.0, 1e4] {
        for settings in [settings(2e3, 32), to(0.01, 32)] {
            t.case("sigma-from-nothing-to-huge")
                .bake_with(glass_ball(3), of_sigma(sigma, settings))
                .arrives_of_sent(1.0);
        }
    }
    t.case("hardly-any-sigma")
        .bake(glass_ball(3), 0.01, 32)
        .bake_with(glass_ball(3), of_sigma(1e-6, to(0.01, 32)))
        .as_first("is hardly any blur", 0.02, 1.0);
}

fn units_of_flux() {
    for power_w in [1e-30, 1e-9, 1.0, 683.0, 1e12, 1e30] {
        let unit = FluxUnit::for_power(power_w);
        let colour = rgb(power_w, 0.5 * power_w, 1e-9 * power_w);
        let back = unit.flux_w(unit.count(colour));
        assert!(
            off(back.r, colour.r) < 1e-15 && off(back.b, colour.b) < 1e-8,
            "{power_w} W"
        );
    }
}

fn spread_map() {
    let mut coarse = FluxAccumulator::new(4, 4);
    for (index, texel) in coarse.texels_mut().iter_mut().enumerate() {
        *texel = [640_000, 1 << 58, 7 * index as i64 + 1];
    }
    let mut fine = FluxAccumulator::new(8, 8);
    spread(&coarse, &mut fine, None, 1);
    for channel in 0..3 {
        let sum = |map: &FluxAccumulator| map.texels().iter().map(|t| i128::from(t[channel])).sum::<i128>();
        assert_eq!(sum(&coarse), sum(&fine));
    }
    // An even field stays even, borders included.
    assert!(
        fine.texels().iter().all(|texel| texel[0] == 160_000),
        "{:?}",
        fine.texels()
    );
}
