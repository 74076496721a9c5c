//! Soft caustics: lights with a size and rough surfaces, against brute force, against their limits, and against the law of
//! energy.

use glam::DVec3;
use nephroid::illumination::compare::relative_rmse;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Light, LightKind, LightSize, PanelShape, Scene};
use nephroid::session::BakeResult;
use nephroid::settings::BakeSettings;
use nephroid::study::agreement::caustic_luminance;
use nephroid::units::Radiance;

use crate::brute_force::brute;
use crate::tools::{at, bake, bits, builtin_scene, energy_fault, map_of, settings};

/// A square lamp of a side [m] that shines downwards from a place, with the same intensity on its axis whatever its side.
fn square_lamp(centre: DVec3, side_m: f64) -> Light {
    Light {
        name: "lamp".into(),
        colour: LinearSrgb::WHITE,
        spectrum: None,
        kind: LightKind::Panel {
            centre,
            across: DVec3::X * (0.5 * side_m),
            down: DVec3::Z * (0.5 * side_m),
            shape: PanelShape::Rectangle,
            radiance: Radiance(8.0 / (side_m * side_m)),
        },
        size: LightSize::None,
    }
}

fn towards(target: f64, side: usize) -> BakeSettings {
    BakeSettings {
        max_error: Some(target),
        density_per_sr: BakeSettings::starting_density_per_sr(target),
        ..at(1.0, side)
    }
}

fn floor(result: &BakeResult, scene: &Scene) -> Vec<f64> {
    caustic_luminance(map_of(result, scene, "floor"))
}

/// Relative RMSE between a bake and brute force, without the latter's noise; the noise must not hide more than `most_noise`.
fn off_brute_force(result: &BakeResult, scene: &Scene, rays: u64, most_noise: f64) -> f64 {
    let side = map_of(result, scene, "floor").chart.width;
    let reference = brute(scene, &settings(1.0, side), rays);
    let map = map_of(&reference, scene, "floor");
    let noise = map.estimated_relative_rmse.expect("a noise");
    assert!(noise < most_noise, "noise {noise}");
    let rmse = relative_rmse(&floor(result, scene), &caustic_luminance(map)).expect("light");
    (rmse * rmse - noise * noise).max(0.0).sqrt()
}

#[test]
fn a_square_lamp_tends_to_the_point_that_it_shrinks_to() {
    let mut scene = builtin_scene("ring");
    let place = scene.lights[0].kind.position().expect("a point light");
    let map_at = |scene: &Scene| {
        let result = bake(scene.clone(), &towards(0.02, 32));
        assert_eq!(energy_fault(&result), None);
        floor(&result, scene)
    };
    scene.lights = vec![square_lamp(place, 1e-6)];
    let point = map_at(&scene);
    let sides_m = [0.4, 0.2, 0.1];
    let differences: Vec<f64> = sides_m
        .iter()
        .map(|&side_m| {
            scene.lights = vec![square_lamp(place, side_m)];
            relative_rmse(&map_at(&scene), &point).expect("light")
        })
        .collect();
    println!("square lamp against its middle: {differences:?} for sides of {sides_m:?} m");
    // The blur is as wide as the lamp: caustics of about a texel's width change by at least its 0.7th power.
    assert!(differences[0] > 0.15, "{differences:?}");
    for pair in differences.windows(2) {
        assert!(pair[1] < 0.65 * pair[0], "{differences:?}");
    }
}

#[test]
fn large_lamps_are_as_brute_force_has_them_and_know_their_error() {
    let mut ring = builtin_scene("ring");
    let place = ring.lights[0].kind.position().expect("a point light");
    ring.lights = vec![square_lamp(place, 0.3)];
    let mut sun = builtin_scene("nephroid");
    sun.lights[0].size = LightSize::Angle {
        diameter_rad: 0.53_f64.to_radians(),
    };
    for (what, scene) in [("square lamp", &ring), ("sun of 0.53°", &sun)] {
        let result = bake(scene.clone(), &towards(0.02, 48));
        assert_eq!(energy_fault(&result), None, "{what}");
        let estimated = result.estimated_relative_rmse.expect("an estimate");
        let off = off_brute_force(&result, scene, 1_400_000, 0.06);
        println!(
            "{what}: off by {off:.4}, estimated {estimated:.4}, {} rays",
            result.counts.rays
        );
        assert!(estimated <= 0.02, "{what}: {estimated}");
        // The estimate's own law: never half of the truth.
        assert!(
            off <= 2.0 * estimated,
            "{what}: off by {off}, estimated {estimated}"
        );
    }
}

