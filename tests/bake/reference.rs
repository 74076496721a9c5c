//! The built-in scenes, and the same as glTF files, against maps of an independent solver (`assets/reference`).

use glam::{DMat3, DVec3};
use nephroid::illumination::compare::relative_rmse;
use nephroid::scene::{LoadOptions, Scene, load};

use crate::support::{self, assert_close};
use crate::tools::{bake, builtin_scene, caustic, energy_fault, map_of, settings, transformed};

/// One reference: built-in and file name, density [1/sr], largest relative RMSE, watts on the floor and elsewhere.
struct Reference {
    builtin: &'static str,
    file: &'static str,
    density_per_sr: f64,
    largest_rmse: f64,
    floor_w: f64,
    /// Left the scene, where the solver says so.
    escaped_w: Option<f64>,
}

const REFERENCES: [Reference; 5] = [
    Reference {
        builtin: "ring",
        file: "S1",
        density_per_sr: 1e5,
        largest_rmse: 0.10,
        floor_w: 6.992_461,
        escaped_w: Some(0.0),
    },
    Reference {
        builtin: "ball",
        file: "S2",
        density_per_sr: 1e5,
        largest_rmse: 0.10,
        floor_w: 1.090_823,
        escaped_w: Some(0.092_578 + 0.125_041),
    },
    Reference {
        builtin: "mirror",
        file: "S5",
        density_per_sr: 1e6,
        largest_rmse: 0.03,
        floor_w: 1.286_660,
        escaped_w: Some(0.016_970),
    },
    Reference {
        builtin: "slab",
        file: "S6",
        density_per_sr: 2e5,
        largest_rmse: 0.03,
        floor_w: 6.490_964,
        escaped_w: None,
    },
    Reference {
        builtin: "nephroid",
        file: "S8",
        density_per_sr: 3e5,
        largest_rmse: 0.06,
        floor_w: 0.966_650,
        escaped_w: Some(0.832_455),
    },
];

/// Bakes at 256×256 and checks map, watts and ledger. `irradiance_scale` is what a transformation does to E.
fn check(reference: &Reference, scene: &Scene, floor: &str, irradiance_scale: f64, area_scale: f64) {
    let result = bake(scene.clone(), &settings(reference.density_per_sr, 256));
    let name = reference.builtin;
    let image: Vec<f64> = caustic(map_of(&result, scene, floor))
        .iter()
        .map(|e| e / irradiance_scale)
        .collect();
    let expected = support::reference_map(reference.file);
    let rmse = relative_rmse(&image, &expected).expect("a reference with light");
    assert!(
        rmse <= reference.largest_rmse,
        "{name}: relative RMSE {:.2} %",
        100.0 * rmse
    );
    assert_eq!(energy_fault(&result), None, "{name}");
    let energy = &result.ledgers[0].energy_w;
    let scale = irradiance_scale * area_scale;
    assert_close(
        energy.deposited,
        reference.floor_w * scale,
        0.005,
        &format!("{name}: watts on the floor"),
    );
    if let Some(escaped_w) = reference.escaped_w {
        let off = (energy.escaped - escaped_w * scale).abs();
        let share = off / (energy.emitted);
        assert!(
            share <= 0.005,
            "{name}: escaped {} W instead of {escaped_w} W",
            energy.escaped / scale
        );
    }
}

#[test]
fn built_in_scenes_agree_with_the_independent_solver() {
    for reference in &REFERENCES {
        check(reference, &builtin_scene(reference.builtin), "floor", 1.0, 1.0);
    }
}

#[test]
fn the_solvers_own_files_agree_with_its_maps() {
    for reference in &REFERENCES {
        let Some(path) = support::shared_or_skip(&format!("oracle/{}.glb", reference.file)) else {
            continue;
        };
        let path = path.to_str().expect("a readable path");
        let scene = load(path, &LoadOptions::default()).expect("a valid file");
        check(reference, &scene, "floor", 1.0, 1.0);
    }
}

#[test]
fn turned_scaled_and_renamed_scenes_agree_alike() {
    let rotation = DMat3::from_axis_angle(DVec3::new(0.3, -0.8, 0.52).normalize(), 1.234);
    let scale = 3.7;
    for reference in REFERENCES
        .iter()
        .filter(|reference| ["ring", "mirror", "slab"].contains(&reference.builtin))
    {
        let mut scene = transformed(
            builtin_scene(reference.builtin),
            rotation,
            scale,
            DVec3::new(5.0, -3.0, 11.0),
        );
        for object in scene.objects.iter_mut().filter(|object| object.name == "floor") {
            object.name = "Tischplatte ✓".into();
        }
        // A point light's irradiance falls with the square of the size.
        check(
            reference,
            &scene,
            "Tischplatte ✓",
            1.0 / (scale * scale),
            scale * scale,
        );
    }
    let nephroid = REFERENCES
        .iter()
        .find(|reference| reference.builtin == "nephroid")
        .expect("in the list");
    let scene = transformed(builtin_scene("nephroid"), rotation, scale, DVec3::ZERO);
    // A sun's does not.
    check(nephroid, &scene, "floor", 1.0, scale * scale);
}
