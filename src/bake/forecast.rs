//! Predicts the cost of an error target from the levels baked so far, and records how well earlier predictions did.
//!
//! Error falls with a power of the work once refinement has started. The exponent is measured over the levels since
//! then and drawn towards the usual one, since two levels alone say little.

use serde::{Deserialize, Serialize};

use crate::settings::Estimator;

/// Cost and error of a bake after a level.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CostPoint {
    /// Light rays traced so far.
    pub rays: u64,
    /// CPU time of the light pass so far: plan, trace, deposit [s].
    pub cpu_s: f64,
    /// Wall-clock time of the same stages [s].
    #[serde(default)]
    pub wall_s: f64,
    /// Memory held for maps, rays and bundles [bytes].
    pub bytes: u64,
    /// Estimated error of all maps, in the metric of the bake.
    #[serde(alias = "relative_rmse")]
    pub error: f64,
    /// Whether photons carry some light without bundles; they then dominate the cost.
    #[serde(default)]
    pub is_by_photons: bool,
}

/// Predicted cost of an error target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Forecast {
    /// Error target.
    pub target: f64,
    /// Light rays.
    pub rays: u64,
    /// CPU time of the light pass [s].
    pub cpu_s: f64,
    /// Wall-clock time [s], if threads stay as busy as so far.
    #[serde(default)]
    pub wall_s: f64,
    /// Memory for maps, rays and bundles [bytes].
    pub bytes: u64,
    /// The cost may be this many times higher or lower; 1 if it was measured.
    pub factor: f64,
}

/// A forecast with its basis and its outcome.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForecastReport {
    /// State of the bake when the forecast was made.
    pub made_at: CostPoint,
    /// The forecast.
    pub expected: Forecast,
    /// State at the end of the bake.
    pub actual: CostPoint,
}

/// Typical exponents of 1/error in the growth of rays and seconds: those of bundles are fitted to eight built-in
/// scenes. `nephroid study accuracy`, targets of 5 to 1 %: forecast over actual rays is 0.46 to 1.45. Seconds grow
/// less, because the cost of texels does not depend on rays.
const BUNDLES: [f64; 2] = [0.7, 0.55];
/// Splats: every cost is proportional to rays, and the error falls about with their square root.
const SPLATS: [f64; 2] = [1.8; 2];
/// Noise falls with the square root of the number of photons.
const PHOTONS: [f64; 2] = [2.0; 2];

/// Range of exponents.
const EXPONENTS: (f64, f64) = (0.3, 4.0);

/// Weight of the usual exponent, as the sum of squared distances of ln(1/error) from its mean.
const WEIGHT_OF_USUAL: f64 = 2.0;

/// Spread of exponents across scenes.
const DOUBT: f64 = 0.35;

/// Growth of the cost by one more level of bundles, however little is missing.
const WHOLE_LEVEL: f64 = 1.8;

/// Refinement comes in whole levels, and one may double the work: no forecast is more certain than this.
const MIN_FACTOR: f64 = 2.0;

/// Predicted cost of `target` with an estimator; `None` while no error is known. Splats are not refined: for them it is
/// the cost of another bake with more rays.
pub fn forecast(course: &[CostPoint], target: f64, estimator: Estimator) -> Option<Forecast> {
    let met = |point: &&CostPoint| point.error <= target;
    let of_point = |point: &CostPoint, times: [f64; 2], factor: f64| Forecast {
        target,
        rays: (point.rays.max(1) as f64 * times[0]) as u64,
        cpu_s: point.cpu_s * times[1],
        wall_s: point.wall_s * times[1],
        // Maps keep their size; what is kept of rays grows with their number.
        bytes: (point.bytes as f64 * times[0].sqrt()) as u64,
        factor,
    };
    if let Some(point) = course.iter().find(met) {
        return Some(of_point(point, [1.0, 1.0], 1.0));
    }
    let last = course.last()?;
    let (exponents, level) = match estimator {
        Estimator::Splat => (SPLATS, 1.0),
        _ if last.is_by_photons => (PHOTONS, 1.0),
        _ => (BUNDLES, WHOLE_LEVEL),
    };
    let gain = (last.error / target).max(1.0);
    let costs: [fn(&CostPoint) -> f64; 2] = [|point| point.rays as f64, |point| point.cpu_s];
    let times = [0, 1].map(|which| {
        let slope = Slope::of(course, costs[which], exponents[which]);
        level * gain.powf(slope.exponent)
    });
    let doubt = Slope::of(course, costs[1], exponents[1]).doubt;
    let factor = (doubt * gain.ln()).exp().max(1.0);
    Some(of_point(last, times, factor.max(MIN_FACTOR)))
}

