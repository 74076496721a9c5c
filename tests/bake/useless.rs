//! What can send no light to a diffuse surface costs nothing after the plan, and changes not a bit.

use glam::DVec3;
use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::optics::LinearSrgb;
use nephroid::plan::EffectPlan;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Light, LightKind, Scene};
use nephroid::session::BakeResult;
use nephroid::settings::{BakeSettings, Estimator};
use nephroid::units::{Flux, RadiantIntensity};

use super::tools::{at, bake, bits, builtin_scene, map_of, settings};

fn matte() -> nephroid::scene::Material {
    parts::matte("matte", LinearSrgb::grey(0.5))
}

fn add_box(scene: &mut Scene, name: &str, centre: DVec3, half: DVec3) {
    let mesh = shapes::cuboid(centre - half, centre + half);
    parts::add(scene, name, mesh, matte());
}

fn add_ball(scene: &mut Scene, name: &str, centre: DVec3, radius: f64) {
    let glass = parts::dielectric("glass", 1.5);
    parts::add(scene, name, shapes::sphere(centre, radius, 2), glass);
}

/// Glass in a sealed opaque box, which the light sees.
fn add_sealed_ball(scene: &mut Scene) {
    let centre = DVec3::new(-0.88, 0.38, 0.88);
    add_box(scene, "box", centre, DVec3::splat(0.06));
    add_ball(scene, "sealed", centre, 0.04);
}

/// A hundred small glass balls behind a wall, which stands across the way from the light.
fn add_hidden_balls(scene: &mut Scene) {
    let (from, middle) = (DVec3::new(-0.7, 1.2, 0.0), DVec3::new(-0.86, 0.3, -0.86));
    let away = (middle - from).normalize();
    let (across, down) = away.any_orthonormal_pair();
    let wall = shapes::rectangle(middle - away * 0.03, across * 0.1, down * 0.1);
    parts::add(scene, "wall", wall, matte());
    for index in 0..100 {
        let place = |step: i32| (f64::from(step) - 4.5) * 0.012;
        let centre = middle + across * place(index % 10) + down * place(index / 10);
        add_ball(scene, &format!("hidden{index}"), centre, 0.005);
    }
}

fn spot(name: &str, position: DVec3, direction: DVec3) -> Light {
    Light {
        name: name.into(),
        colour: LinearSrgb::WHITE,
        spectrum: None,
        kind: LightKind::Spot {
            position,
            direction: direction.normalize(),
            intensity: RadiantIntensity(5.0),
            inner_cone_rad: 0.1,
            outer_cone_rad: 0.3,
        },
        size: nephroid::scene::LightSize::None,
    }
}

/// Lamps that see nothing specular: in opaque boxes, aimed away, and close above a plate that hides the rest.
fn add_useless_lights(scene: &mut Scene) {
    for index in 0..4 {
        let centre = DVec3::new(0.86, 0.05 + 0.1 * f64::from(index), 0.92);
        add_box(scene, &format!("lantern{index}"), centre, DVec3::splat(0.02));
        let lamp = parts::point_light(&format!("sealed{index}"), centre, Flux(10.0));
        scene.lights.push(lamp);
    }
    for index in 0..4 {
        let place = DVec3::new(0.9, 0.35, -0.95 + 0.02 * f64::from(index));
        let away = DVec3::new(1.0, 0.2 * f64::from(index), 0.0);
        scene.lights.push(spot(&format!("away{index}"), place, away));
    }
    for index in 0..2 {
        let place = DVec3::new(0.93, 0.38, -0.75 - 0.12 * f64::from(index));
        let plate = shapes::rectangle(place - DVec3::X * 0.005, DVec3::Y * 0.04, DVec3::Z * 0.04);
        parts::add(scene, &format!("plate{index}"), plate, matte());
        scene
            .lights
            .push(spot(&format!("shut{index}"), place, DVec3::NEG_X));
    }
}

