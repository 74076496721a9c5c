//! Random scenes by both estimators: each is held to one law of symmetry or proportion.

use std::collections::BTreeSet;
use std::sync::Mutex;

use nephroid::illumination::{Receiver, UvSet};

use support::laws::law::*;
use support::laws::{Baked, Table, is_long};
use support::prelude::*;
use support::random_scenes::{MAX_LAMPS, scene};
use support::tools::{photons, set, settings, to, transformed};

/// What may be done to a scene.
const CHANGES: u64 = 8;

pub fn fill(t: &mut Table) {
    let count = if is_long() { 10_000 } else { 200 };
    let scenes = |change: u64| {
        (0..count)
            .filter(move |seed| seed % CHANGES == change)
            .map(|seed| (scene(seed), of(seed)))
    };
    for (plain, settings) in scenes(0) {
        t.case("random-scenes-by-power")
            .bake_with(plain.clone(), settings.clone())
            .bake_with(brighter(plain, 4.0, true), settings)
            .as_first("four times the power, four times the map", 0.0, 4.0);
    }
    for (plain, settings) in scenes(1) {
        let mut reversed = plain.clone();
        reversed.objects.reverse();
        t.case("random-scenes-in-reverse")
            .bake_with(plain, settings.clone())
            .bake_with(reversed, settings)
            .compare("the same bits", 0.0, |reversed, plain| {
                let mut maps = reversed.result.maps.clone();
                // The sides of an object stay in their order.
                maps.sort_by_key(|map| (std::cmp::Reverse(map.chart.object()), map.chart.receiver));
                no(same_bits(&plain.result.maps, &maps))
            });
    }
    for (plain, settings) in scenes(2) {
        t.case("random-scenes-by-threads")
            .bake_with(plain.clone(), settings.clone())
            .bake_with(plain, set(settings, |s| s.threads = 3))
            .bits_as_first("three threads for one: the same bits");
    }
    for (plain, settings) in scenes(3) {
        // A target would be shared out among the lights.
        let settings = match settings.max_error {
            Some(_) => limited(photons(1e3, 32)),
            None => settings,
        };
        let all = t
            .case("random-scenes-light-by-light")
            .bake_with(plain.clone(), settings.clone());
        for light in plain.lights.clone() {
            let lights = vec![light];
            all.bake_with(
                Scene {
                    lights,
                    ..plain.clone()
                },
                settings.clone(),
            );
        }
        // One rounding for each light alone, one for each sum of two, one for the light of all together.
        all.law(
            "sum of their maps, roundings",
            2.0 * f64::from(MAX_LAMPS),
            roundings_apart,
        );
    }
    let turn = DMat3::from_axis_angle(dvec3(0.6, 0.0, 0.8), 0.7);
    let mirror = DMat3::from_diagonal(dvec3(-1.0, 1.0, 1.0));
    for (change, name, rotation, scale, offset) in [
        (4, "moved", DMat3::IDENTITY, 1.0, dvec3(64.0, -32.0, 16.0)),
        (5, "turned", turn, 1.0, dvec3(3.1, -7.3, 0.9)),
        (6, "mirrored", mirror, 1.0, DVec3::ZERO),
        (7, "eight-times-the-size", DMat3::IDENTITY, 8.0, DVec3::ZERO),
    ] {
        let moved = t.case(format!("random-scenes-{name}"));
        let offs = Arc::new(Mutex::new(Vec::new()));
        for (plain, settings) in scenes(change) {
            let there = transformed(plain.clone(), rotation, scale, offset);
            // E of lamps falls as the square of the size, that of suns does not.
            let there = brighter(there, scale * scale, false);
            let offs = Arc::clone(&offs);
            moved
                .bake_with(plain, settings.clone())
                .bake_with(there, settings)
                .forget(move |bakes| {
                    offs.lock()
                        .expect("no panic")
                        .push(over_estimate(&bakes[0], &bakes[1]))
                });
        }
        // Two errors that know nothing of each other are 0.7 of their sum apart; an estimate may be half of the error
        // in 2 of 50 scenes, here as in the tests of estimates.
        let mean = |offs: &[f64]| offs.iter().sum::<f64>() / offs.len() as f64;
        let far_off = |offs: &[f64]| offs.iter().filter(|off| **off > 2.0).count() as f64 / offs.len() as f64;
        let all = Arc::clone(&offs);
        moved
            .fact(
                "map as before, over both estimated errors, mean",
                1.0,
                move || mean(&all.lock().expect("no panic")),
            )
            .fact(
                "more than twice both errors off, share of scenes",
                0.04,
                move || far_off(&offs.lock().expect("no panic")),
            );
    }
}