/// Growth of a cost over a course.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Slope {
    /// d ln(cost) / d ln(1/error).
    exponent: f64,
    /// Expected error of the exponent.
    doubt: f64,
}

impl Slope {
    /// Least-squares fit through the levels, drawn towards the usual exponent where it rests
    /// on little data.
    fn of(course: &[CostPoint], cost: fn(&CostPoint) -> f64, usual: f64) -> Self {
        let is_measured = |point: &&CostPoint| cost(point) > 0.0;
        let logarithms = |point: &CostPoint| (-point.error.ln(), cost(point).ln());
        let points: Vec<(f64, f64)> = course.iter().filter(is_measured).map(logarithms).collect();
        let count = points.len().max(1) as f64;
        let sums = points
            .iter()
            .fold((0.0, 0.0), |sum, p| (sum.0 + p.0, sum.1 + p.1));
        let mean = (sums.0 / count, sums.1 / count);
        let (squares, products) = points.iter().fold((0.0, 0.0), |sum, p| {
            let (x, y) = (p.0 - mean.0, p.1 - mean.1);
            (sum.0 + x * x, sum.1 + x * y)
        });
        let exponent = (products + WEIGHT_OF_USUAL * usual) / (squares + WEIGHT_OF_USUAL);
        Self {
            exponent: exponent.clamp(EXPONENTS.0, EXPONENTS.1),
            doubt: DOUBT * (WEIGHT_OF_USUAL / (squares + WEIGHT_OF_USUAL)).sqrt(),
        }
    }
}

/// Index of the last level before the target came near: the first at or below `error`, else the last above it, never
/// the final level. `None` for fewer than two levels.
pub fn stood_at(course: &[CostPoint], error: f64) -> Option<usize> {
    let before_end = course.len().checked_sub(2)?;
    let first = course.iter().position(|point| point.error <= error);
    Some(first.unwrap_or(before_end).min(before_end))
}

impl Forecast {
    /// "to 1 %: about 3.2 s (1.6 to 6.4 s), 21,000 rays": wall-clock seconds of the light pass.
    pub fn in_words(&self) -> String {
        let percent = (self.target * 1e6).round() / 1e4;
        let rays = rounded_count(self.rays as f64);
        if self.factor <= 1.0 {
            return format!("to {percent} %: {} s, {rays} rays", two_digits(self.wall_s));
        }
        let (least, most) = (self.wall_s / self.factor, self.wall_s * self.factor);
        format!(
            "to {percent} %: about {} s ({} to {} s), {rays} rays",
            two_digits(self.wall_s),
            two_digits(least),
            two_digits(most)
        )
    }
}

/// Rounds to two significant digits.
fn two_digits(value: f64) -> String {
    if value <= 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let unit = 10_f64.powi(value.log10().floor() as i32 - 1);
    let rounded = (value / unit).round() * unit;
    let decimals = (1.0 - (rounded * 1.000_001).log10().floor()).max(0.0);
    format!("{rounded:.*}", decimals as usize)
}

