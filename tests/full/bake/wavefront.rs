//! The wavefront estimator against an independent solver, and by its counters.

use nephroid::session::BakeResult;

use crate::bake::common::{floor, rmse, towards};
use support::reference_map;
use support::references::references;
use support::tools::{at, bake, builtin_scene, energy_fault, set, settings};

/// The others are in the quick tests.
#[test]
fn few_rays_agree_with_the_solver() {
    let references = references();
    let large = ["ball", "pool", "paraboloid"];
    for reference in references
        .iter()
        .filter(|reference| large.contains(&reference.builtin))
    {
        let scene = builtin_scene(reference.builtin);
        let result = bake(scene.clone(), &at(reference.by_wavefronts.0, 256));
        reference.check_wavefronts(&result, &scene);
    }
}

/// Errors of the meshes themselves (of the solver's own files; a little is left for the deposit).
#[test]
fn more_rays_find_the_meshs_own_error() {
    for (name, reference, density, mesh) in [
        ("ring", "S1", 1e5, 0.0014),
        ("pool", "S3", 1e5, 0.007),
        ("paraboloid", "S7", 3e5, 0.0014),
    ] {
        let scene = builtin_scene(name);
        let [coarse, fine] = [density / 10.0, density].map(|density| {
            let result = bake(scene.clone(), &at(density, 256));
            rmse(&floor(&result, &scene), &reference_map(reference))
        });
        assert!(
            fine <= 1.3 * mesh || fine < 0.5 * coarse,
            "{name}: {coarse} only falls to {fine}"
        );
    }
}

#[test]
fn what_refinement_leaves_open_shrinks() {
    let [coarse, fine] = [1e3, 3e4].map(|density| {
        let result = bake(builtin_scene("ball"), &at(density, 64));
        let energy = result.ledgers[0].energy_w;
        energy.truncated.quadrature.abs() / energy.emitted
    });
    assert!(
        fine < 2e-3 && fine < coarse,
        "{coarse} of the emitted flux, then {fine}"
    );
}

/// Given up below the threshold, over what arrived.
fn left_out(result: &BakeResult) -> f64 {
    let energy = &result.ledgers[0].energy_w;
    energy.truncated.threshold / energy.deposited
}

/// Branches too weak to matter are not traced: how weak follows the target, and their watts are booked.
#[test]
fn a_tighter_target_follows_weaker_branches() {
    let targets = [0.1, 0.03, 0.01];
    let shares = targets.map(|target| {
        let result = bake(builtin_scene("ball"), &towards(target, 64));
        assert_eq!(energy_fault(&result), None);
        let share = left_out(&result);
        assert!(share > 0.0, "something is always too weak");
        assert!(share < 0.1 * target, "{share} at a target of {target}");
        share
    });
    assert!(shares.windows(2).all(|pair| pair[1] < pair[0]), "{shares:?}");
    // Rays of splats are always the same, their segments are not.
    let splats = targets.map(|target| {
        let settings = set(settings(4_000.0, 64), |s| {
            s.branch_threshold = Some(towards(target, 64).path_threshold())
        });
        let result = bake(builtin_scene("ball"), &settings);
        (result.counts.rays, result.counts.segments, left_out(&result))
    });
    for pair in splats.windows(2) {
        assert_eq!(pair[0].0, pair[1].0);
        assert!(pair[0].1 < pair[1].1 && pair[0].2 > pair[1].2, "{splats:?}");
    }
}

#[test]
fn a_named_threshold_is_taken_as_it_is() {
    let named = set(towards(0.01, 64), |s| s.branch_threshold = Some(0.02));
    assert_eq!(named.path_threshold().to_bits(), 0.02_f64.to_bits());
    assert!(towards(0.1, 64).path_threshold() > towards(0.01, 64).path_threshold());
}
