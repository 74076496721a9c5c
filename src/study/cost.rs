//! Interpolates a measured curve to find the cost of an error.

use super::table::three_digits;

/// Cost of reaching an error, in the unit of the measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cost {
    /// Between two measurements.
    Interpolated(f64),
    /// Beyond the last measurement, by the slope of the last few.
    Extrapolated(f64),
    /// Upper bound: the first measurement reaches the error already.
    AtMost(f64),
}

impl std::fmt::Display for Cost {
    /// Three digits; `~` before an extrapolation, `<` before a bound.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (mark, value) = match *self {
            Self::Interpolated(value) => ("", value),
            Self::Extrapolated(value) => ("~", value),
            Self::AtMost(value) => ("<", value),
        };
        write!(f, "{mark}{}", three_digits(value))
    }
}

/// Number of measurements that determine the slope of an extrapolation.
const EXTRAPOLATION_POINTS: usize = 3;

/// Cost from which on the error stays at or below `target`, by linear interpolation of logarithms. `points` are (cost,
/// error), both > 0, cheapest first. `None` if the error does not fall, or without measurements.
pub fn cost_of(points: &[(f64, f64)], target: f64) -> Option<Cost> {
    let Some(above) = points.iter().rposition(|(_, error)| *error > target) else {
        return points.first().map(|(cost, _)| Cost::AtMost(*cost));
    };
    let (cost, error) = points[above];
    if let Some(below) = points.get(above + 1) {
        let share = (error / target).ln() / (error / below.1).ln();
        return Some(Cost::Interpolated(cost * (below.0 / cost).powf(share)));
    }
    let tail = &points[points.len().saturating_sub(EXTRAPOLATION_POINTS)..];
    let slope = slope(tail).filter(|slope| *slope < 0.0)?;
    Some(Cost::Extrapolated(cost * (target / error).powf(1.0 / slope)))
}

/// d ln(error) / d ln(cost) by least squares; `None` with fewer than two different costs.
pub fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let logarithms: Vec<(f64, f64)> = points
        .iter()
        .map(|(cost, error)| (cost.ln(), error.ln()))
        .collect();
    let count = logarithms.len() as f64;
    let (x, y) = logarithms.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0, y + p.1));
    let (x, y) = (x / count, y / count);
    let (products, squares) = logarithms.iter().fold((0.0, 0.0), |(products, squares), p| {
        (products + (p.0 - x) * (p.1 - y), squares + (p.0 - x) * (p.0 - x))
    });
    (squares > 0.0).then(|| products / squares)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// error = 1/√cost.
    fn ladder() -> Vec<(f64, f64)> {
        [1.0, 10.0, 100.0, 1000.0]
            .map(|cost: f64| (cost, cost.powf(-0.5)))
            .to_vec()
    }

    fn value(cost: Option<Cost>) -> f64 {
        match cost.expect("a cost") {
            Cost::Interpolated(value) | Cost::Extrapolated(value) | Cost::AtMost(value) => value,
        }
    }

    #[test]
    fn powers_are_read_off_exactly() {
        let points = ladder();
        assert!((slope(&points).expect("a slope") + 0.5).abs() < 1e-12);
        let inside = cost_of(&points, 0.2);
        assert!(matches!(inside, Some(Cost::Interpolated(_))));
        assert!((value(inside) - 25.0).abs() < 1e-9);
        let beyond = cost_of(&points, 0.01);
        assert!(matches!(beyond, Some(Cost::Extrapolated(_))));
        assert!((value(beyond) - 1e4).abs() < 1e-5);
        assert_eq!(cost_of(&points, 2.0), Some(Cost::AtMost(1.0)));
    }

    #[test]
    fn an_error_that_comes_back_counts() {
        // Below the target once, by luck.
        let points = [(1.0, 0.5), (10.0, 0.05), (100.0, 0.5), (1000.0, 0.05)];
        let cost = value(cost_of(&points, 0.1));
        assert!((100.0..1000.0).contains(&cost), "{cost}");
    }

    #[test]
    fn what_does_not_fall_has_no_cost() {
        assert_eq!(cost_of(&[(1.0, 0.5), (10.0, 0.5)], 0.1), None);
        assert_eq!(cost_of(&[(1.0, 0.5)], 0.1), None);
        assert_eq!(cost_of(&[], 0.1), None);
    }

    #[test]
    fn costs_say_how_sure_they_are() {
        assert_eq!(Cost::Interpolated(1234.5).to_string(), "1234");
        assert_eq!(Cost::Extrapolated(0.01234).to_string(), "~0.0123");
        assert_eq!(Cost::AtMost(1.234e6).to_string(), "<1.23e6");
        assert_eq!(Cost::Interpolated(56.78).to_string(), "56.8");
    }
}
