//! Light through waves that only bend normals, against the same waves as a shape.

use std::sync::Arc;

use glam::DVec3;
use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::scene::builtin::pool::{AMPLITUDE_M, bumped, displaced};
use nephroid::scene::{Edit, LightKind, MaterialEdit, Scene, Wave, Waves};
use nephroid::settings::BakeSettings;

use crate::bake::common::{self, all_bits, edit, rmse, run, session};
use support::bump_scenes::{by_image, by_waves};
use support::tools::{at, bake, energy_fault, set, settings};

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        a.iter().zip(b).map(|(a, b)| f(a - mean_a, b - mean_b)).sum()
    };
    sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt()
}

fn flux_ratio(a: &[f64], b: &[f64]) -> f64 {
    a.iter().sum::<f64>() / b.iter().sum::<f64>()
}

fn floor(scene: Scene, settings: &BakeSettings) -> Vec<f64> {
    let result = bake(scene.clone(), settings);
    assert_eq!(energy_fault(&result), None);
    common::floor(&result, &scene)
}

/// A displaced wave of height h sends light on from h higher: its place on the floor moves by h·(tan θi − tan θt), first
/// order in the amplitude under a slanting sun, and by h times the slope's own deflection under one overhead, second
/// order. So the maps' difference must halve, and quarter, with the amplitude.
#[test]
fn bumps_differ_from_a_shape_by_its_height() {
    for (towards, law) in [(DVec3::new(0.3, -1.0, 0.2), 2.0), (DVec3::NEG_Y, 4.0)] {
        let under_sun = |mut scene: Scene| {
            if let LightKind::Sun { direction, .. } = &mut scene.lights[0].kind {
                *direction = towards.normalize();
            }
            floor(scene, &at(4e4, 64))
        };
        let found = [0.5, 0.25, 0.125].map(|part| {
            let amplitude_m = AMPLITUDE_M * part;
            let (bumps, shape) = (under_sun(bumped(amplitude_m)), under_sun(displaced(amplitude_m)));
            assert!((flux_ratio(&bumps, &shape) - 1.0).abs() < 2e-3);
            (rmse(&bumps, &shape), correlation(&bumps, &shape))
        });
        assert!(found[0].1 > 0.9 && found[2].1 > 0.98, "{found:?}");
        // What folds add to the difference goes with the folds.
        for pair in found.windows(2) {
            assert!(pair[0].0 / pair[1].0 > 0.9 * law, "not {law}: {found:?}");
        }
        assert!(found[1].0 / found[2].0 < 1.25 * law, "not {law}: {found:?}");
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
fn waves_shorter_than_a_cell_are_resolved() {
    let scene = rippled(0.06, 0.02);
    let coarse = bake(scene.clone(), &at(300.0, 96));
    assert!(coarse.counts.splats == 0);
    let off = rmse(
        &common::floor(&coarse, &scene),
        &floor(scene.clone(), &at(1e5, 96)),
    );
    assert!(off < 0.05, "{off}");
}

#[test]
fn waves_finer_than_any_cell_blur_light() {
    let side = 32;
    let scene = rippled(2e-4, 0.1);
    let result = bake(scene.clone(), &at(1e4, side));
    assert_eq!(energy_fault(&result), None);
    let counts = &result.counts;
    assert!(counts.splats > 0, "one small patch per ray");
    assert!(counts.splats < 16 * counts.rays, "cells are not divided in vain");
    // Away from the border the floor is lit from everywhere alike.
    let inner = |map: Vec<f64>| -> Vec<f64> {
        let rows = (8..24).flat_map(|row| map[row * side + 8..row * side + 24].to_vec());
        rows.collect()
    };
    let (fine, flat) = (
        inner(common::floor(&result, &scene)),
        inner(floor(bumped(0.0), &at(1e4, side))),
    );
    let (off, flux) = (rmse(&fine, &flat), flux_ratio(&fine, &flat));
    assert!(off < 0.15 && (flux - 1.0).abs() < 5e-3, "{off} {flux}");
}

#[test]
fn bumps_off_bakes_the_mesh_itself() {
    let wavy = bumped(AMPLITUDE_M);
    for settings in [at(1e3, 32), settings(1e4, 32)] {
        let off = set(settings.clone(), |s| {
            s.effects = EffectSwitches::default().with(Effect::Bumps, EffectSwitch::Off)
        });
        let mut session = session(&wavy);
        let [with, without, again] = [&settings, &off, &settings].map(|settings| run(&mut session, settings));
        assert!(with.plan.is_on(Effect::Bumps) && !without.plan.is_on(Effect::Bumps));
        assert_eq!(energy_fault(&without), None);
        let [lit, unlit, relit] = [&with, &without, &again].map(all_bits);
        assert!(unlit == all_bits(&bake(bumped(0.0), &off)), "normals of the mesh");
        assert!(unlit != lit);
        assert!(relit == lit, "nothing of the other is kept");
        let shape = bake(displaced(AMPLITUDE_M), &settings);
        assert!(!shape.plan.is_on(Effect::Bumps));
    }
}

#[test]
fn edited_waves_bake_as_if_from_the_start() {
    let (first, second) = (bumped(AMPLITUDE_M), bumped(0.5 * AMPLITUDE_M));
    for settings in [at(1e3, 32), settings(1e4, 32)] {
        let mut session = session(&first);
        let before = all_bits(&run(&mut session, &settings));
        let waves = second.materials[1].waves.clone();
        edit(&mut session, &Edit::Material(1, MaterialEdit::Waves(waves)));
        let after = all_bits(&run(&mut session, &settings));
        assert!(after == all_bits(&bake(second.clone(), &settings)));
        session
            .set_scene(Arc::new(first.clone()))
            .expect("the same objects");
        assert!(all_bits(&run(&mut session, &settings)) == before && before != after);
    }
}

/// As the waves that it shows, whichever way round its coordinates run, and by both estimators.
#[test]
fn an_image_of_normals_bends_light() {
    let waves = floor(by_waves(), &at(2e4, 64));
    for mirrored in [false, true] {
        let image = floor(by_image(mirrored), &at(2e4, 64));
        let (off, alike) = (rmse(&image, &waves), correlation(&image, &waves));
        let flux = flux_ratio(&image, &waves);
        // Eight bits of a slope and straight lines between texels are left.
        assert!(off < 0.05 && alike > 0.99, "mirrored {mirrored}: {off} {alike}");
        assert!((flux - 1.0).abs() < 2e-3, "mirrored {mirrored}: {flux}");
    }
    let [patches, splats] =
        [at(2e4, 32), settings(2e5, 32)].map(|settings| floor(by_image(false), &settings));
    let off = rmse(&patches, &splats);
    assert!(off < 0.05, "{off}");
}