/// A scene whose specular materials have a roughness.
fn roughened(name: &str, roughness: f64) -> Scene {
    let mut scene = builtin_scene(name);
    for material in &mut scene.materials {
        if material.surface.is_specular() {
            material.roughness = roughness;
        }
    }
    scene
}

/// A plate of frosted glass over the floor.
fn frosted_plate(roughness: f64) -> Scene {
    let mut scene = roughened("mirror", roughness);
    scene.objects.truncate(1);
    let mut glass = parts::dielectric("frosted glass", 1.5);
    glass.roughness = roughness;
    let plate = shapes::cuboid(DVec3::new(-0.3, 0.5, -0.3), DVec3::new(0.3, 0.56, 0.3));
    parts::add(&mut scene, "plate", plate, glass);
    scene
}

fn check_rough(what: &str, scene: &Scene, target: f64) {
    let result = bake(scene.clone(), &towards(target, 48));
    assert_eq!(energy_fault(&result), None, "{what}");
    let off = off_brute_force(&result, scene, 1_700_000, 0.06);
    println!(
        "{what}: off by {off:.4}, estimated {:?}, {} rays, {:.1} CPU s",
        result.estimated_relative_rmse, result.counts.rays, result.cpu_s.total
    );
    assert!(off <= 0.03, "{what}: off by {off}");
}

#[test]
fn rough_mirrors_are_as_brute_force_has_them() {
    for roughness in [0.05, 0.2, 0.5] {
        let scene = roughened("mirror", roughness);
        check_rough(&format!("mirror of roughness {roughness}"), &scene, 0.03);
    }
}

#[test]
fn frosted_glass_is_as_brute_force_has_it() {
    // Wider lobes take thousands of wavefronts: minutes.
    check_rough("glass of roughness 0.05", &frosted_plate(0.05), 0.02);
}

#[test]
fn nothing_is_lost_on_a_rough_white_mirror() {
    // All that leaves it arrives somewhere: a closed white room.
    let mut scene = roughened("mirror", 0.6);
    let walls = shapes::cuboid(DVec3::new(-1.0, -0.001, -1.0), DVec3::new(1.0, 2.0, 1.0));
    let white = parts::matte("walls", LinearSrgb::WHITE);
    parts::add(&mut scene, "walls", walls, white);
    let settings = BakeSettings {
        wavefronts: Some(16),
        ..at(2_000.0, 16)
    };
    let result = bake(scene, &settings);
    let energy = result.ledgers[0].energy_w;
    assert_eq!(energy_fault(&result), None);
    let lost = energy.emitted - energy.deposited - energy.truncated.total();
    assert!(lost.abs() < 1e-9 * energy.emitted, "{energy:?}");
    assert!(
        energy.truncated.total().abs() < 1e-3 * energy.emitted,
        "{energy:?}"
    );
    assert_eq!(energy.absorbed, 0.0);
}

#[test]
fn soft_maps_are_the_same_for_any_number_of_threads() {
    let mut scene = roughened("mirror", 0.2);
    scene.lights[0].size = LightSize::Radius { radius_m: 0.1 };
    let of = |threads| {
        let settings = BakeSettings {
            threads,
            ..towards(0.1, 32)
        };
        bake(scene.clone(), &settings)
    };
    let (one, three) = (of(1), of(3));
    let all = |result: &BakeResult| -> Vec<Vec<u32>> { result.maps.iter().map(bits).collect() };
    assert_eq!(all(&one), all(&three));
    assert_eq!(one.estimated_relative_rmse, three.estimated_relative_rmse);
    assert_eq!(one.counts, three.counts);
}

#[test]
fn as_many_wavefronts_as_are_asked_for() {
    let scene = roughened("mirror", 0.2);
    let rays = |wavefronts| {
        let settings = BakeSettings {
            wavefronts: Some(wavefronts),
            ..at(2_000.0, 16)
        };
        let result = bake(scene.clone(), &settings);
        assert_eq!(energy_fault(&result), None);
        result.counts.rays
    };
    let (few, many) = (rays(16), rays(32));
    assert!((1.8..2.2).contains(&(many as f64 / few as f64)), "{few}, {many}");
    let refused = BakeSettings {
        wavefronts: Some(48),
        ..at(2_000.0, 16)
    };
    let error = refused.validate().expect_err("48 is no power of two");
    assert!(error.to_string().contains("--wavefronts"), "{error}");
}
