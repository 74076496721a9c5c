//! Soft caustics: lights with a size and rough surfaces, against brute force, against their limits, and against the law of
//! energy.

use glam::DVec3;
use nephroid::illumination::compare::relative_rmse;
use nephroid::optics::LinearSrgb;
use nephroid::scene::{Light, LightKind, LightSize, PanelShape, Scene};
use nephroid::session::BakeResult;
use nephroid::settings::BakeSettings;
use nephroid::study::agreement::caustic_luminance;
use nephroid::units::Radiance;

use crate::brute_force::brute;
use crate::tools::{at, bake, builtin_scene, energy_fault, map_of, settings};

/// A square lamp of a side [m] around a place, with the power [W] of a point light whose intensity downwards is that of
/// the lamp on its axis.
fn square_lamp(centre: DVec3, side_m: f64, axial_w_per_sr: f64) -> Light {
    Light {
        name: "lamp".into(),
        colour: LinearSrgb::WHITE,
        kind: LightKind::Panel {
            centre,
            across: DVec3::X * (0.5 * side_m),
            down: DVec3::Z * (0.5 * side_m),
            shape: PanelShape::Rectangle,
            radiance: Radiance(axial_w_per_sr / (side_m * side_m)),
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

#[test]
fn explore() {
    let mut scene = builtin_scene("ring");
    let place = scene.lights[0].kind.position().expect("a point light");
    for side_m in [0.05, 0.2, 0.5] {
        scene.lights = vec![square_lamp(place, side_m, 8.0)];
        for target in [0.1, 0.03] {
            let began = std::time::Instant::now();
            let cpu = cpu_time::ProcessTime::now();
            let result = bake(scene.clone(), &towards(target, 64));
            println!(
                "side {side_m} target {target}: est {:?} rays {} wall {:.2?} cpu {:.2?} stop {:?} {:?}",
                result.estimated_relative_rmse,
                result.counts.rays,
                began.elapsed(),
                cpu.elapsed(),
                result.stop_reason,
                energy_fault(&result)
            );
            for point in &result.course {
                println!("   {point:?}");
            }
            let began = std::time::Instant::now();
            let reference = brute(&scene, &settings(1.0, 64), 6_000_000);
            let reference_noise = reference.maps[0].estimated_relative_rmse;
            println!(
                "   true {:?} noise {:?} brute {:.2?} cpu {:?}",
                relative_rmse(&floor(&result, &scene), &floor(&reference, &scene)),
                reference_noise,
                began.elapsed(),
                result.cpu_s
            );
        }
    }
}
