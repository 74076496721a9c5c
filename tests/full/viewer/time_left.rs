//! How long a bake is said to take still.

use std::sync::Arc;
use std::time::{Duration, Instant};

use nephroid::progress::Stage;
use nephroid::session::CostPoint;
use nephroid::settings::BakeSettings;
use nephroid::viewer::time_left::{in_words, time_left_s};
use nephroid::viewer::worker::{BakeRequest, BakeState, BakedLevel};
use support::tools::{at, bake, builtin_scene, set};

fn request(settings: BakeSettings) -> BakeRequest {
    BakeRequest::new(Arc::new(builtin_scene("ring")), settings)
}

/// So many seconds after the start, at a share of a stage that began then.
fn left(wanted: &BakeRequest, level: Option<&BakedLevel>, fraction: f64, seconds: f64) -> Option<f64> {
    let (stage, since) = (Stage::Caustic, Instant::now());
    let state = BakeState::Baking {
        stage,
        fraction,
        since,
    };
    time_left_s(&state, wanted, level, since + Duration::from_secs_f64(seconds))
}

#[test]
fn nothing_is_said_where_nothing_is_known() {
    let wanted = request(BakeSettings::default());
    for state in [BakeState::Idle, BakeState::Done, BakeState::Cancelled] {
        assert_eq!(time_left_s(&state, &wanted, None, Instant::now()), None);
    }
    assert_eq!(left(&wanted, None, 0.01, 5.0), None);
}

#[test]
fn a_stage_keeps_its_pace_within_a_limit() {
    for (max_time_s, expected) in [
        (None, 12.0),
        (Some(10.0), 6.0),
        (Some(100.0), 12.0),
        (Some(3.0), 0.0),
    ] {
        let wanted = request(set(BakeSettings::default(), |s| s.max_time_s = max_time_s));
        let left = left(&wanted, None, 0.25, 4.0).expect("it is known");
        assert!((left - expected).abs() < 1e-9, "{left} s with {max_time_s:?}");
    }
}

#[test]
fn the_course_tells_what_is_left_of_it() {
    let wanted = request(set(BakeSettings::default(), |s| s.max_error = Some(0.01)));
    let point = |cpu_s, error| CostPoint {
        rays: 1000,
        cpu_s,
        wall_s: cpu_s / 2.0,
        bytes: 0,
        error,
        is_coarse: false,
        is_by_photons: false,
    };
    let mut level = BakedLevel {
        serial: 1,
        request: wanted.clone(),
        level: 1,
        is_final: false,
        result: bake(builtin_scene("ring"), &at(10.0, 8)),
        seconds: 3.0,
    };
    level.result.course = vec![point(2.0, 0.04), point(6.0, 0.02)];
    let after = |level: &BakedLevel, seconds| left(&wanted, Some(level), 0.5, seconds);
    let at_level = after(&level, 3.0).expect("it is known");
    // Half the error takes more than nothing and, at an exponent of at most 2, at most three times as much again; two
    // threads work.
    assert!(at_level > 0.0 && at_level <= 0.5 * 3.0 * 6.0, "{at_level}");
    // A second later a second less, and never less than none.
    let later = after(&level, 4.0).expect("it is known");
    assert!((at_level - later - 1.0).abs() < 1e-9, "{at_level}, {later}");
    assert_eq!(after(&level, 1e6), Some(0.0));
    // Maps of another bake say nothing of this one.
    level.request.settings.seed = 9;
    assert_eq!(after(&level, 3.0), None);
}

#[test]
fn times_are_told_as_well_as_they_are_known() {
    for (seconds, words) in [
        (0.2, "about a second left"),
        (41.7, "about 42 s left"),
        (130.0, "about 3 min left"),
        (7300.0, "about 3 h left"),
    ] {
        assert_eq!(in_words(seconds), words);
    }
}
