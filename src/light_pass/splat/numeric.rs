//! Elementary functions for inner loops, without a call into libm.

/// The greatest integer not above `x`.
pub(super) fn floor(x: f64) -> i64 {
    let towards_zero = x as i64;
    towards_zero - i64::from(towards_zero as f64 > x)
}

/// Adding this rounds numbers below 2⁵¹ in magnitude to integers, which the lowest bits of the sum then hold.
const ROUNDING: f64 = 6_755_399_441_055_744.0;

/// The nearest integer for |x| < 2⁵¹, ties to even.
pub(super) fn round(x: f64) -> (f64, i64) {
    let shifted = x + ROUNDING;
    let whole = shifted.to_bits().wrapping_sub(ROUNDING.to_bits()) as i64;
    (shifted - ROUNDING, whole)
}

/// e^x with a relative error below 2e-9; x is clamped to ±700, so that 0 < result < ∞.
pub(super) fn exp(x: f64) -> f64 {
    let doublings = x.clamp(-700.0, 700.0) * std::f64::consts::LOG2_E;
    let (nearest, whole) = round(doublings);
    let f = doublings - nearest;
    // Minimax polynomial of the relative error over |f| ≤ 1/2.
    let power = 1.000_000_000_592_020_4
        + f * (0.693_147_205_600_509_9
            + f * (0.240_226_466_087_137_13
                + f * (0.055_503_289_975_187_046
                    + f * (0.009_618_519_534_387_448
                        + f * (0.001_339_986_036_269_023_6 + f * 0.000_153_375_768_201_456_85)))));
    power * f64::from_bits(((whole + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponentials_are_right() {
        for step in -7000..7000 {
            let x = f64::from(step) * 0.1;
            assert!((exp(x) / x.exp() - 1.0).abs() < 3e-9, "{x}");
        }
        assert!(exp(-1e9) >= 0.0 && exp(f64::NEG_INFINITY) >= 0.0);
    }

    #[test]
    fn roundings_are_right() {
        let most = (1_i64 << 50) as f64;
        for x in [0.0, 0.4, 0.6, -0.4, -0.6, 1e9 + 0.7, most, -most] {
            let (nearest, whole) = round(x);
            assert_eq!((nearest, whole), (x.round(), x.round() as i64), "{x}");
        }
    }

    #[test]
    fn floors_are_right() {
        for (x, whole) in [
            (0.0, 0),
            (0.5, 0),
            (-0.5, -1),
            (-2.0, -2),
            (7.999, 7),
            (-7.001, -8),
        ] {
            assert_eq!(floor(x), whole, "{x}");
        }
    }
}
