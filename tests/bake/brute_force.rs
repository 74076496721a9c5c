//! References by brute force: they agree with the independent solver, know their own noise, and keep every watt.

use std::sync::Arc;

use nephroid::illumination::compare::relative_rmse;
use nephroid::progress::Control;
use nephroid::scene::Scene;
use nephroid::session::BakeResult;
use nephroid::settings::BakeSettings;
use nephroid::study::agreement::caustic_luminance;
use nephroid::study::brute_force::{brute_force, relative_noise};
use nephroid::transport::Tracer;

use crate::support;
use crate::tools::{builtin_scene, energy_fault, map_of, settings};

/// A scene's maps by brute force.
pub fn brute(scene: &Scene, settings: &BakeSettings, rays: u64) -> BakeResult {
    let tracer = Tracer::new(Arc::new(scene.clone()));
    brute_force(&tracer, settings, rays, &(), &Control::default()).expect("a reference")
}

#[test]
fn it_agrees_with_the_independent_solver_within_its_noise() {
    for (name, file, rays) in [("ring", "S1", 1_000_000), ("mirror", "S5", 800_000)] {
        let scene = builtin_scene(name);
        let result = brute(&scene, &settings(1.0, 64), rays);
        assert_eq!(energy_fault(&result), None, "{name}");
        let map = map_of(&result, &scene, "floor");
        let expected = box_means(&support::reference_map(file));
        let rmse = relative_rmse(&caustic_luminance(map), &expected).expect("light");
        let noise = map.estimated_relative_rmse.expect("a noise");
        assert!(noise < 0.03, "{name}: noise {noise}");
        assert!(
            (0.8..1.25).contains(&(rmse / noise)),
            "{name}: off by {rmse}, but the noise is said to be {noise}"
        );
    }
}

#[test]
fn its_noise_falls_faster_than_that_of_random_rays() {
    let scene = builtin_scene("ring");
    let noise = |rays| relative_noise(&brute(&scene, &settings(1.0, 32), rays).maps).expect("light");
    let (few, many) = (noise(20_000), noise(320_000));
    assert!(
        many < few / 4.5,
        "{few} with 20 k rays, {many} with 16 times as many"
    );
}

#[test]
fn neither_threads_nor_half_sets_leave_a_trace() {
    let scene = builtin_scene("ball");
    let with_threads = |threads, seed| {
        let settings = BakeSettings {
            threads,
            seed,
            ..settings(1.0, 16)
        };
        brute(&scene, &settings, 20_000)
    };
    let (one, three, other) = (with_threads(1, 0), with_threads(3, 0), with_threads(3, 1));
    assert_eq!(one.maps[0].layers, three.maps[0].layers);
    assert_eq!(one.maps[0].error, three.maps[0].error);
    assert_ne!(one.maps[0].layers, other.maps[0].layers);
}

#[test]
fn it_asks_for_a_map_size_and_a_number_of_rays() {
    let tracer = Tracer::new(Arc::new(builtin_scene("mirror")));
    let refuse = |settings: &BakeSettings, rays, word| {
        let error = brute_force(&tracer, settings, rays, &(), &Control::default()).expect_err(word);
        assert!(error.to_string().contains(word), "{error}");
    };
    refuse(&BakeSettings::default(), 10_000, "--map-resolution");
    refuse(&settings(1.0, 16), 10, "--rays");
    let control = Control::default();
    control.cancel();
    let stopped = brute_force(&tracer, &settings(1.0, 16), 10_000, &(), &control);
    assert!(stopped.is_err(), "a stopped run gives no reference");
}

/// 64×64 means of a 256×256 map.
fn box_means(values: &[f64]) -> Vec<f64> {
    let mut means = vec![0.0; 64 * 64];
    for (index, value) in values.iter().enumerate() {
        means[index / 256 / 4 * 64 + index % 256 / 4] += value / 16.0;
    }
    means
}
