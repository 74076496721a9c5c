//! Remaining time of a bake, from its levels so far.

use std::time::{Duration, Instant};

use super::worker::{BakeRequest, BakeState, BakedLevel};
use crate::bake::forecast::forecast;
use crate::plan::is_wanted;
use crate::progress::Stage;
use crate::settings::LayerKind;

/// Forecasts with a larger factor of uncertainty than this are not shown [1].
const MAX_FACTOR: f64 = 2.0;

/// Least completed fraction of a stage from which its remaining time is extrapolated [1].
const MIN_FRACTION: f64 = 0.1;

/// Time until a bake is done [s, ≥ 0], not rounded. `None` while no bake is running or nothing is known yet. `wanted`
/// is the request that is being baked, `last` the newest maps.
///
/// Where the caustics are refined to a target error, the convergence so far gives the remaining cost, unless indirect
/// light follows: its cost is unknown then. Without a target error, the remaining time is extrapolated from the
/// completed fraction of the stage. The time limit of the settings is an upper bound in either case.
pub fn time_left_s(
    state: &BakeState,
    wanted: &BakeRequest,
    last: Option<&BakedLevel>,
    now: Instant,
) -> Option<f64> {
    let BakeState::Baking {
        stage,
        fraction,
        since,
    } = *state
    else {
        return None;
    };

    // The course of the caustics tells nothing of indirect light, and that of an earlier request nothing of this one.
    let is_last = stage == Stage::Caustic && !is_wanted(&wanted.settings, LayerKind::Indirect);
    let elapsed_s = now.saturating_duration_since(since).as_secs_f64();
    let own = last.filter(|last| is_last && !last.is_final && last.request.is_same(wanted));

    // The error so far gives the CPU time to the target; too uncertain a forecast counts as none.
    let by_course = own.and_then(|level| {
        let target = wanted.settings.max_error?;
        let course = &level.result.course;
        let spent_cpu_s = course.last()?.cpu_s;
        let expected = forecast(course, target, wanted.settings.estimator)?;
        if expected.factor > MAX_FACTOR {
            return None;
        }
        let more_cpu_s = expected.cpu_s - spent_cpu_s;
        // Assumes that as many threads stay busy as up to that level.
        let seconds_per_cpu_s = level.seconds / spent_cpu_s;
        let left_s = more_cpu_s * seconds_per_cpu_s - (elapsed_s - level.seconds);
        left_s.is_finite().then_some(left_s.max(0.0))
    });

    // Without a target error, a stage advances evenly enough to extrapolate its time.
    let by_pace = || {
        let is_known = fraction >= MIN_FRACTION && wanted.settings.max_error.is_none();
        is_known.then(|| elapsed_s * (1.0 - fraction) / fraction)
    };

    // The time limit bounds any forecast, and is the forecast where there is neither another one nor a target error.
    let at_most_s = wanted
        .settings
        .max_time_s
        .map(|limit_s| (limit_s - elapsed_s).max(0.0));
    match (by_course.or_else(by_pace), at_most_s) {
        (Some(left_s), Some(at_most_s)) => Some(left_s.min(at_most_s)),
        (None, Some(at_most_s)) if wanted.settings.max_error.is_none() => Some(at_most_s),
        (left_s, _) => left_s,
    }
}

/// The time in words, no more precise than the forecast.
pub fn in_words(seconds: f64) -> String {
    let seconds = Duration::try_from_secs_f64(seconds).map_or(u64::MAX, |time| time.as_secs());
    match seconds {
        0 => "about a second left".into(),
        1..=99 => format!("about {} s left", seconds + 1),
        100..=5999 => format!("about {} min left", seconds.div_ceil(60)),
        _ => format!("about {} h left", seconds.div_ceil(3600)),
    }
}
