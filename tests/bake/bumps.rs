//! Light through waves that only bend normals, against the same waves as a shape.

use std::sync::Arc;

use glam::DVec3;
use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::progress::Control;
use nephroid::scene::builtin::pool::{AMPLITUDE_M, bumped, displaced};
use nephroid::scene::{Edit, LightKind, Scene, Wave, Waves};
use nephroid::session::{BakeResult, BakeSession};
use nephroid::settings::BakeSettings;

use crate::bump_scenes::{by_image, by_waves};
use crate::tools::{at, bake, bits, caustic, energy_fault, map_of, settings};

/// Relative RMSE of two maps of equal texels.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let mean = b.iter().sum::<f64>() / b.len() as f64;
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    (squares / b.len() as f64).sqrt() / mean
}

/// Their correlation.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        a.iter().zip(b).map(|(a, b)| f(a - mean_a, b - mean_b)).sum()
    };
    sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt()
}

fn under_sun(mut scene: Scene, direction: DVec3) -> Scene {
    if let LightKind::Sun { direction: old, .. } = &mut scene.lights[0].kind {
        *old = direction.normalize();
    }
    scene
}

fn floor(scene: Scene, density: f64, side: usize) -> Vec<f64> {
    let result = bake(scene.clone(), &at(density, side));
    assert_eq!(energy_fault(&result), None);
    caustic(map_of(&result, &scene, "floor"))
}

/// A displaced wave of height h sends light on from h higher: its place on the floor moves by h·(tan θi − tan θt), first
/// order in the amplitude under a slanting sun, and by h times the slope's own deflection under one overhead, second
/// order. So the maps' difference must halve, and quarter, with the amplitude.
#[test]
fn normals_alone_differ_from_a_displaced_surface_by_what_its_height_explains() {
    for (sun, name, order) in [
        (DVec3::new(0.3, -1.0, 0.2), "slanting", 1),
        (DVec3::NEG_Y, "overhead", 2),
    ] {
        let found: Vec<(f64, f64, f64)> = [1.0, 0.5, 0.25, 0.125]
            .into_iter()
            .map(|part| {
                let amplitude_m = AMPLITUDE_M * part;
                let [bumps, shape] = [bumped(amplitude_m), displaced(amplitude_m)]
                    .map(|scene| floor(under_sun(scene, sun), 4e4, 64));
                let flux = bumps.iter().sum::<f64>() / shape.iter().sum::<f64>();
                (difference(&bumps, &shape), correlation(&bumps, &shape), flux)
            })
            .collect();
        for (rmse, correlation, flux) in &found {
            println!("{name}: rmse {rmse:.5}, correlation {correlation:.5}, flux {flux:.5}");
        }
        assert!(found.iter().all(|(.., flux)| (flux - 1.0).abs() < 2e-3));
        assert!(found[0].1 > 0.9 && found[3].1 > 0.98);
        // What folds add to the difference goes with the folds.
        let law = f64::from(1 << order);
        for pair in found.windows(2) {
            let ratio = pair[0].0 / pair[1].0;
            assert!(ratio > 0.9 * law, "{name}: {ratio}, not {law}");
        }
        let last = found[2].0 / found[3].0;
        assert!(last < 1.25 * law, "{name}: {last}, not {law}");
    }
}

/// One quad with a wave of a length and a slope.
fn rippled(wavelength_m: f64, slope: f64) -> Scene {
    let mut scene = bumped(AMPLITUDE_M);
    let wave = |direction: DVec3, part: f64| Wave {
        amplitude_m: part * slope * wavelength_m / std::f64::consts::TAU,
        wavelength_m: wavelength_m * part,
        direction: direction.normalize(),
        phase_rad: part,
    };
    let waves = vec![
        wave(DVec3::new(1.0, 0.0, 0.3), 1.0),
        wave(DVec3::new(-0.4, 0.0, 1.0), 0.8),
    ];
    scene.materials[1].waves = Some(Waves::new(waves).expect("gentle waves"));
    scene
}

#[test]
fn waves_shorter_than_a_cell_are_resolved_all_the_same() {
    let side = 96;
    let scene = rippled(0.06, 0.02);
    let reference = floor(scene.clone(), 1e5, side);
    let coarse = bake(scene.clone(), &at(300.0, side));
    let map = caustic(map_of(&coarse, &scene, "floor"));
    let off = difference(&map, &reference);
    println!("{} cells, off by {off:.4}", coarse.counts.cells);
    assert!(coarse.counts.splats == 0);
    assert!(off < 0.05, "{off}");
}