/// "950", "21 k", "1.1 M".
fn rounded_count(count: f64) -> String {
    match count {
        ..1e3 => two_digits(count),
        1e3..1e6 => format!("{} k", two_digits(count / 1e3)),
        1e6..1e9 => format!("{} M", two_digits(count / 1e6)),
        _ => format!("{} G", two_digits(count / 1e9)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(rays: u64, cpu_s: f64, error: f64) -> CostPoint {
        CostPoint {
            rays,
            cpu_s,
            wall_s: 0.5 * cpu_s,
            bytes: 1000,
            error,
            is_by_photons: false,
        }
    }

    fn to(course: &[CostPoint], target: f64) -> Forecast {
        forecast(course, target, Estimator::Auto).expect("known")
    }

    #[test]
    fn a_power_law_that_was_seen_long_enough_goes_on() {
        // Rays grow with 1/error, seconds with its root, over a factor of five hundred.
        let law = |error: f64| point((1e6 / error) as u64, 0.1 / error.sqrt(), error);
        let course: Vec<_> = (0..10).map(|level| law(0.5_f64.powi(level))).collect();
        let target = 0.5_f64.powi(11);
        let (next, truth) = (to(&course, target), law(target));
        // Rays and seconds of the level that the target comes in.
        let ratio = |cost: f64, truth: f64| (cost / (WHOLE_LEVEL * truth)).ln().abs();
        assert!(ratio(next.rays as f64, truth.rays as f64) < 0.06, "{next:?}");
        assert!(ratio(next.cpu_s, truth.cpu_s) < 0.03, "{next:?}");
        assert!((next.wall_s - 0.5 * next.cpu_s).abs() < 1e-9, "{next:?}");
    }

    #[test]
    fn what_was_met_is_no_guess() {
        let course = [point(1_000, 0.1, 0.2), point(4_000, 0.3, 0.05)];
        let met = to(&course, 0.1);
        assert_eq!((met.rays, met.factor), (4_000, 1.0));
        assert_eq!(forecast(&[], 0.1, Estimator::Auto), None);
    }

    #[test]
    fn a_single_level_or_one_that_gained_nothing_takes_the_usual_power() {
        for course in [
            vec![point(1_000, 0.1, 0.2)],
            vec![point(900, 0.1, 0.2), point(1_000, 0.1, 0.2)],
        ] {
            let next = to(&course, 0.02);
            let usual = 0.1 * WHOLE_LEVEL * 10_f64.powf(BUNDLES[1]);
            assert!((next.cpu_s / usual - 1.0).abs() < 1e-9, "{next:?}");
        }
    }

    #[test]
    fn the_farther_the_less_sure_and_the_more_was_seen_the_surer() {
        let one = [point(1_000, 0.1, 0.5)];
        let factor = |course: &[CostPoint], target| to(course, target).factor;
        assert!(factor(&one, 0.001) > factor(&one, 0.01));
        let many: Vec<_> = (0..8)
            .map(|level| point(1_000 << level, 0.1, 0.5_f64.powi(level + 1)))
            .collect();
        let target = many[7].error / 500.0;
        assert!(factor(&many, target) < factor(&one, 0.001));
    }

    #[test]
    fn forecasts_are_told_in_one_line() {
        let told = Forecast {
            target: 0.01,
            rays: 1_123_456,
            cpu_s: 6.0,
            wall_s: 3.21,
            bytes: 0,
            factor: 2.0,
        };
        assert_eq!(told.in_words(), "to 1 %: about 3.2 s (1.6 to 6.4 s), 1.1 M rays");
        let met = Forecast {
            factor: 1.0,
            rays: 950,
            wall_s: 0.0996,
            ..told
        };
        assert_eq!(met.in_words(), "to 1 %: 0.10 s, 950 rays");
    }

    #[test]
    fn a_bake_stood_where_it_first_was_as_good() {
        let course = [0.2, 0.06, 0.02, 0.01].map(|error| point(1, 1.0, error));
        assert_eq!(stood_at(&course, 0.05), Some(2));
        assert_eq!(stood_at(&course, 0.001), Some(2));
        assert_eq!(stood_at(&course[..1], 0.05), None);
    }
}
