//! Colours whose channels share an exponent: one value is mantissa · 2^(exponent − bits of a mantissa).

/// A format of such colours.
#[derive(Clone, Copy, Debug)]
pub struct SharedExponent {
    /// Bits of a mantissa.
    pub bits: i32,
    /// Smallest exponent.
    pub least: i32,
    /// Largest value.
    pub most: f32,
}

/// Radiance: eight bits and the exponent + 128. Readers take colours of the smallest exponent for black.
pub const RGBE: SharedExponent = SharedExponent {
    bits: 8,
    least: -127,
    // 255/256 · 2^127
    most: 255.0 / 256.0 * 1.701_411_8e38,
};

/// E5B9G9R9: nine bits and the exponent + 15.
pub const RGB9E5: SharedExponent = SharedExponent {
    bits: 9,
    least: -15,
    // 511/512 · 2^16
    most: 65408.0,
};

/// How E5B9G9R9 is stored.
pub fn rgb9e5_word(([r, g, b], exponent): ([u32; 3], i32)) -> [u8; 4] {
    let exponent = (exponent - RGB9E5.least) as u32;
    (r | g << 9 | b << 18 | exponent << 27).to_le_bytes()
}

impl SharedExponent {
    /// Mantissas and exponent. The exponent is the smallest that holds the largest channel; each channel is rounded to
    /// its nearest step. Values below 0 become 0.
    pub fn code(self, texel: [f32; 3]) -> ([u32; 3], i32) {
        let channels = texel.map(|value| f64::from(value).clamp(0.0, f64::from(self.most)));
        let largest = channels.into_iter().fold(0.0, f64::max);
        let mut exponent = (largest.log2().floor() as i32).saturating_add(1).max(self.least);
        let steps = |value: f64, exponent: i32| (value * f64::from(self.bits - exponent).exp2()).round();
        // The mantissa may round up to the next power of two.
        if steps(largest, exponent) >= f64::from(self.bits).exp2() {
            exponent += 1;
        }
        (channels.map(|value| steps(value, exponent) as u32), exponent)
    }

    /// The colour that a reader gets.
    pub fn value(self, (mantissas, exponent): ([u32; 3], i32)) -> [f32; 3] {
        let step = f64::from(exponent - self.bits).exp2();
        mantissas.map(|mantissa| (f64::from(mantissa) * step) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_within_half_a_step_of_the_largest() {
        for (format, exponents) in [(RGBE, -40..40), (RGB9E5, -14..16)] {
            for exponent in exponents {
                for share in [1.0, 0.9995, 0.75, 0.5001, 0.5] {
                    let largest = (f64::from(exponent).exp2() * share) as f32;
                    let texel = [largest * 0.01, largest, largest * 0.3];
                    for (wanted, got) in texel.iter().zip(format.value(format.code(texel))) {
                        let bound = largest / f32::exp2(format.bits as f32) * 1.0001;
                        assert!((wanted - got).abs() <= bound, "{texel:?}: {got}");
                    }
                }
            }
            for exact in [
                [format.most; 3],
                [1.0, 0.5, 0.0],
                [0.0; 3],
                [f32::exp2(-24.0), 0.0, 0.0],
            ] {
                assert_eq!(format.value(format.code(exact)), exact);
            }
            assert_eq!(format.code([-1.0, 0.0, 0.0]), ([0; 3], format.least));
        }
        assert_eq!(RGBE.code([0.0, 0.0, 1e-39]).1, RGBE.least, "black");
        assert_eq!(RGB9E5.value(RGB9E5.code([-1.0, 0.0, 1e-9])), [0.0; 3]);
    }
}