#[test]
fn waves_finer_than_any_cell_blur_the_light_and_lose_none() {
    let side = 32;
    let scene = rippled(2e-4, 0.1);
    let result = bake(scene.clone(), &at(1e4, side));
    assert_eq!(energy_fault(&result), None);
    assert!(result.counts.splats > 0, "one small patch per ray");
    let map = caustic(map_of(&result, &scene, "floor"));
    let still = bumped(0.0);
    let flat = floor(still, 1e4, side);
    // Away from the border the floor is lit from everywhere alike.
    let inner = |map: &[f64]| -> Vec<f64> {
        let rows = (8..24).flat_map(|row| map[row * side + 8..row * side + 24].to_vec());
        rows.collect()
    };
    let off = difference(&inner(&map), &inner(&flat));
    let mean = |map: &[f64]| inner(map).iter().sum::<f64>();
    let flux = mean(&map) / mean(&flat);
    let counts = &result.counts;
    println!(
        "{} rays, {} splats, off by {off:.4}, flux {flux:.5}",
        counts.rays, counts.splats
    );
    assert!(counts.splats < 16 * counts.rays, "cells are not divided in vain");
    assert!(off < 0.15 && (flux - 1.0).abs() < 5e-3, "{off} {flux}");
}

fn floor_bits(result: &BakeResult, scene: &Scene) -> Vec<u32> {
    bits(map_of(result, scene, "floor"))
}

fn bumps_taken(result: &BakeResult) -> (bool, u64) {
    let report = result
        .effects
        .iter()
        .find(|report| report.line.effect == Effect::Bumps);
    let report = report.expect("every effect is reported");
    (report.line.on, report.counts.rays + report.counts.deposits)
}

#[test]
fn bumps_are_an_effect_that_scenes_call_for_and_that_can_be_left_out() {
    let (wavy, still) = (bumped(AMPLITUDE_M), bumped(0.0));
    for settings in [at(1e3, 32), settings(1e4, 32)] {
        let off = BakeSettings {
            effects: EffectSwitches::default().with(Effect::Bumps, EffectSwitch::Off),
            ..settings.clone()
        };
        let mut session = BakeSession::new(Arc::new(wavy.clone())).expect("a session");
        let mut run =
            |settings: &BakeSettings| session.bake(settings, &(), &Control::default()).expect("a bake");
        let (with, without, again) = (run(&settings), run(&off), run(&settings));
        let (on, taken) = bumps_taken(&with);
        assert!(on && taken > 0);
        assert_eq!(bumps_taken(&without), (false, 0));
        assert_eq!(energy_fault(&without), None);
        let flat = bake(still.clone(), &off);
        assert!(
            floor_bits(&without, &wavy) == floor_bits(&flat, &still),
            "normals of the mesh"
        );
        assert!(floor_bits(&without, &wavy) != floor_bits(&with, &wavy));
        assert!(
            floor_bits(&again, &wavy) == floor_bits(&with, &wavy),
            "nothing of the other is kept"
        );
        let shape = bake(displaced(AMPLITUDE_M), &settings);
        assert_eq!(bumps_taken(&shape), (false, 0));
    }
}

#[test]
fn edited_waves_bake_as_if_they_had_been_there_from_the_start() {
    let (first, second) = (bumped(AMPLITUDE_M), bumped(0.5 * AMPLITUDE_M));
    for settings in [at(1e3, 32), settings(1e4, 32)] {
        let mut session = BakeSession::new(Arc::new(first.clone())).expect("a session");
        let run = |session: &mut BakeSession| {
            let result = session.bake(&settings, &(), &Control::default());
            floor_bits(&result.expect("a bake"), &first)
        };
        let before = run(&mut session);
        let edit = Edit::MaterialWaves {
            material: 1,
            waves: second.materials[1].waves.clone(),
        };
        let (edited, inverse) = edit.apply(&first).expect("it is in range");
        session
            .set_scene(Arc::new(edited.clone()))
            .expect("the same objects");
        let after = run(&mut session);
        assert!(after == floor_bits(&bake(second.clone(), &settings), &second));
        let (restored, _) = inverse.apply(&edited).expect("what was, is in range");
        session.set_scene(Arc::new(restored)).expect("the same objects");
        assert!(run(&mut session) == before && before != after);
    }
}

#[test]
fn an_image_of_normals_bends_light_as_the_waves_that_it_shows() {
    let waves = floor(by_waves(), 2e4, 64);
    for mirrored in [false, true] {
        let image = floor(by_image(mirrored), 2e4, 64);
        let (off, alike) = (difference(&image, &waves), correlation(&image, &waves));
        let flux = image.iter().sum::<f64>() / waves.iter().sum::<f64>();
        println!("mirrored {mirrored}: rmse {off:.4}, correlation {alike:.5}, flux {flux:.5}");
        // Eight bits of a slope and straight lines between texels are left.
        assert!(off < 0.05 && alike > 0.99, "{off} {alike}");
        assert!((flux - 1.0).abs() < 2e-3, "{flux}");
    }
}

#[test]
fn both_estimators_agree_on_an_image_of_normals() {
    let scene = by_image(false);
    let patches = floor(scene.clone(), 2e4, 32);
    let result = bake(scene.clone(), &settings(2e5, 32));
    assert_eq!(energy_fault(&result), None);
    let splats = caustic(map_of(&result, &scene, "floor"));
    let off = difference(&patches, &splats);
    println!("off by {off:.4}");
    assert!(off < 0.05, "{off}");
}
