//! Scenes that estimators find hard, against brute force on the same meshes.

use nephroid::scene::Scene;
use nephroid::scene::builtin::parts;
use nephroid::settings::BakeSettings;

use crate::brute_force::compare_with_brute_force;
use crate::hard_scenes::{self, Shading, TinyBall};
use crate::tools::{bake, energy_fault, settings};

/// All scenes.
fn all() -> Vec<Scene> {
    let mut scenes = Vec::new();
    for segments in [64, 256, 1024] {
        for shading in [Shading::Smooth, Shading::Flat] {
            scenes.push(hard_scenes::ring(segments, shading));
        }
    }
    scenes.extend([
        hard_scenes::ring_with_blocker(),
        hard_scenes::ball_with_blocker(),
        hard_scenes::torus(parts::mirror()),
        hard_scenes::torus(parts::dielectric("glass", 1.5)),
        hard_scenes::grazing_pool(),
        hard_scenes::mirror_bowl(),
        hard_scenes::glass_bowl(),
        hard_scenes::cut_glass(),
        hard_scenes::tiny_ball(TinyBall::Both),
        hard_scenes::balls_in_series(),
        hard_scenes::ball_in_a_room(),
        hard_scenes::with_tilted_floor(hard_scenes::ball()),
        hard_scenes::with_cut_floor(hard_scenes::ball()),
        hard_scenes::with_tilted_floor(hard_scenes::grazing_pool()),
        hard_scenes::with_cut_floor(hard_scenes::grazing_pool()),
    ]);
    scenes
}

#[test]
fn splats_lose_no_watt_on_hard_scenes() {
    for scene in all() {
        let result = bake(scene.clone(), &settings(2e3, 64));
        assert_eq!(energy_fault(&result), None, "{}", scene.name);
        let deposited = result.ledgers[0].energy_w.deposited;
        assert!(deposited > 0.0, "{}: nothing arrived", scene.name);
    }
}

/// Figures of all scenes: `cargo test --release --test bake -- --ignored --nocapture figures`.
#[test]
#[ignore = "prints figures; takes minutes"]
#[allow(clippy::print_stdout, reason = "it is a report")]
fn figures() {
    let number = |name: &str, otherwise: f64| {
        std::env::var(name)
            .ok()
            .and_then(|value| value.parse().ok())
            .unwrap_or(otherwise)
    };
    let settings: BakeSettings = settings(number("DENSITY", 1e6), 64);
    let rays = number("RAYS", 1e6) as u64;
    let only = std::env::var("SCENE").unwrap_or_default();
    for scene in all().into_iter().filter(|scene| scene.name.contains(&only)) {
        let start = cpu_time::ProcessTime::now();
        let reference = crate::brute_force::brute(&scene, &settings, rays);
        let brute_s = start.elapsed().as_secs_f64();
        let result = bake(scene.clone(), &settings);
        let distance = crate::brute_force::distance(&result, &reference);
        println!(
            "{:32} rmse {:6.2} % noise {:5.2} % flux {:.5} | {} rays, {:.2} s CPU | brute {} rays {:.2} s",
            scene.name,
            100.0 * distance.relative_rmse,
            100.0 * distance.noise,
            distance.flux_ratio,
            distance.rays,
            result.cpu_s.plan + result.cpu_s.trace + result.cpu_s.deposit,
            reference.counts.rays,
            brute_s,
        );
    }
}
