//! Photons against brute force, and filtered ones against many.

use nephroid::settings::Estimator;

use support::hard_scenes::{cut_glass, roughened, under_square_lamp, under_the_suns_disc};
use support::prelude::*;
use support::scenes::tinted;
use support::tools::{bake, brute, builtin_scene, caustic, energy_fault, map_of, photons};

const SIDE: usize = 64;
const BLOCK: usize = 8;
/// Fine enough that light is smooth from texel to texel.
const FINE: usize = 256;

/// Green glass around a lamp, so that paths absorb, split and start inside a body.
fn lamp_in_green_glass() -> Scene {
    let mut scene = builtin_scene("mirror");
    scene.objects.truncate(1);
    let lamp = scene.lights[0].kind.position().expect("a point light");
    let glass = parts::dielectric("green glass", 1.5);
    let glass = tinted(glass, 0.3, rgb(0.2, 0.8, 0.3));
    parts::add(&mut scene, "bulb", shapes::sphere(lamp, 0.2, 3), glass);
    scene
}

/// Blocks of a map whose means are more than three standard errors apart.
fn outliers(result: &Bake, reference: &Bake, scene: &Scene, receiver: &str) -> usize {
    let [ours, theirs] = [result, reference].map(|result| map_of(result, scene, receiver));
    let [a, b] = [ours, theirs].map(caustic);
    let square = |map: &IlluminationMap, texel: usize| {
        map.error
            .as_ref()
            .map_or(0.0, |error| f64::from(error[texel]).powi(2))
    };
    let differences = block_sums(|texel| a[texel] - b[texel]);
    let variances = block_sums(|texel| square(ours, texel) + square(theirs, texel));
    let blocks = differences.iter().zip(&variances);
    blocks
        .filter(|(difference, variance)| difference.abs() > 3.0 * variance.sqrt())
        .count()
}

fn block_sums(of_texel: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut sums = vec![0.0; (SIDE / BLOCK).pow(2)];
    for texel in 0..SIDE * SIDE {
        sums[texel / SIDE / BLOCK * (SIDE / BLOCK) + texel % SIDE / BLOCK] += of_texel(texel);
    }
    sums
}

/// Of 64 blocks chance alone puts more than three beyond three standard errors once in 20,000 times.
#[test]
fn photons_are_unbiased() {
    for (what, scene, density_per_sr) in [
        ("glass ball", builtin_scene("ball"), 1e6),
        ("cut glass", cut_glass(), 1e6),
        ("square lamp", under_square_lamp("ring", 0.3), 1e5),
        ("disc of the sun", under_the_suns_disc(), 2e6),
        ("rough mirror", roughened("mirror", 0.2), 1e6),
        ("frosted ball", roughened("ball", 0.3), 1e6),
        ("ball as rough as can be", roughened("ball", 1.0), 1e6),
        ("lamp in green glass", lamp_in_green_glass(), 3e4),
    ] {
        let result = bake(scene.clone(), &photons(density_per_sr, SIDE));
        assert_eq!(energy_fault(&result), None, "{what}");
        let reference = brute(&scene, &photons(density_per_sr, SIDE), 60_000);
        let count = outliers(&result, &reference, &scene, "floor");
        assert!(count <= 3, "{what}: {count} blocks");
    }
}

/// The same against photons alone, which the test above holds to brute force: that parts no wavelengths.
#[test]
fn bundles_of_a_spectrum_are_unbiased() {
    let mut scene = builtin_scene("ball");
    let glass = scene.materials.iter_mut().find(|it| it.surface.is_specular());
    *glass.expect("glass") = parts::glass("N-SF11");
    let few = photons(1e6, SIDE);
    let bundled = BakeSettings {
        estimator: Estimator::Auto,
        max_error: Some(0.02),
        seed: 1,
        ..few.clone()
    };
    let [result, reference] = [bundled, few].map(|settings| bake(scene.clone(), &settings));
    assert_eq!(energy_fault(&result), None);
    let ledger = &result.ledgers[0];
    let bundled_w = ledger.carried_w.bundles;
    assert!(bundled_w > 0.5 * ledger.energy_w.deposited, "{bundled_w} W");
    let count = outliers(&result, &reference, &scene, "floor");
    assert!(count <= 3, "{count} blocks");
}

/// The target is met by the true error too, within a factor of two; and filtering reaches it with fewer photons.
#[test]
fn targets_are_met_and_filtering_saves_photons() {
    let scene = roughened("ball", 0.3);
    let [raw, filtered] = [false, true].map(|filter| {
        let settings = BakeSettings {
            max_error: Some(0.15),
            filter: Some(filter),
            ..photons(1e4, FINE)
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
    let reference = bake(scene.clone(), &photons(1e7, FINE));
    let truth = caustic(map_of(&reference, &scene, "floor"));
    for result in [&raw, &filtered] {
        let map = caustic(map_of(result, &scene, "floor"));
        let squares = map.iter().zip(&truth).map(|(a, b)| (a - b) * (a - b));
        let mean = truth.iter().sum::<f64>() / truth.len() as f64;
        let off = (squares.sum::<f64>() / truth.len() as f64).sqrt() / mean;
        assert!(off <= 0.3, "{off}");
    }
}
