//! Soft caustics: lights with a size and rough surfaces, against brute force, against their limits, and against the law of
//! energy.

use glam::DVec3;
use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::optics::LinearSrgb;
use nephroid::progress::Control;
use nephroid::scene::Scene;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::settings::{BakeSettings, Estimator};

use crate::bake::common::{floor, off_brute_force, rmse, session, towards};
use support::hard_scenes::{roughened, under_square_lamp, under_the_suns_disc};
use support::tools::{at, bake, builtin_scene, energy_fault, photons, set, settings};

/// Photons until a target is reached, with maps of `side` texels each way.
fn soft(target: f64, side: usize) -> BakeSettings {
    set(towards(target, side), |s| s.estimator = Estimator::Photon)
}

#[test]
fn a_square_lamp_tends_to_a_point() {
    let map_at = |side_m: f64| {
        let scene = under_square_lamp("ring", side_m);
        let result = bake(scene.clone(), &soft(0.02, 32));
        assert_eq!(energy_fault(&result), None);
        floor(&result, &scene)
    };
    let point = map_at(1e-6);
    let off = [0.4, 0.2, 0.1].map(|side_m| rmse(&map_at(side_m), &point));
    // The blur is as wide as the lamp: caustics of about a texel's width change by at least its 0.7th power.
    assert!(off[0] > 0.15, "{off:?}");
    assert!(off.windows(2).all(|pair| pair[1] < 0.65 * pair[0]), "{off:?}");
}

/// A plate of frosted glass over the floor.
fn frosted_plate() -> Scene {
    let mut scene = builtin_scene("mirror");
    scene.objects.truncate(1);
    let mut glass = parts::dielectric("frosted glass", 1.5);
    glass.roughness = 0.05;
    let plate = shapes::cuboid(DVec3::new(-0.3, 0.5, -0.3), DVec3::new(0.3, 0.56, 0.3));
    parts::add(&mut scene, "plate", plate, glass);
    scene
}

/// What is off brute force may be twice the estimate, as everywhere; rough surfaces are within 3 %.
#[test]
fn soft_light_is_as_brute_force_has_it() {
    let cases = [
        ("square lamp", under_square_lamp("ring", 0.3), 0.02, false),
        ("sun of 0.53°", under_the_suns_disc(), 0.02, false),
        ("roughness 0.05", roughened("mirror", 0.05), 0.025, true),
        ("roughness 0.2", roughened("mirror", 0.2), 0.025, true),
        ("roughness 0.5", roughened("mirror", 0.5), 0.025, true),
        ("frosted glass", frosted_plate(), 0.02, true),
    ];
    for (what, scene, target, is_rough) in cases {
        let result = bake(scene.clone(), &soft(target, 48));
        assert_eq!(energy_fault(&result), None, "{what}");
        let estimated = result.estimated_relative_rmse.expect("an estimate");
        let rays = if is_rough { 1_700_000 } else { 1_400_000 };
        let (off, _) = off_brute_force(&result, &scene, rays, 0.06);
        if is_rough {
            assert!(off <= 0.03, "{what}: off by {off}");
        } else {
            assert!(estimated <= target, "{what}: {estimated}");
            assert!(off <= 2.0 * estimated, "{what}: {off}, estimated {estimated}");
        }
    }
}

/// All that leaves it arrives somewhere: a closed white room.
#[test]
fn a_rough_white_mirror_loses_nothing() {
    let mut scene = roughened("mirror", 0.6);
    let walls = shapes::cuboid(DVec3::new(-1.0, -0.001, -1.0), DVec3::new(1.0, 2.0, 1.0));
    let white = parts::matte("walls", LinearSrgb::WHITE);
    parts::add(&mut scene, "walls", walls, white);
    let result = bake(scene, &photons(1e6, 16));
    let energy = result.ledgers[0].energy_w;
    assert_eq!(energy_fault(&result), None);
    let given_up = energy.truncated.total();
    let lost = energy.emitted - energy.deposited - given_up - energy.sampling;
    assert!(lost.abs() < 1e-9 * energy.emitted, "{energy:?}");
    assert!(given_up.abs() < 1e-3 * energy.emitted, "{energy:?}");
    assert_eq!(energy.absorbed, 0.0);
}

#[test]
fn soft_light_is_refused_by_what_cannot_carry_it() {
    for (scene, cause) in [
        (roughened("mirror", 0.2), "is rough"),
        (under_square_lamp("ring", 0.2), "has a size"),
    ] {
        for settings in [at(2_000.0, 16), settings(2_000.0, 16)] {
            let refused = session(&scene).bake(&settings, &(), &Control::default());
            let error = refused.expect_err(cause).to_string();
            let has = |part: &str| error.contains(part);
            assert!(has(cause) && has("--estimator auto or photon"), "{error}");
        }
        let named = if cause == "is rough" {
            Effect::Roughness
        } else {
            Effect::AreaLights
        };
        let off = set(at(2_000.0, 16), |s| {
            s.effects = EffectSwitches::default().with(named, EffectSwitch::Off);
        });
        assert_eq!(energy_fault(&bake(scene, &off)), None, "{cause}");
    }
}