fn crowded() -> Scene {
    let mut scene = builtin_scene("ring");
    let bounds = scene.bounds().expect("surfaces");
    add_sealed_ball(&mut scene);
    add_hidden_balls(&mut scene);
    add_useless_lights(&mut scene);
    assert_eq!(scene.bounds(), Some(bounds), "all of it lies within the scene");
    assert_eq!(scene.lights.len(), 11);
    scene
}

fn line(plan: &EffectPlan, effect: Effect) -> (bool, String) {
    let line = plan.effects.iter().find(|line| line.effect == effect);
    let line = line.expect("a line for every effect");
    (line.on, line.reason.clone())
}

fn all_settings() -> [BakeSettings; 3] {
    let refined = BakeSettings {
        max_error: Some(0.03),
        ..at(BakeSettings::starting_density_per_sr(0.03), 128)
    };
    [at(10_000.0, 128), refined, settings(20_000.0, 128)]
}

#[test]
fn a_crowd_of_useless_things_costs_not_one_caustic_ray_and_changes_not_a_bit() {
    for settings in all_settings() {
        let plain = builtin_scene("ring");
        let alone = bake(plain.clone(), &settings);
        let scene = crowded();
        let among = bake(scene.clone(), &settings);
        let what = format!("{:?}, target {:?}", settings.estimator, settings.max_error);
        assert_eq!(among.counts.rays, alone.counts.rays, "rays, {what}");
        assert_eq!(among.counts.segments, alone.counts.segments, "segments, {what}");
        assert!(alone.counts.rays > 1000);
        assert_eq!(among.maps.len(), 1, "only the floor is lit");
        let [a, b] =
            [(&alone, &plain), (&among, &scene)].map(|(result, scene)| map_of(result, scene, "floor"));
        assert!(bits(a) == bits(b), "not the same to the bit: {what}");
        assert!(a.error == b.error, "errors, {what}");
        // The plan knows why.
        let refraction = among
            .effects
            .iter()
            .find(|report| report.line.effect == Effect::Refraction);
        assert_eq!(
            refraction.map(|report| report.counts.rays),
            Some(0),
            "glass that no light reaches"
        );
        assert_eq!(among.plan.lights.iter().filter(|light| light.on).count(), 1);
        if settings.estimator == Estimator::Wavefront {
            report(&alone, &among);
        }
    }
}

/// Item-buffer tests are counted apart, and their time is told light by light.
fn report(alone: &BakeResult, among: &BakeResult) {
    assert!(among.counts.item_buffer_tests > alone.counts.item_buffer_tests);
    assert_eq!(among.counts.item_buffer_rays, 0);
    let tests: u64 = among.item_buffers.iter().map(|buffer| buffer.tests).sum();
    assert_eq!(tests, among.counts.item_buffer_tests);
    for (buffer, light) in among.item_buffers.iter().zip(&among.plan.lights) {
        println!(
            "{}: {} tests, {} cells, {} hidden, {:.2} ms; {}",
            buffer.light, buffer.tests, buffer.cells, buffer.hidden_cells, buffer.cpu_ms, light.reason
        );
    }
    assert!(
        among.item_buffers[0].hidden_cells > 10,
        "the wall hides the balls"
    );
    // A sealed lamp is not even looked around from.
    assert_eq!(among.item_buffers[1].tests, 0);
    assert!(
        among.item_buffers[9].hidden_cells > 10,
        "the plate hides the ring"
    );
}

#[test]
fn forced_on_everything_is_looked_for_all_the_same() {
    let mut settings = at(4_000.0, 64);
    let auto = bake(crowded(), &settings);
    settings.effects = EffectSwitches::default().with(Effect::LightPass, EffectSwitch::On);
    let forced = bake(crowded(), &settings);
    assert!(forced.counts.rays > auto.counts.rays);
    assert!(forced.counts.segments > auto.counts.segments);
    let scene = crowded();
    let (a, b) = (map_of(&auto, &scene, "floor"), map_of(&forced, &scene, "floor"));
    assert!(bits(a) == bits(b), "what is looked for in vain changes nothing");
}

