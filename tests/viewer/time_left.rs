//! How long a bake is said to take still.

use std::sync::Arc;
use std::time::{Duration, Instant};

use nephroid::progress::Stage;
use nephroid::scene::builtin;
use nephroid::session::CostPoint;
use nephroid::settings::BakeSettings;
use nephroid::viewer::time_left::{in_words, time_left_s};
use nephroid::viewer::worker::{BakeRequest, BakeState, BakedLevel};

use super::headless::finished;

fn baking(fraction: f64, since: Instant) -> BakeState {
    BakeState::Baking {
        stage: Stage::Caustic,
        fraction,
        since,
    }
}

fn request(settings: BakeSettings) -> BakeRequest {
    BakeRequest::new(
        Arc::new(builtin::build("ring").expect("it is built in")),
        settings,
    )
}

fn after(since: Instant, seconds: f64) -> Instant {
    since + Duration::from_secs_f64(seconds)
}

#[test]
fn nothing_is_said_where_nothing_is_known() {
    let since = Instant::now();
    let wanted = request(BakeSettings::default());
    let now = after(since, 5.0);
    for state in [BakeState::Idle, BakeState::Done, BakeState::Cancelled] {
        assert_eq!(time_left_s(&state, &wanted, None, now), None);
    }
    assert_eq!(time_left_s(&baking(0.01, since), &wanted, None, now), None);
}

#[test]
fn a_stage_goes_on_at_its_pace_and_a_limit_holds() {
    let since = Instant::now();
    let now = after(since, 4.0);
    let left = |max_time_s| {
        let wanted = request(BakeSettings {
            max_time_s,
            ..BakeSettings::default()
        });
        time_left_s(&baking(0.25, since), &wanted, None, now).expect("it is known")
    };
    assert!((left(None) - 12.0).abs() < 1e-9);
    assert!((left(Some(10.0)) - 6.0).abs() < 1e-9);
    assert!((left(Some(100.0)) - 12.0).abs() < 1e-9);
    assert_eq!(left(Some(3.0)), 0.0);
}

#[test]
fn the_course_towards_an_error_tells_what_is_left_of_it() {
    let since = Instant::now();
    let wanted = request(BakeSettings {
        max_error: Some(0.01),
        ..BakeSettings::default()
    });
    let point = |cpu_s, relative_rmse| CostPoint {
        rays: 1000,
        cpu_s,
        wall_s: cpu_s / 2.0,
        bytes: 0,
        relative_rmse,
        is_coarse: false,
    };
    let mut level = finished(&wanted.scene, &wanted.settings);
    level.is_final = false;
    level.seconds = 3.0;
    level.result.course = vec![point(2.0, 0.04), point(6.0, 0.02)];
    let left = |level: &BakedLevel, seconds: f64| {
        time_left_s(&baking(0.5, since), &wanted, Some(level), after(since, seconds))
    };
    let at_level = left(&level, 3.0).expect("it is known");
    // Half the error takes more than nothing and, at an exponent of at most 2, at most three times as much again; two
    // threads work.
    assert!(at_level > 0.0 && at_level <= 0.5 * 3.0 * 6.0, "{at_level}");
    // A second later a second less, and never less than none.
    let later = left(&level, 4.0).expect("it is known");
    assert!((at_level - later - 1.0).abs() < 1e-9, "{at_level}, {later}");
    assert_eq!(left(&level, 1e6), Some(0.0));
    // Maps of another bake say nothing of this one.
    level.request.settings.seed = 9;
    assert_eq!(left(&level, 3.0), None);
}

#[test]
fn times_are_told_no_more_exactly_than_they_are_known() {
    for (seconds, words) in [
        (0.2, "about a second left"),
        (41.7, "about 42 s left"),
        (130.0, "about 3 min left"),
        (7300.0, "about 3 h left"),
    ] {
        assert_eq!(in_words(seconds), words);
    }
}
