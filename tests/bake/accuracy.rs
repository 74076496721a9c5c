//! Errors without a reference against errors against one: a bake of the same mesh with many times the rays.

use glam::{DQuat, DVec3};
use nephroid::illumination::{IlluminationMap, Layer};
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Material, Mesh, Scene};
use nephroid::session::{BakeResult, StopReason};
use nephroid::settings::{BakeSettings, LayerKind, RayPlacement};
use nephroid::units::{Flux, Irradiance};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use crate::tools::{at, bake, builtin_scene};

/// Side of all maps [texels].
const SIDE: usize = 128;

fn exactly(density_per_sr: f64) -> BakeSettings {
    at(density_per_sr, SIDE)
}

fn towards(target: f64) -> BakeSettings {
    BakeSettings {
        max_error: Some(target),
        ..exactly(BakeSettings::starting_density_per_sr(target))
    }
}

fn luminance(map: &IlluminationMap) -> impl Iterator<Item = f64> {
    let layer: Option<&Layer> = map.layer(LayerKind::Caustic);
    let texels = layer.map_or(&[][..], |layer| &layer.irradiance);
    texels
        .iter()
        .map(|texel| LinearSrgb::from(texel.map(f64::from)).luminance())
}

/// Relative RMSE against a finer bake, over all maps by area; maps that only one of both has count as black in the
/// other.
fn true_error(result: &BakeResult, truth: &BakeResult) -> f64 {
    let (mut squares, mut flux_w, mut area_m2) = (0.0, 0.0, 0.0);
    for map in &truth.maps {
        let found = result
            .maps
            .iter()
            .find(|found| found.chart.receiver == map.chart.receiver);
        let values: Vec<f64> = match found {
            Some(found) => luminance(found).collect(),
            None => vec![0.0; map.width() * map.height()],
        };
        for (texel, (wanted, value)) in luminance(map).zip(values).enumerate() {
            let texel_m2 = map.chart.texel_area_m2(texel);
            squares += (value - wanted) * (value - wanted) * texel_m2;
            flux_w += wanted * texel_m2;
            area_m2 += texel_m2;
        }
    }
    (squares * area_m2).sqrt() / flux_w
}

/// The reference scenes with the density at which they have converged [rays/sr].
const CONVERGED: [(&str, f64); 7] = [
    ("ring", 2e5),
    ("ball", 4e5),
    ("pool", 2e5),
    ("mirror", 4e5),
    ("slab", 1e5),
    ("paraboloid", 2e5),
    ("nephroid", 4e5),
];

