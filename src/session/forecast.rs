//! What a target will cost, from what a bake cost so far; and, afterwards, how that compares with what happened.
//!
//! Error falls with a power of the work. The exponent is measured over the last levels and drawn half way to the usual
//! one, since two levels alone say little.

use serde::{Deserialize, Serialize};

/// Where a bake stood after a level.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CostPoint {
    /// Light rays traced so far.
    pub rays: u64,
    /// CPU seconds of the light pass so far: plan, trace, deposit.
    pub cpu_s: f64,
    /// Memory held for maps, rays and patches [bytes].
    pub bytes: u64,
    /// Of all maps, estimated.
    pub relative_rmse: f64,
    /// Whether the lattice that refinement begins from is still to come: no bake ends before it.
    pub is_coarse: bool,
}

/// What a target is expected to cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Forecast {
    /// Relative RMSE that is aimed at.
    pub target: f64,
    /// Light rays.
    pub rays: u64,
    /// CPU seconds of the light pass.
    pub cpu_s: f64,
    /// Memory for maps, rays and patches [bytes].
    pub bytes: u64,
    /// It may be this many times more or less; 1 where it was measured.
    pub factor: f64,
}

/// A forecast with what it was made from and what became of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForecastReport {
    /// Where the bake stood when it was made.
    pub made_at: CostPoint,
    /// What was expected.
    pub expected: Forecast,
    /// Where the bake ended.
    pub actual: CostPoint,
}

/// Work grows with this power of 1/error as a rule: it did on the reference scenes, between 10 and 1 %.
const USUAL_EXPONENT: f64 = 0.6;

/// Measured exponents are taken no farther than this.
const EXPONENTS: (f64, f64) = (0.3, 2.0);

/// Logarithm of the uncertainty per logarithm of the ratio of errors that is bridged.
const DOUBT: f64 = 0.35;

/// Rounds of refinement come whole, and one may double the work: no forecast is better than this.
const WHOLE_ROUND: f64 = 2.0;

/// What `target` is expected to cost; `None` where nothing is known of the error yet.
pub fn forecast(course: &[CostPoint], target: f64) -> Option<Forecast> {
    let met = course
        .iter()
        .find(|point| !point.is_coarse && point.relative_rmse <= target);
    if let Some(point) = met {
        return Some(Forecast {
            target,
            rays: point.rays,
            cpu_s: point.cpu_s,
            bytes: point.bytes,
            factor: 1.0,
        });
    }
    let last = course.last()?;
    let before = course
        .iter()
        .rev()
        .find(|point| point.relative_rmse > 1.2 * last.relative_rmse);
    let exponent = |of: fn(&CostPoint) -> f64| {
        let measured = before
            .map(|before| (of(last) / of(before)).ln() / (before.relative_rmse / last.relative_rmse).ln());
        let measured = measured.filter(|exponent| exponent.is_finite());
        let measured = measured.unwrap_or(USUAL_EXPONENT).clamp(EXPONENTS.0, EXPONENTS.1);
        0.5 * (measured + USUAL_EXPONENT)
    };
    // What is still to come before a bake may end halves the error once or twice, whatever the target.
    let gain = if last.is_coarse {
        2.0 * (last.relative_rmse / target).max(1.0)
    } else {
        last.relative_rmse / target
    };
    let grown = |of: fn(&CostPoint) -> f64| of(last) * gain.powf(exponent(of));
    let rays = grown(|point| point.rays.max(1) as f64);
    Some(Forecast {
        target,
        rays: rays as u64,
        cpu_s: grown(|point| point.cpu_s),
        // Maps stay as large as they are; what is kept of rays grows with them.
        bytes: (last.bytes as f64 * (rays / last.rays.max(1) as f64).sqrt()) as u64,
        factor: (DOUBT * gain.ln()).exp().max(WHOLE_ROUND),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(rays: u64, cpu_s: f64, relative_rmse: f64) -> CostPoint {
        CostPoint {
            rays,
            cpu_s,
            bytes: 1000,
            relative_rmse,
            is_coarse: false,
        }
    }

    #[test]
    fn a_power_law_goes_on() {
        let course = [
            point(1_000, 0.1, 0.2),
            point(4_000, 0.3, 0.05),
            point(16_000, 0.9, 0.0125),
        ];
        let next = forecast(&course, 0.0125 / 4.0).expect("known");
        // Measured exponents 1 and ln 3/ln 4, both drawn towards 0.6.
        assert!(
            (next.rays as f64 / (16_000.0 * 4_f64.powf(0.8)) - 1.0).abs() < 1e-3,
            "{next:?}"
        );
        assert!(next.cpu_s > 2.1 && next.cpu_s < 2.8, "{next:?}");
        assert!((2.0..2.5).contains(&next.factor), "{next:?}");
    }

    #[test]
    fn what_was_met_is_no_guess() {
        let course = [point(1_000, 0.1, 0.2), point(4_000, 0.3, 0.05)];
        let met = forecast(&course, 0.1).expect("known");
        assert_eq!((met.rays, met.factor), (4_000, 1.0));
        assert_eq!(forecast(&[], 0.1), None);
    }

    #[test]
    fn no_bake_ends_on_a_coarse_lattice() {
        let coarse = CostPoint {
            is_coarse: true,
            ..point(1_000, 0.1, 0.01)
        };
        let next = forecast(&[coarse], 0.05).expect("known");
        assert!(next.rays > 1_200 && next.factor > 1.2, "{next:?}");
    }

    #[test]
    fn a_single_level_or_one_that_gained_nothing_takes_the_usual_power() {
        for course in [
            vec![point(1_000, 0.1, 0.2)],
            vec![point(900, 0.1, 0.2), point(1_000, 0.1, 0.2)],
        ] {
            let next = forecast(&course, 0.02).expect("known");
            assert!(
                (next.cpu_s / (0.1 * 10_f64.powf(0.6)) - 1.0).abs() < 1e-9,
                "{next:?}"
            );
        }
    }
}
