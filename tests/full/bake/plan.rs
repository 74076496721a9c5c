//! What can send no light to a diffuse surface costs nothing after the plan, and changes not a bit.

use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::settings::Estimator;

use crate::bake::common::{all_bits, caustic_like, floor, rmse, same_map};
use support::prelude::*;
use support::random_scenes;
use support::scenes::spot;
use support::tools::{bake, builtin_scene, settings, to};

fn add_matte(scene: &mut Scene, name: &str, mesh: Mesh) {
    parts::add(scene, name, mesh, parts::matte("matte", LinearSrgb::grey(0.5)));
}

fn add_box(scene: &mut Scene, name: &str, centre: DVec3, half: f64) {
    add_matte(scene, name, shapes::cuboid(centre - half, centre + half));
}

fn add_ball(scene: &mut Scene, name: &str, centre: DVec3, radius: f64) {
    let glass = parts::dielectric("glass", 1.5);
    parts::add(scene, name, shapes::sphere(centre, radius, 2), glass);
}

fn add_lamp(scene: &mut Scene, name: &str, place: DVec3, power_w: f64) {
    scene.lights.push(parts::point_light(name, place, Flux(power_w)));
}

/// A hundred small glass balls behind a wall, which stands across the way from the light.
fn add_hidden_balls(scene: &mut Scene) {
    let (from, middle) = (dvec3(-0.7, 1.2, 0.0), dvec3(-0.86, 0.3, -0.86));
    let away = (middle - from).normalize();
    let (across, down) = away.any_orthonormal_pair();
    let wall = shapes::rectangle(middle - away * 0.03, across * 0.1, down * 0.1);
    add_matte(scene, "wall", wall);
    for index in 0..100 {
        let place = |step: i32| (f64::from(step) - 4.5) * 0.012;
        let centre = middle + across * place(index % 10) + down * place(index / 10);
        add_ball(scene, &format!("hidden{index}"), centre, 0.005);
    }
}

fn narrow(position: DVec3, direction: DVec3) -> Light {
    spot(position, direction, 5.0, [0.1, 0.3])
}

/// Lamps that see nothing specular: in opaque boxes, aimed away, and close above a plate that hides the rest.
fn add_useless_lights(scene: &mut Scene) {
    for index in 0..4 {
        let centre = dvec3(0.86, 0.05 + 0.1 * f64::from(index), 0.92);
        add_box(scene, &format!("lantern{index}"), centre, 0.02);
        add_lamp(scene, &format!("sealed{index}"), centre, 10.0);
    }
    for index in 0..4 {
        let place = dvec3(0.9, 0.35, -0.95 + 0.02 * f64::from(index));
        let away = dvec3(1.0, 0.2 * f64::from(index), 0.0);
        scene.lights.push(narrow(place, away));
    }
    for index in 0..2 {
        let place = dvec3(0.93, 0.38, -0.75 - 0.12 * f64::from(index));
        let plate = shapes::rectangle(place - DVec3::X * 0.005, DVec3::Y * 0.04, DVec3::Z * 0.04);
        add_matte(scene, &format!("plate{index}"), plate);
        scene.lights.push(narrow(place, DVec3::NEG_X));
    }
}

/// The ring among glass that light does not reach, and ten lamps that reach nothing specular.
fn crowded() -> Scene {
    let mut scene = builtin_scene("ring");
    let bounds = scene.bounds().expect("surfaces");
    let centre = dvec3(-0.88, 0.38, 0.88);
    add_box(&mut scene, "box", centre, 0.06);
    add_ball(&mut scene, "sealed", centre, 0.04);
    add_hidden_balls(&mut scene);
    add_useless_lights(&mut scene);
    assert_eq!(scene.bounds(), Some(bounds), "all of it lies within the scene");
    assert_eq!(scene.lights.len(), 11);
    scene
}

fn why(result: &Bake, effect: Effect) -> (bool, &str) {
    let mut lines = result.plan.effects.iter();
    let line = lines
        .find(|line| line.effect == effect)
        .expect("a line for every effect");
    (line.on, &line.reason)
}

