//! Photons against the law of energy and against themselves. `full` holds them against brute force.

use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::optics::luminance;
use nephroid::settings::{ErrorMetric, Estimator};

use support::hard_scenes::roughened;
use support::meshes::floor;
use support::prelude::*;
use support::scenes::sun;
use support::tools::{bake, builtin_scene, caustic, energy_fault, map_of, photons, to};

const SIDE: usize = 64;
/// Fine enough that light is smooth from texel to texel.
const FINE: usize = 256;

/// Caustics are judged beside direct light, which need not be baked for that.
#[test]
fn visible_errors_count_light_that_is_not_baked() {
    let stated = |layers: &[LayerKind], direct: EffectSwitch| {
        let settings = BakeSettings {
            error_metric: ErrorMetric::Visible,
            layers: layers.to_vec(),
            effects: EffectSwitches::default().with(Effect::Direct, direct),
            ..photons(3e4, SIDE)
        };
        let result = bake(builtin_scene("ring"), &settings);
        let mut layers_of_maps = result.maps.iter().flat_map(|map| &map.layers);
        assert!(layers_of_maps.all(|layer| layers.contains(&layer.kind)));
        result.estimated_visible.expect("an estimate")
    };
    let beside = stated(&[LayerKind::Caustic, LayerKind::Direct], EffectSwitch::Auto);
    let alone = stated(&[LayerKind::Caustic], EffectSwitch::Auto);
    let in_the_dark = stated(&[LayerKind::Caustic], EffectSwitch::Off);
    assert!((alone / beside - 1.0).abs() < 0.05, "{alone} beside {beside}");
    assert!(in_the_dark > 1.5 * beside, "{in_the_dark} beside {beside}");
}

/// Few photons leave most texels empty: what is left of the noise there is still a number.
#[test]
fn errors_of_few_filtered_photons_are_numbers() {
    let settings = BakeSettings {
        max_error: Some(1.0),
        error_metric: ErrorMetric::Visible,
        filter: Some(true),
        ..photons(1e4, FINE)
    };
    let result = bake(builtin_scene("ring"), &settings);
    for error in [result.estimated_relative_rmse, result.estimated_visible] {
        assert!(error.is_some_and(|error| error < 10.0), "{error:?}");
    }
    let mut errors = result.maps.iter().flat_map(|map| map.error.iter().flatten());
    assert!(errors.all(|error| *error >= 0.0 && *error < f32::MAX));
}

/// Pure colours lie outside of sRGB; their luminance is never negative, whatever bundles and photons have of it.
#[test]
fn spectra_are_light() {
    for filter in [true, false] {
        let settings = BakeSettings {
            filter: Some(filter),
            ..photons(3e4, SIDE)
        };
        let result = bake(builtin_scene("spectrum"), &settings);
        assert_eq!(energy_fault(&result), None);
        let layers = result.maps.iter().filter_map(|map| map.layer(LayerKind::Caustic));
        let texels: Vec<[f32; 3]> = layers
            .flat_map(|layer| layer.irradiance.iter().copied())
            .collect();
        assert!(texels.iter().flatten().any(|channel| *channel < 0.0));
        // Counts are whole numbers.
        let mean = texels.iter().map(luminance).sum::<f64>() / texels.len() as f64;
        let least = texels.iter().map(luminance).fold(f64::INFINITY, f64::min);
        assert!(least >= -1e-6 * mean, "filter {filter}: {least} of {mean}");
    }
}

/// Bundles carry smooth light, photons what rough surfaces scatter; either way the target is met.
#[test]
fn bundles_carry_what_stays_together() {
    let bundled = |scene: Scene| {
        let settings = BakeSettings {
            max_error: Some(0.05),
            estimator: Estimator::Auto,
            ..photons(1_600.0, SIDE)
        };
        let result = bake(scene, &settings);
        assert_eq!(energy_fault(&result), None);
        assert!(result.estimated_relative_rmse.expect("an estimate") <= 0.05);
        result.ledgers[0].carried_w.bundles / result.ledgers[0].energy_w.deposited
    };
    let [smooth, rough] = [builtin_scene("ring"), roughened("ball", 0.2)].map(bundled);
    assert!(smooth > 0.95, "a smooth mirror: {smooth}");
    assert!(rough < 0.05, "rough glass: {rough}");
}

/// The image of the sun's disc at the edge of a pane, nine texels wide: bundles carry it, and it is as bright as the
/// share of a circle beyond a line.
#[test]
fn light_through_a_pane_ends_in_the_suns_penumbra() {
    let (diameter_rad, height_m, side) = (0.53_f64.to_radians(), 4.0, 512);
    let mut scene = Scene::default();
    parts::add(&mut scene, "floor", floor(1.0, 0.0), Material::default());
    let pane = Material {
        surface: SurfaceKind::ThinWall,
        volume: None,
        ..parts::dielectric("pane", 1.5)
    };
    parts::add(&mut scene, "pane", floor(0.5, height_m), pane);
    scene.lights = vec![Light {
        size: LightSize::Angle { diameter_rad },
        ..sun(-DVec3::Y, 1.0)
    }];
    let result = bake(scene.clone(), &to(0.02, side));
    assert_eq!(energy_fault(&result), None);
    let ledger = &result.ledgers[0];
    let bundled = ledger.carried_w.bundles / ledger.energy_w.deposited;
    assert!(bundled > 0.99, "bundles carry {bundled}");

    // Reflected to and fro between both faces, 2 n / (n² + 1) of the light passes.
    let passed = 3.0 / 3.25;
    let map = caustic(map_of(&result, &scene, "floor"));
    let radius_m = height_m * (0.5 * diameter_rad).tan();
    let rows = side * 3 / 8..side * 5 / 8;
    for column in 0..side {
        let mean = rows.clone().map(|row| map[row * side + column]).sum::<f64>() / rows.len() as f64;
        let x_m = (column as f64 + 0.5) * 2.0 / side as f64 - 1.0;
        let t = ((0.5 - x_m.abs()) / radius_m).clamp(-1.0, 1.0);
        let share = 0.5 + (t * (1.0 - t * t).sqrt() + t.asin()) / PI;
        let off = mean / passed - share;
        assert!(off.abs() < 0.02, "at {x_m} m: {off} beside {share}");
    }
}
