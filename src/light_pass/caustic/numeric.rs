//! Elementary functions without a call into the mathematics library, for inner loops.

/// The greatest whole number not above `x`, without a call into the mathematics library.
pub(super) fn floor(x: f64) -> i64 {
    let towards_zero = x as i64;
    towards_zero - i64::from(towards_zero as f64 > x)
}

/// e^x to within 2e-9 of itself, without a call; 0 < result < ∞ for |x| up to 700, and x is kept to that.
pub(super) fn exp(x: f64) -> f64 {
    /// Adding it rounds to a whole number.
    const ROUNDING: f64 = 6_755_399_441_055_744.0;
    let doublings = x.clamp(-700.0, 700.0) * std::f64::consts::LOG2_E;
    let whole = (doublings + ROUNDING) - ROUNDING;
    let f = doublings - whole;
    // Least relative error over |f| ≤ 1/2.
    let power = 1.000_000_000_592_020_4
        + f * (0.693_147_205_600_509_9
            + f * (0.240_226_466_087_137_13
                + f * (0.055_503_289_975_187_046
                    + f * (0.009_618_519_534_387_448
                        + f * (0.001_339_986_036_269_023_6 + f * 0.000_153_375_768_201_456_85)))));
    power * f64::from_bits(((whole as i64 + 1023) as u64) << 52)
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
