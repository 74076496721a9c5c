//! Photons against brute force, against the law of energy, and against themselves.

use glam::DVec3;
use nephroid::illumination::IlluminationMap;
use nephroid::optics::luminance;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{LightKind, LightSize, Material, PanelShape, Scene};
use nephroid::session::BakeResult;
use nephroid::settings::{BakeSettings, Estimator, LayerKind, MapResolution};
use nephroid::units::Radiance;

use support::brute_force::brute;
use support::hard_scenes::cut_glass;
use support::tools::{bake, bits, builtin_scene, caustic, energy_fault, map_of, photons};

const SIDE: usize = 64;
const BLOCK: usize = 8;
/// Fine enough that light is smooth from texel to texel.
const FINE: MapResolution = MapResolution::Fixed {
    width: 256,
    height: 256,
};

fn ring_under_square_lamp() -> Scene {
    let mut scene = builtin_scene("ring");
    scene.lights[0].kind = LightKind::Panel {
        centre: scene.lights[0].kind.position().expect("a point light"),
        across: DVec3::X * 0.15,
        down: DVec3::Z * 0.15,
        shape: PanelShape::Rectangle,
        radiance: Radiance(80.0),
    };
    scene
}

fn nephroid_under_the_sun() -> Scene {
    let mut scene = builtin_scene("nephroid");
    scene.lights[0].size = LightSize::Angle {
        diameter_rad: 0.53_f64.to_radians(),
    };
    scene
}

fn frosted_ball(roughness: f64) -> Scene {
    let mut scene = builtin_scene("ball");
    let is_glass = |material: &&mut Material| material.surface.is_specular();
    for material in scene.materials.iter_mut().filter(is_glass) {
        material.roughness = roughness;
    }
    scene
}

/// Green glass around a lamp, so that paths absorb, split and start inside a body.
fn lamp_in_green_glass() -> Scene {
    let mut scene = builtin_scene("mirror");
    scene.objects.truncate(1);
    let lamp = scene.lights[0].kind.position().expect("a point light");
    let mut glass = parts::dielectric("green glass", 1.5);
    glass.volume = Some(nephroid::scene::Volume {
        attenuation_colour: nephroid::optics::LinearSrgb::new(0.2, 0.8, 0.3),
        attenuation_distance_m: 0.3,
    });
    parts::add(&mut scene, "bulb", shapes::sphere(lamp, 0.2, 3), glass);
    scene
}

/// Blocks of a map whose means are more than three standard errors apart.
fn outliers(result: &BakeResult, reference: &BakeResult, scene: &Scene, receiver: &str) -> usize {
    let [ours, theirs] = [result, reference].map(|result| map_of(result, scene, receiver));
    let [a, b] = [ours, theirs].map(caustic);
    let square = |map: &IlluminationMap, texel: usize| {
        map.error
            .as_ref()
            .map_or(0.0, |error| f64::from(error[texel]).powi(2))
    };
    let blocks = (0..SIDE / BLOCK).flat_map(|row| (0..SIDE / BLOCK).map(move |column| (row, column)));
    let is_outlier = |&(row, column): &(usize, usize)| {
        let texels = (0..BLOCK * BLOCK)
            .map(|index| (row * BLOCK + index / BLOCK) * SIDE + column * BLOCK + index % BLOCK);
        let (difference, variance) = texels.fold((0.0, 0.0), |(difference, variance), texel| {
            (
                difference + a[texel] - b[texel],
                variance + square(ours, texel) + square(theirs, texel),
            )
        });
        difference.abs() > 3.0 * variance.sqrt()
    };
    blocks.filter(is_outlier).count()
}

/// Of 64 blocks chance alone puts more than three beyond three standard errors once in 20,000 times.
#[test]
fn photons_are_unbiased() {
    for (what, scene, density_per_sr) in [
        ("glass ball", builtin_scene("ball"), 1e6),
        ("cut glass", cut_glass(), 1e6),
        ("prism", builtin_scene("prism"), 3e10),
        ("square lamp", ring_under_square_lamp(), 1e5),
        ("disc of the sun", nephroid_under_the_sun(), 2e6),
        ("frosted ball", frosted_ball(0.3), 1e6),
        ("lamp in green glass", lamp_in_green_glass(), 3e4),
    ] {
        let result = bake(scene.clone(), &photons(density_per_sr, SIDE));
        assert_eq!(energy_fault(&result), None, "{what}");
        let reference = brute(&scene, &photons(density_per_sr, SIDE), 60_000);
        let count = outliers(
            &result,
            &reference,
            &scene,
            if what == "prism" { "wall" } else { "floor" },
        );
        println!(
            "{what}: {} photons, {count} outliers, {:?}",
            result.counts.rays, result.estimated_relative_rmse
        );
        assert!(count <= 3, "{what}: {count} blocks");
    }
}

