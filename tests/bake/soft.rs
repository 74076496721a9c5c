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

#[test]
fn explore() {
    for name in ["mirror", "ball"] {
        for roughness in [0.05, 0.2, 0.5] {
            let scene = roughened(name, roughness);
            let cpu = cpu_time::ProcessTime::now();
            let result = bake(scene.clone(), &towards(0.02, 64));
            println!(
                "{name} {roughness}: est {:?} rays {} cpu {:.2?} stop {:?} {:?} {:?}",
                result.estimated_relative_rmse,
                result.counts.rays,
                cpu.elapsed(),
                result.stop_reason,
                energy_fault(&result),
                result.ledgers[0].energy_w
            );
            for point in &result.course {
                println!("   {} {} {}", point.rays, point.cpu_s, point.relative_rmse);
            }
            let cpu = cpu_time::ProcessTime::now();
            let reference = brute(&scene, &settings(1.0, 64), 4_000_000);
            let reference_noise = reference.maps[0].estimated_relative_rmse;
            println!(
                "   true {:?} noise {:?} brute {:.2?} cpu {:?} {:?}",
                relative_rmse(&floor(&result, &scene), &floor(&reference, &scene)),
                reference_noise,
                cpu.elapsed(),
                result.cpu_s.trace,
                reference.ledgers[0].energy_w
            );
        }
    }
}
