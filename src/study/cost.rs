//! What an error costs, read off a ladder of measurements.

/// What reaching an error takes, in the unit of the measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cost {
    /// Between two measurements.
    Interpolated(f64),
    /// Beyond the last measurement, on the slope of the last ones.
    Extrapolated(f64),
    /// The first measurement reaches it already.
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

/// `123`, `1.23`, `0.00123`, `1.23e6`.
pub(super) fn three_digits(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if value < 0.0 {
        return format!("-{}", three_digits(-value));
    }
    if !(1e-3..1e5).contains(&value) {
        return format!("{value:.2e}");
    }
    let digits_before = value.log10().floor() as i32 + 1;
    let decimals = usize::try_from(3 - digits_before).unwrap_or(0);
    format!("{value:.decimals$}")
}

/// Measurements from which an extrapolation takes its slope.
const EXTRAPOLATION_POINTS: usize = 3;

/// Cost from which on the error stays at or below `target`, by linear interpolation of logarithms. `points` are (cost,
/// error), both above zero, from the coarsest measurement to the finest. `None` where the error does not fall, or
/// nothing was measured.
pub fn cost_of(points: &[(f64, f64)], target: f64) -> Option<Cost> {
    let Some(above) = points.iter().rposition(|(_, error)| *error > target) else {
        return points.first().map(|(cost, _)| Cost::AtMost(*cost));
    };
    match points.get(above + 1) {
        Some(&below) => Some(Cost::Interpolated(between(points[above], below, target))),
        None => {
            let tail = &points[points.len().saturating_sub(EXTRAPOLATION_POINTS)..];
            let slope = slope(tail).filter(|slope| *slope < 0.0)?;
            let (cost, error) = points[above];
            Some(Cost::Extrapolated(cost * (target / error).powf(1.0 / slope)))
        }
    }
}

fn between((cost_a, error_a): (f64, f64), (cost_b, error_b): (f64, f64), target: f64) -> f64 {
    let share = (error_a / target).ln() / (error_a / error_b).ln();
    cost_a * (cost_b / cost_a).powf(share)
}

/// d ln(error) / d ln(cost) of the line of least squares; `None` with less than two different costs.
pub fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let logarithms: Vec<(f64, f64)> = points
        .iter()
        .filter(|(cost, error)| *cost > 0.0 && *error > 0.0)
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