/// A wall with a crack between its halves, wide enough for light or not there at all.
fn behind_a_wall(crack_m: f64) -> Scene {
    let mut scene = parts::reference_scene(1.0);
    add_ball(&mut scene, "ball", DVec3::new(0.3, 0.4, 0.0), 0.2);
    for (name, side) in [("left", -1.0), ("right", 1.0)] {
        let centre = DVec3::new(-0.3, 0.45, side * (0.5 + 0.5 * crack_m));
        let half = shapes::rectangle(centre, DVec3::Y * 0.45, DVec3::Z * 0.5);
        parts::add(&mut scene, name, half, matte());
    }
    let lamp = parts::point_light("lamp", DVec3::new(-0.8, 0.4, 0.0), Flux(10.0));
    scene.lights.push(lamp);
    scene
}

#[test]
fn a_wall_hides_unless_light_comes_through_or_past_it() {
    let settings = at(100_000.0, 64);
    let shut = bake(behind_a_wall(0.0), &settings);
    assert_eq!(shut.counts.rays, 0);
    assert!(shut.maps.is_empty());
    let (on, reason) = line(&shut.plan, Effect::LightPass);
    assert!(!on && reason.contains("no light sees"), "{reason}");
    assert!(
        shut.plan.lights[0].reason.contains("hide"),
        "{:?}",
        shut.plan.lights
    );
    // A crack of a fifth of a lattice step: cells that it crosses are traced.
    let ajar = bake(behind_a_wall(4e-4), &settings);
    assert!(ajar.counts.rays > 0);
    // Wide open.
    let open = bake(behind_a_wall(0.3), &settings);
    assert!(open.ledgers[0].energy_w.deposited > 0.01);
}

/// A mirror on the ground, as seen by a lamp over it, over a floor beneath it.
fn mirror_over_floor(facing_up: bool, with_ceiling: bool) -> Scene {
    let mut scene = parts::reference_scene(1.0);
    let (across, down) = if facing_up {
        (DVec3::Z, DVec3::X)
    } else {
        (DVec3::Y, DVec3::Z)
    };
    let centre = DVec3::new(0.2, 0.3, 0.0);
    let mesh = shapes::rectangle(centre, across * 0.25, down * 0.25);
    parts::add(&mut scene, "mirror", mesh, parts::mirror());
    if with_ceiling {
        let ceiling = shapes::rectangle(DVec3::new(0.0, 2.5, 0.0), DVec3::X, DVec3::Z);
        parts::add(&mut scene, "ceiling", ceiling, matte());
    }
    scene
        .lights
        .push(parts::point_light("lamp", DVec3::new(-0.2, 1.5, 0.0), Flux(10.0)));
    scene
}

#[test]
fn a_mirror_that_faces_nothing_diffuse_is_not_traced() {
    let settings = at(10_000.0, 64);
    let idle = bake(mirror_over_floor(true, false), &settings);
    assert_eq!(idle.counts.rays, 0);
    assert!(
        idle.plan.lights[0]
            .reason
            .contains("can send light to a diffuse surface"),
        "{:?}",
        idle.plan.lights
    );
    let lit = bake(mirror_over_floor(true, true), &settings);
    assert_eq!(lit.maps.len(), 1, "the ceiling alone");
    let upright = bake(mirror_over_floor(false, false), &settings);
    assert!(
        upright.ledgers[0].energy_w.deposited > 0.01,
        "it lights the floor"
    );
}

#[test]
fn glass_that_only_a_mirror_lights_is_found_by_way_of_it() {
    let mut scene = mirror_over_floor(true, false);
    // Over the lamp's plate, which hides it from the lamp, and in the mirror's light.
    let plate = shapes::rectangle(DVec3::new(0.45, 1.3, 0.0), DVec3::X * 0.5, DVec3::Z * 0.8);
    parts::add(&mut scene, "plate", plate, matte());
    add_ball(&mut scene, "ball", DVec3::new(0.5, 0.9, 0.0), 0.15);
    let result = bake(scene, &at(10_000.0, 64));
    let (on, reason) = line(&result.plan, Effect::Refraction);
    assert!(on, "{reason}");
    assert!(result.counts.rays > 0);
}
