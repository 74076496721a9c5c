//! Scenes that estimators find hard, against brute force on the same meshes.

use nephroid::scene::Scene;
use nephroid::scene::builtin::parts;
use nephroid::session::BakeResult;
use nephroid::settings::BakeSettings;
use nephroid::study::agreement::{Agreement, caustic_luminance, pair_maps};

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
        if let Ok(folder) = std::env::var("PICTURES") {
            write_pictures(std::path::Path::new(&folder), &scene, &result, &reference);
        }
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
        for map in &reference.maps {
            let name = &scene.objects[map.chart.object].name;
            let only: Vec<_> = [&result, &reference]
                .map(|bake| {
                    bake.maps
                        .iter()
                        .filter(|m| m.chart.object == map.chart.object)
                        .cloned()
                        .collect()
                })
                .into_iter()
                .collect::<Vec<Vec<_>>>();
            let pairs = pair_maps(&only[0], &only[1]).expect("maps of one size");
            let agreement = Agreement::of(&pairs).expect("light");
            let noise = map.estimated_relative_rmse.unwrap_or(0.0);
            println!(
                "    {name:12} rmse with noise {:6.2} % noise {:5.2} % ard {:5.2} % peak {:.3}",
                100.0 * agreement.relative_rmse,
                100.0 * noise,
                100.0 * agreement.average_relative_difference,
                agreement.peak_ratio,
            );
        }
    }
}

/// For each map of the reference, side by side: the bake, the reference (logarithmic, black at a hundredth of the mean,
/// white at a hundred times it), and their difference (red brighter, blue darker, full at the mean).
fn write_pictures(folder: &std::path::Path, scene: &Scene, result: &BakeResult, reference: &BakeResult) {
    for map in &reference.maps {
        let (width, height) = (map.width(), map.height());
        let truth = caustic_luminance(map);
        let mean = truth.iter().sum::<f64>() / truth.len() as f64;
        let baked = result
            .maps
            .iter()
            .find(|other| other.chart.object == map.chart.object)
            .map_or_else(|| vec![0.0; truth.len()], caustic_luminance);
        let grey = |e: f64| {
            let level = (255.0 * (((e / mean).max(1e-9).log10() + 2.0) / 4.0).clamp(0.0, 1.0)) as u8;
            [level, level, level, 255]
        };
        let difference = |image: f64, truth: f64| {
            let share = ((image - truth) / mean).clamp(-1.0, 1.0);
            let fade = (255.0 * (1.0 - share.abs())) as u8;
            if share > 0.0 {
                [255, fade, fade, 255]
            } else {
                [fade, fade, 255, 255]
            }
        };
        const SCALE: usize = 6;
        let mut rgba = Vec::new();
        for row in 0..height * SCALE {
            for column in 0..3 * width * SCALE {
                let texel = row / SCALE * width + column / SCALE % width;
                rgba.extend(match column / (width * SCALE) {
                    0 => grey(baked[texel]),
                    1 => grey(truth[texel]),
                    _ => difference(baked[texel], truth[texel]),
                });
            }
        }
        let size = ((3 * width * SCALE) as u32, (height * SCALE) as u32);
        let png = nephroid::export::png::encode(size.0, size.1, rgba, "picture").expect("a picture");
        let name = format!("{}_{}.png", scene.name, scene.objects[map.chart.object].name);
        std::fs::write(folder.join(name), png).expect("a writable folder");
    }
}
