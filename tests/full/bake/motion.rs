//! Light that moves: where the closed form has it, without flicker, and baked again only where something moves.

use crate::bake::common::{assert_fresh, floor, rmse, run, session};
use support::prelude::*;
use support::tools::{bake, builtin_scene, photons, set, settings, to};

/// Seconds from one moment to the next.
const STEP_S: f64 = 0.04;

/// A ball of glass and a sheet of running water with a lamp above each, and a screen between them.
fn ball_and_water() -> Scene {
    let mut scene = parts::reference_scene(2.0);
    let ball = shapes::sphere(dvec3(-0.9, 0.5, 0.0), 0.3, 3);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    let wave = Wave::on_water(0.01, [9.0, 4.0], 0.3, 0.5);
    let water = Material {
        waves: Waves::new(vec![wave]).ok(),
        ..parts::dielectric("water", 1.333)
    };
    let sheet = shapes::floor([0.5, 1.3], [-0.4, 0.4], 0.5);
    parts::add(&mut scene, "water", sheet, water);
    let screen = shapes::rectangle(DVec3::Y, DVec3::Z * 2.0, DVec3::Y);
    parts::add(
        &mut scene,
        "screen",
        screen,
        parts::matte("screen", LinearSrgb::grey(0.5)),
    );
    for (name, x) in [("over ball", -0.9), ("over water", 0.9)] {
        let place = dvec3(x, 1.9, 0.0);
        let lamp = parts::beam(name, place, DVec3::NEG_Y, 0.2, Flux(10.0));
        scene.lights.push(lamp);
    }
    scene
}

/// A scene with one of its lamps alone.
fn lit_by(scene: &Scene, lamp: usize) -> Scene {
    let mut scene = scene.clone();
    scene.lights = vec![scene.lights[lamp].clone()];
    scene
}

/// Of photons, splats, and bundles towards two errors.
fn all_ways() -> [BakeSettings; 4] {
    [to(0.01, 48), photons(4e4, 48), settings(2e4, 48), to(0.08, 48)]
}

#[test]
fn a_lamp_that_sees_nothing_moving_keeps_its_maps() {
    let scene = ball_and_water();
    for settings in all_ways() {
        let mut session = session(&scene);
        run(&mut session, &settings);
        for step in 1..4 {
            let moment = scene.at(STEP_S * f64::from(step));
            session
                .set_scene(Arc::new(moment.clone()))
                .expect("a sound scene");
            let what = format!("{:?}, step {step}", settings.estimator);
            let (now, fresh) = assert_fresh(&mut session, &settings, &what);
            let [still, moving] = [0, 1].map(|lamp| bake(lit_by(&moment, lamp), &settings).counts.rays);
            assert!(still > 0 && moving > 0);
            if settings.max_error.is_none() {
                assert_eq!(fresh.counts.rays, still + moving, "{what}");
                assert_eq!(now.counts.rays, moving, "{what}");
            }
            assert!(now.counts.rays < fresh.counts.rays, "{what}");
        }
    }
}

/// A ball that is carried about, past the screen and into the light of the other lamp.
#[test]
fn what_comes_into_the_light_of_a_lamp_is_seen() {
    let scene = ball_and_water();
    let places = [
        (0.05, 0.0, 0.02),
        (1.75, 0.4, 0.1),
        (1.8, 0.45, 0.1),
        (0.0, 0.0, 0.0),
        (1.8, -0.35, 0.0),
    ];
    let mut kept = 0;
    for settings in [to(0.03, 32), photons(6e3, 32), to(0.2, 32)] {
        let mut session = session(&scene);
        run(&mut session, &settings);
        for (x, y, z) in places {
            let motion = Motion::turned(x, dvec3(x, y, z));
            let moved = Edit::Place(1, motion).apply(&scene).expect("a sound edit");
            session.set_scene(Arc::new(moved)).expect("a sound scene");
            let what = format!("{:?}, ball moved by {x} {y} {z}", settings.estimator);
            let (now, fresh) = assert_fresh(&mut session, &settings, &what);
            kept += usize::from(now.counts.rays < fresh.counts.rays);
        }
    }
    assert!((3..15).contains(&kept), "kept something {kept} times of 15");
}

/// Frames have the same seed: what differs between two moments that are next to each other is the light, not its noise.
#[test]
fn noise_stands_still_from_frame_to_frame() {
    let pool = builtin_scene("pool");
    let settings = photons(3e3, 48);
    let of = |time_s: f64, seed: u64| {
        let settings = set(settings.clone(), |s| s.seed = seed);
        let moment = pool.at(time_s);
        floor(&bake(moment.clone(), &settings), &moment)
    };
    let frames = [0.5, 0.5 + 1e-5].map(|time_s| of(time_s, 0));
    let [flicker, noise] = [&frames[1], &of(0.5, 1)].map(|other| rmse(other, &frames[0]));
    assert!(noise > 0.05, "nothing to see: {noise}");
    assert!(flicker < 0.05 * noise, "flicker {flicker}, noise {noise}");
}