#[test]
fn useless_things_cost_no_ray() {
    for settings in [to(0.03, 128), settings(20_000.0, 128)] {
        let alone = bake(builtin_scene("ring"), &settings);
        let among = bake(crowded(), &settings);
        let what = format!("{:?}, target {:?}", settings.estimator, settings.max_error);
        assert_eq!(among.counts.rays, alone.counts.rays, "rays, {what}");
        assert_eq!(among.counts.segments, alone.counts.segments, "segments, {what}");
        assert!(alone.counts.rays > 1000);
        assert_eq!(among.maps.len(), 1, "only the floor is lit");
        assert!(all_bits(&alone) == all_bits(&among), "not the same bits: {what}");
        assert!(alone.maps[0].error == among.maps[0].error, "errors, {what}");
        assert_eq!(among.plan.lights.iter().filter(|light| light.on).count(), 1);
        if settings.estimator == Estimator::Auto {
            check_item_buffers(&alone, &among);
        }
    }
}

/// Item-buffer tests are counted apart, and light by light.
fn check_item_buffers(alone: &Bake, among: &Bake) {
    assert!(among.counts.item_buffer_tests > alone.counts.item_buffer_tests);
    let buffers = &among.item_buffers;
    let tests: u64 = buffers.iter().map(|buffer| buffer.tests).sum();
    assert_eq!(tests, among.counts.item_buffer_tests);
    assert!(buffers[0].hidden_cells > 10, "the wall hides the balls");
    assert_eq!(buffers[1].tests, 0, "a sealed lamp is not looked around from");
    assert!(buffers[9].hidden_cells > 10, "the plate hides the ring");
}

/// A wall with a crack between its halves, wide enough for light or not there at all.
fn behind_a_wall(crack_m: f64) -> Scene {
    let mut scene = parts::reference_scene(1.0);
    add_ball(&mut scene, "ball", dvec3(0.3, 0.4, 0.0), 0.2);
    for (name, side) in [("left", -1.0), ("right", 1.0)] {
        let centre = dvec3(-0.3, 0.45, side * (0.5 + 0.5 * crack_m));
        add_matte(
            &mut scene,
            name,
            shapes::rectangle(centre, DVec3::Y * 0.45, DVec3::Z * 0.5),
        );
    }
    add_lamp(&mut scene, "lamp", dvec3(-0.8, 0.4, 0.0), 10.0);
    scene
}

#[test]
fn a_wall_hides_unless_light_comes_through() {
    let settings = to(0.005, 64);
    let shut = bake(behind_a_wall(0.0), &settings);
    assert_eq!(shut.counts.rays, 0);
    assert!(shut.maps.is_empty());
    let (on, reason) = why(&shut, Effect::LightPass);
    assert!(!on && reason.contains("no light sees"), "{reason}");
    let lights = &shut.plan.lights;
    assert!(lights[0].reason.contains("hide"), "{lights:?}");
    // A crack of a fifth of a lattice step: cells that it crosses are traced.
    assert!(bake(behind_a_wall(4e-4), &settings).counts.rays > 0);
    let wide_open = bake(behind_a_wall(0.3), &settings);
    assert!(wide_open.ledgers[0].energy_w.deposited > 0.01);
}

/// A mirror over a floor, upright or facing up to a lamp.
fn mirror_over_floor(faces_up: bool) -> Scene {
    let mut scene = parts::reference_scene(1.0);
    let (across, down) = if faces_up {
        (DVec3::Z, DVec3::X)
    } else {
        (DVec3::Y, DVec3::Z)
    };
    let mesh = shapes::rectangle(dvec3(0.2, 0.3, 0.0), across * 0.25, down * 0.25);
    parts::add(&mut scene, "mirror", mesh, parts::mirror());
    add_lamp(&mut scene, "lamp", dvec3(-0.2, 1.5, 0.0), 10.0);
    scene
}

#[test]
fn a_mirror_facing_nothing_is_not_traced() {
    let settings = to(0.02, 64);
    let idle = bake(mirror_over_floor(true), &settings);
    assert_eq!(idle.counts.rays, 0);
    let reason = &idle.plan.lights[0].reason;
    assert!(reason.contains("can send light to a diffuse surface"), "{reason}");
    let mut below_ceiling = mirror_over_floor(true);
    add_matte(
        &mut below_ceiling,
        "ceiling",
        shapes::rectangle(DVec3::Y * 2.5, DVec3::X, DVec3::Z),
    );
    let lit = bake(below_ceiling, &settings);
    assert_eq!(lit.maps.len(), 1, "the ceiling alone");
    let upright = bake(mirror_over_floor(false), &settings);
    assert!(
        upright.ledgers[0].energy_w.deposited > 0.01,
        "it lights the floor"
    );
}