#[test]
fn estimates_of_the_reference_scenes_are_within_a_factor_of_two() {
    let (mut faults, mut too_careful) = (Vec::new(), 0);
    for (name, converged_per_sr) in CONVERGED {
        let truth = bake(builtin_scene(name), &exactly(converged_per_sr));
        for target in [0.05, 0.02, 0.01] {
            let result = bake(builtin_scene(name), &towards(target));
            let estimate = result.estimated_relative_rmse.expect("an estimate");
            let error = true_error(&result, &truth);
            println!(
                "{name:8} {target:.2}: true {error:.4}, estimated {estimate:.4}, ratio {:.2}, {} rays",
                error / estimate,
                result.counts.rays
            );
            assert_eq!(result.stop_reason, StopReason::MaxError, "{name}, {target}");
            assert!(estimate <= target, "{name}: {estimate} for {target}");
            let ratio = error / estimate;
            // No estimate may be less than half of the error. One is known to be more than twice as large: the square
            // mirror's straight edges come right within its last level.
            too_careful += usize::from(ratio < 0.5);
            if !(0.4..=2.0).contains(&ratio) || (target == 0.02 && error > 0.03) {
                faults.push(format!("{name}, {target}: true {error}, estimated {estimate}"));
            }
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
    assert!(
        too_careful <= 1,
        "{too_careful} estimates are more than twice the error"
    );
}

/// Texels say how far off each of them is expected to be: of those that are not dark 95 in 100 are within 7 times that, 99
/// in 100 within 18 times. It is no bound: where light folds, levels miss the same.
#[test]
fn single_texels_are_off_by_what_they_say() {
    let side = 64;
    let mut faults = Vec::new();
    for (name, converged_per_sr) in CONVERGED.into_iter().take(4) {
        let truth = bake(builtin_scene(name), &at(converged_per_sr, side));
        // The ball's dimmest texels are off by more than they say as long as all are off by 4 % of the mean.
        let densities: &[f64] = if name == "ball" { &[2e4] } else { &[5e3, 2e4] };
        for &density_per_sr in densities {
            let result = bake(builtin_scene(name), &at(density_per_sr, side));
            let mut off: Vec<f64> = Vec::new();
            for wanted in &truth.maps {
                let found = result
                    .maps
                    .iter()
                    .find(|found| found.chart.receiver == wanted.chart.receiver);
                let Some(found) = found else { continue };
                let count = (wanted.width() * wanted.height()) as f64;
                let mean = luminance(wanted).sum::<f64>() / count;
                let said = found.error.iter().flatten().map(|error| f64::from(*error));
                for ((value, error), wanted) in luminance(found).zip(said).zip(luminance(wanted)) {
                    if wanted > 0.01 * mean {
                        off.push((value - wanted).abs() / error.max(1e-6 * mean));
                    }
                }
            }
            off.sort_by(f64::total_cmp);
            let [half, most, nearly_all] =
                [0.5, 0.95, 0.99].map(|share| off[(share * (off.len() - 1) as f64) as usize]);
            println!("{name:10} {density_per_sr:6}: 50 % {half:.2}, 95 % {most:.2}, 99 % {nearly_all:.2}");
            if !(most <= 7.0 && nearly_all <= 18.0) {
                faults.push(format!("{name} at {density_per_sr}: {most}, {nearly_all}"));
            }
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

/// One of many scenes: a floor, something specular over it, a lamp.
fn random_scene(seed: u64) -> Scene {
    let mut random = Pcg64Mcg::seed_from_u64(0x5eed ^ seed << 8);
    let mut unit = || (random.next_u64() >> 11) as f64 * (-53_f64).exp2();
    let mut scene = parts::reference_scene(1.0);
    let mut around = |low: f64, high: f64| low + (high - low) * unit();
    let centre = DVec3::new(around(-0.4, 0.4), around(0.35, 0.8), around(-0.4, 0.4));
    let size = around(0.12, 0.3);
    let turn = DQuat::from_rotation_y(around(0.0, 6.0)) * DQuat::from_rotation_x(around(0.9, 1.6));
    let glass = |unit: f64| parts::dielectric("glass", 1.3 + 0.5 * unit);
    let kind = (around(0.0, 6.0)) as u32;
    let (mesh, material): (Mesh, Material) = match kind {
        0 => (shapes::sphere(centre, size, 4), glass(around(0.0, 1.0))),
        1 => (shapes::sphere(centre, size, 4), parts::mirror()),
        2 => (panel(centre, turn, size), parts::mirror()),
        3 => (torus(centre, turn, size), glass(around(0.0, 1.0))),
        4 => (bowl(centre, turn, size), parts::mirror()),
        _ => {
            let half = DVec3::new(size, 0.4 * size, 0.7 * size);
            (
                shapes::cuboid(centre - half, centre + half),
                glass(around(0.0, 1.0)),
            )
        }
    };
    parts::add(&mut scene, "caster", mesh, material);
    let from = DVec3::new(around(-0.9, 0.9), around(1.6, 2.6), around(-0.9, 0.9));
    scene.lights.push(if around(0.0, 1.0) < 0.7 {
        parts::point_light("lamp", from, Flux(10.0))
    } else {
        parts::sun("sun", -from, Irradiance(1.0))
    });
    scene.name = format!("random {seed}, kind {kind}");
    scene
}

fn panel(centre: DVec3, turn: DQuat, half: f64) -> Mesh {
    shapes::rectangle(centre, turn * DVec3::X * half, turn * DVec3::Z * half)
}

fn torus(centre: DVec3, turn: DQuat, size: f64) -> Mesh {
    shapes::sheet(96, 48, |u, v| {
        let ((sine_u, cosine_u), (sine_v, cosine_v)) = (turned(u), turned(v));
        let outward = DVec3::new(cosine_u, 0.0, sine_u);
        let normal = outward * cosine_v + DVec3::Y * sine_v;
        (
            centre + turn * (outward + normal * 0.4) * (0.7 * size),
            turn * normal,
        )
    })
}

/// A half of a hollow sphere, open upwards before it is turned.
fn bowl(centre: DVec3, turn: DQuat, radius: f64) -> Mesh {
    shapes::sheet(96, 32, |u, v| {
        let (sine, cosine) = turned(u);
        let (down, out) = f64::sin_cos((0.02 + 0.98 * v) * std::f64::consts::FRAC_PI_2);
        let outward = DVec3::new(cosine * down, -out, sine * down);
        (centre + turn * outward * radius, turn * -outward)
    })
}

/// Sine and cosine of so many turns.
fn turned(turns: f64) -> (f64, f64) {
    (std::f64::consts::TAU * turns.fract()).sin_cos()
}

#[test]
fn estimates_of_random_scenes_are_within_a_factor_of_two() {
    let (mut ratios, mut faults) = (Vec::new(), Vec::new());
    for seed in 0..50 {
        let scene = random_scene(seed);
        let result = bake(scene.clone(), &exactly(4e3));
        let Some(estimate) = result.estimated_relative_rmse else {
            println!("{}: nothing is lit", scene.name);
            continue;
        };
        let truth = bake(scene.clone(), &exactly(6.4e4));
        let error = true_error(&result, &truth);
        let ratio = error / estimate;
        println!(
            "{}: true {error:.4}, estimated {estimate:.4}, ratio {ratio:.2}",
            scene.name
        );
        ratios.push(ratio);
        if !(0.5..=2.0).contains(&ratio) {
            faults.push(format!("{}: true {error}, estimated {estimate}", scene.name));
        }
    }
    ratios.sort_by(f64::total_cmp);
    let within = ratios.len() - faults.len();
    println!(
        "{within} of {} within a factor of two; median {:.2}",
        ratios.len(),
        ratios[ratios.len() / 2]
    );
    // Half of these errors are above 20 %: the light of a bowl, say, on a floor that most of it misses.
    assert!(ratios.len() >= 45, "{} scenes are lit", ratios.len());
    assert!(faults.len() <= 2, "{faults:#?}");
    assert!(ratios[0] > 0.33 && ratios[ratios.len() - 1] < 3.0, "{ratios:?}");
}
/// A splat bake of randomly placed rays against the mean of many such: what is left is noise.
#[test]
fn most_texels_lie_within_their_error() {
    let settings = |seed: u64| BakeSettings {
        rays: RayPlacement::Jittered,
        seed,
        ..BakeSettings {
            map_resolution: exactly(1.0).map_resolution,
            density_per_sr: 3e4,
            ..BakeSettings::splat()
        }
    };
    for name in ["ring", "pool"] {
        let bakes: Vec<BakeResult> = (0..12)
            .map(|seed| bake(builtin_scene(name), &settings(seed)))
            .collect();
        let maps: Vec<Vec<f64>> = bakes
            .iter()
            .map(|bake| luminance(&bake.maps[0]).collect())
            .collect();
        let mean = |texel: usize| maps.iter().map(|map| map[texel]).sum::<f64>() / maps.len() as f64;
        let error = bakes[0].maps[0].error.as_ref().expect("an estimate");
        let lit: Vec<usize> = (0..maps[0].len()).filter(|&texel| mean(texel) > 0.0).collect();
        // The mean of twelve holds a twelfth of the one.
        let scale = (1.0 - 1.0 / maps.len() as f64).sqrt();
        let within = lit
            .iter()
            .filter(|&&texel| (maps[0][texel] - mean(texel)).abs() <= f64::from(error[texel]) * scale)
            .count();
        let share = within as f64 / lit.len() as f64;
        println!(
            "{name}: {:.1} % of {} texels within one error",
            100.0 * share,
            lit.len()
        );
        // Blur adds to the noise that this is about.
        assert!((0.55..=0.8).contains(&share), "{name}: {share}");
    }
}

/// The error of a sum is that of its parts together, and direct light, which is no estimate, has none.
#[test]
fn errors_of_lights_add_up_and_direct_light_has_none() {
    let scene = builtin_scene("ring");
    let mut twice = scene.clone();
    twice.lights.push(twice.lights[0].clone());
    let settings = at(2_000.0, 32);
    let with_direct = BakeSettings {
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        ..settings.clone()
    };
    let one = bake(scene.clone(), &settings);
    let errors = |result: &BakeResult| -> Vec<f32> {
        let map = result.maps.first().expect("a map");
        map.error.clone().expect("an estimate")
    };
    let single = errors(&one);
    assert!(single.iter().any(|error| *error > 0.0));
    for (own, both) in single.iter().zip(errors(&bake(twice, &settings))) {
        let expected = own * std::f32::consts::SQRT_2;
        assert!((both - expected).abs() <= 1e-5 * expected, "{both} for {own}");
    }
    let lit = bake(scene, &with_direct);
    assert_eq!(errors(&lit), single);
    let estimate = |result: &BakeResult| result.estimated_relative_rmse.expect("an estimate");
    assert!((estimate(&lit) / estimate(&one) - 1.0).abs() < 1e-6);
}

/// Two weak beams beside a lamp that is far stronger: one of them a ball draws together on a texel or two, where it is
/// brighter than everything else. The floor is lit by all three, the wall by less.
#[test]
fn a_weak_light_in_focus_is_not_left_coarse() {
    for target in [0.2, 0.1] {
        let result = bake(builtin_scene("spectrum"), &towards(target));
        assert_eq!(result.stop_reason, StopReason::MaxError, "{target}");
        let estimate = result.estimated_relative_rmse.expect("an estimate");
        assert!(estimate <= target, "{estimate} where {target} is said to be met");
    }
}
