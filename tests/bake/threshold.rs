//! Branches too weak to matter are not traced: how weak follows the target, and their watts are booked.

use nephroid::session::BakeResult;
use nephroid::settings::BakeSettings;

use super::hard_scenes;
use super::tools::{at, bake, energy_fault, settings};

fn to_target(target: f64) -> BakeSettings {
    BakeSettings {
        max_error: Some(target),
        ..at(BakeSettings::starting_density_per_sr(target), 64)
    }
}

/// Given up below the threshold, over what arrived.
fn left_out(result: &BakeResult) -> f64 {
    let energy = &result.ledgers[0].energy_w;
    energy.truncated.threshold / energy.deposited
}

#[test]
fn a_tighter_target_follows_weaker_branches_and_books_less() {
    let mut before = f64::INFINITY;
    for target in [0.1, 0.03, 0.01] {
        let result = bake(hard_scenes::ball(), &to_target(target));
        let share = left_out(&result);
        assert!(share > 0.0, "something is always too weak");
        assert!(share < before, "{share} at {target}, {before} before");
        assert!(
            share < 0.1 * target,
            "{share} is left out at a target of {target}"
        );
        assert_eq!(energy_fault(&result), None);
        println!("target {target}: {share:.1e} of the light is left out");
        before = share;
    }
}

/// Segments of splats, whose rays are always the same.
#[test]
fn what_is_left_out_takes_no_segment() {
    let with = |target: f64| {
        let settings = BakeSettings {
            branch_threshold: Some(to_target(target).path_threshold()),
            ..settings(4_000.0, 64)
        };
        bake(hard_scenes::ball(), &settings)
    };
    let bakes = [0.1, 0.03, 0.01].map(with);
    for pair in bakes.windows(2) {
        assert_eq!(pair[0].counts.rays, pair[1].counts.rays);
        let [segments, next] = [&pair[0], &pair[1]].map(|result| result.counts.segments);
        println!("{segments} segments, {:.1e} left out", left_out(&pair[0]));
        assert!(
            segments < next,
            "{segments} segments, {next} for a tighter target"
        );
        assert!(left_out(&pair[0]) > left_out(&pair[1]));
    }
}

#[test]
fn a_threshold_that_is_named_is_taken_as_it_is() {
    let named = BakeSettings {
        branch_threshold: Some(0.02),
        ..to_target(0.01)
    };
    assert_eq!(named.path_threshold().to_bits(), 0.02_f64.to_bits());
    assert!(to_target(0.1).path_threshold() > to_target(0.01).path_threshold());
}