#[test]
fn threads_change_no_photon() {
    let [one, three] = [1, 3].map(|threads| {
        let settings = BakeSettings {
            threads,
            filter: Some(true),
            ..photons(3e5, SIDE)
        };
        bake(frosted_ball(0.3), &settings)
    });
    assert_eq!(one.maps.len(), three.maps.len());
    for (a, b) in one.maps.iter().zip(&three.maps) {
        assert_eq!(bits(a), bits(b));
    }
}

/// The target is met by the true error too, within a factor of two; and filtering reaches it with fewer photons.
#[test]
fn targets_are_met_and_filtering_saves_photons() {
    let scene = frosted_ball(0.3);
    let [raw, filtered] = [false, true].map(|filter| {
        let settings = BakeSettings {
            max_error: Some(0.15),
            map_resolution: FINE,
            filter: Some(filter),
            ..photons(1e4, SIDE)
        };
        let result = bake(scene.clone(), &settings);
        assert_eq!(energy_fault(&result), None);
        assert!(result.estimated_relative_rmse.expect("an estimate") <= 0.15);
        result
    });
    assert!(
        filtered.counts.rays < raw.counts.rays,
        "{} and {}",
        filtered.counts.rays,
        raw.counts.rays
    );
    let fine = BakeSettings {
        map_resolution: FINE,
        ..photons(1e7, SIDE)
    };
    let reference = bake(scene.clone(), &fine);
    let truth = caustic(map_of(&reference, &scene, "floor"));
    for result in [&raw, &filtered] {
        let map = caustic(map_of(result, &scene, "floor"));
        let squares = map.iter().zip(&truth).map(|(a, b)| (a - b) * (a - b));
        let mean = truth.iter().sum::<f64>() / truth.len() as f64;
        let off = (squares.sum::<f64>() / truth.len() as f64).sqrt() / mean;
        println!("{} photons: off by {off}", result.counts.rays);
        assert!(off <= 0.3, "{off}");
    }
}

/// Few photons leave most texels empty: what is left of the noise there is still a number.
#[test]
fn errors_of_few_filtered_photons_are_numbers() {
    let settings = BakeSettings {
        max_error: Some(1.0),
        map_resolution: FINE,
        filter: Some(true),
        ..photons(1e4, SIDE)
    };
    let result = bake(builtin_scene("ring"), &settings);
    for error in [result.estimated_relative_rmse, result.estimated_visible] {
        assert!(error.is_some_and(|error| error < 10.0), "{error:?}");
    }
    let mut errors = result.maps.iter().flat_map(|map| map.error.iter().flatten());
    assert!(errors.all(|error| *error >= 0.0 && *error < f32::MAX));
}

/// Pure colours lie outside of sRGB, filtered too; their luminance is never negative.
#[test]
fn filtered_spectra_are_light() {
    let settings = BakeSettings {
        filter: Some(true),
        ..photons(3e4, SIDE)
    };
    let scene = builtin_scene("spectrum");
    let result = bake(scene, &settings);
    assert_eq!(energy_fault(&result), None);
    let layers = result.maps.iter().filter_map(|map| map.layer(LayerKind::Caustic));
    let texels: Vec<[f32; 3]> = layers
        .flat_map(|layer| layer.irradiance.iter().copied())
        .collect();
    assert!(texels.iter().flatten().any(|channel| *channel < 0.0));
    // Counts are whole numbers.
    let mean = texels.iter().map(luminance).sum::<f64>() / texels.len() as f64;
    let least = texels.iter().map(luminance).fold(f64::INFINITY, f64::min);
    assert!(least >= -1e-6 * mean, "{least} of {mean}");
}

/// Smooth light is for patches, light that goes very many ways for photons.
#[test]
fn auto_takes_what_costs_less() {
    let carried = |scene: Scene| {
        let settings = BakeSettings {
            max_error: Some(0.05),
            estimator: Estimator::Auto,
            ..photons(1_600.0, SIDE)
        };
        let result = bake(scene, &settings);
        assert_eq!(energy_fault(&result), None);
        assert!(result.estimated_relative_rmse.expect("an estimate") <= 0.05);
        result.counts.cells == 0
    };
    assert!(!carried(builtin_scene("ring")), "a smooth mirror");
    assert!(carried(frosted_ball(0.2)), "rough glass");
}