/// Half the scenes by each estimator. Glass boxes have branches without end.
fn of(seed: u64) -> BakeSettings {
    let estimator = if (seed / CHANGES).is_multiple_of(2) {
        to(0.1, 32)
    } else {
        settings(1e3, 32)
    };
    limited(estimator)
}

fn limited(settings: BakeSettings) -> BakeSettings {
    BakeSettings {
        max_depth: Some(4),
        branch_threshold: Some(1e-2),
        ..settings
    }
}

/// Lamps a number of times as strong; suns too, if asked.
fn brighter(mut scene: Scene, factor: f64, suns_too: bool) -> Scene {
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. } => intensity.0 *= factor,
            LightKind::Sun {
                normal_irradiance, ..
            } if suns_too => normal_irradiance.0 *= factor,
            _ => {}
        }
    }
    scene
}

/// The first bake has the lights of all others: the largest difference over what single precision may round off, 2⁻²⁴.
fn roundings_apart(bakes: &[Baked]) -> f64 {
    let together = &bakes[0].result.maps;
    let sums: Vec<_> = together.iter().map(|map| map_sum(map, &bakes[1..])).collect();
    let values = |maps: &[IlluminationMap]| -> Vec<f64> {
        let layers = maps.iter().filter_map(|map| map.layer(LayerKind::Caustic));
        layers
            .flat_map(|layer| layer.irradiance.iter().flatten())
            .map(|e| f64::from(*e))
            .collect()
    };
    let pairs = values(together)
        .into_iter()
        .zip(values(&sums))
        .filter(|(a, b)| a != b);
    let roundings =
        |(a, b): (f64, f64)| (a - b).abs() / (a.abs() * (-24_f64).exp2()).max(f64::from(f32::MIN_POSITIVE));
    pairs.map(roundings).fold(0.0, f64::max)
}

/// The difference of the maps of two bakes over the sum of what they think of their errors, root mean squares over all
/// surfaces with texture coordinates of their own: generated ones lie elsewhere for another scene.
fn over_estimate(a: &Baked, b: &Baked) -> f64 {
    let (mut difference, mut errors) = (0.0, [0.0; 2]);
    let all = [a, b].into_iter().flat_map(|bake| &bake.result.maps);
    let charted = all.filter(|map| map.chart.uv_set != UvSet::Generated);
    let receivers: BTreeSet<Receiver> = charted.map(|map| map.chart.receiver).collect();
    for receiver in receivers {
        let maps = [a, b].map(|bake| bake.result.maps.iter().find(|map| map.chart.receiver == receiver));
        let values = maps.map(|map| map.map_or_else(Vec::new, |map| luminance(map, LayerKind::Caustic)));
        let chart = &maps
            .into_iter()
            .flatten()
            .next()
            .expect("one of them has it")
            .chart;
        for texel in 0..chart.texel_count() {
            let [a, b] = [0, 1].map(|bake| values[bake].get(texel).copied().unwrap_or(0.0));
            difference += (a - b) * (a - b) * chart.texel_area_m2(texel);
        }
        for (error, map) in errors.iter_mut().zip(maps) {
            *error += map.map_or(0.0, squared_error);
        }
    }
    match difference {
        0.0 => 0.0,
        _ => difference.sqrt() / (errors[0].sqrt() + errors[1].sqrt()),
    }
}

/// What a map thinks of its error, squared and integrated over its surface [W²/m²].
fn squared_error(map: &IlluminationMap) -> f64 {
    let area_m2 = map.chart.area_m2();
    let mean = map.flux_w(LayerKind::Caustic).luminance() / area_m2;
    (map.estimated_relative_rmse.unwrap_or(0.0) * mean).powi(2) * area_m2
}