#[test]
fn glass_lit_by_a_mirror_alone_is_found() {
    let mut scene = mirror_over_floor(true);
    // Over the lamp's plate, which hides it from the lamp, and in the mirror's light.
    let plate = shapes::rectangle(dvec3(0.45, 1.3, 0.0), DVec3::X * 0.5, DVec3::Z * 0.8);
    add_matte(&mut scene, "plate", plate);
    add_ball(&mut scene, "ball", dvec3(0.5, 0.9, 0.0), 0.15);
    let result = bake(scene, &to(0.02, 64));
    let (on, reason) = why(&result, Effect::Refraction);
    assert!(on, "{reason}");
    assert!(result.counts.rays > 0);
}

#[test]
fn dim_lamps_leave_rays_to_the_bright_one() {
    let target = 0.02;
    let mut scene = builtin_scene("ring");
    for lamp in 0..49 {
        let angle = f64::from(lamp) * 2.4;
        let place = dvec3(0.6 * angle.cos(), 1.0 + 0.01 * f64::from(lamp), 0.6 * angle.sin());
        add_lamp(&mut scene, &format!("lamp {lamp}"), place, 0.02);
    }
    let one = bake(builtin_scene("ring"), &to(target, 64));
    let fifty = bake(scene.clone(), &to(target, 64));
    let ratio = fifty.counts.rays as f64 / one.counts.rays as f64;
    // Each as careful as the first would be fifty times as many.
    assert!(ratio < 15.0, "{ratio}");
    let finer = bake(scene.clone(), &to(0.003, 64));
    let off = rmse(&floor(&fifty, &scene), &floor(&finer, &scene));
    assert!(off < 1.5 * target, "{off}");
}

/// Σ|E₁ − E₂|·A [W] over all maps; a map that one of them lacks counts as black.
fn difference_w(a: &Bake, b: &Bake) -> f64 {
    let only_in_b = b.maps.iter().filter(|map| same_map(a, map).is_none());
    let of_map = |map: &IlluminationMap| -> f64 {
        let [a, b] = [a, b].map(|result| caustic_like(result, map));
        let texels = a.iter().zip(&b).enumerate();
        texels
            .map(|(texel, (a, b))| (a - b).abs() * map.chart.texel_area_m2(texel))
            .sum()
    };
    a.maps.iter().chain(only_in_b).map(of_map).sum()
}

/// What a bake gave up [W].
fn given_up_w(result: &Bake) -> f64 {
    let ledgers = result.ledgers.iter();
    ledgers
        .map(|ledger| ledger.energy_w.truncated.total().abs())
        .sum()
}

/// Twice the noise of a bake [W]; 0 for splats, whose rays are not chosen by chance.
fn noise_w(result: &Bake, settings: &BakeSettings) -> f64 {
    if settings.estimator == Estimator::Splat {
        return 0.0;
    }
    let maps = result.maps.iter();
    let flux_w: f64 = maps.map(|map| map.flux_w(LayerKind::Caustic).luminance()).sum();
    2.0 * result.estimated_relative_rmse.unwrap_or(0.0) * flux_w
}

/// What the plan leaves out of random scenes changes no map by more than is booked, and noise; by bundles and by splats.
#[test]
fn the_plan_changes_no_map() {
    for (base, seeds) in [
        (to(0.03, 32), (0..200).step_by(4)),
        (settings(2_000.0, 32), (1..200).step_by(2)),
    ] {
        assert_plan_changes_nothing(&base, seeds);
    }
}

fn assert_plan_changes_nothing(base: &BakeSettings, seeds: impl Iterator<Item = u64>) {
    let everything = EffectSwitches::all_on()
        .with(Effect::Direct, EffectSwitch::Auto)
        .with(Effect::Indirect, EffectSwitch::Auto);
    let (mut cut, mut rays) = (0, [0, 0]);
    for seed in seeds {
        let [planned, forced] = [EffectSwitches::default(), everything.clone()].map(|effects| {
            let settings = BakeSettings {
                // Glass in boxes has branches without end.
                max_depth: Some(4),
                branch_threshold: Some(1e-2),
                effects,
                ..base.clone()
            };
            bake(random_scenes::scene(seed), &settings)
        });
        let off_w = difference_w(&planned, &forced);
        let booked_w = (given_up_w(&planned) - given_up_w(&forced)).abs();
        assert!(
            off_w <= booked_w + noise_w(&planned, base) + noise_w(&forced, base) + 1e-9,
            "scene {seed}: maps differ by {off_w:e} W, {booked_w:e} W are booked"
        );
        cut += u32::from(planned.plan.lights.iter().any(|light| !light.on));
        rays = [rays[0] + planned.counts.rays, rays[1] + forced.counts.rays];
    }
    assert!(cut > 10, "{cut} scenes have something that can be left out");
    assert!(rays[0] < rays[1]);
}
