//! E5B9G9R9: three mantissas of nine bits and an exponent in common (EXT_texture_shared_exponent).

use rayon::prelude::*;

use super::super::texels::Texels;

const MANTISSA_BITS: i32 = 9;
const BIAS: i32 = 15;
const MOST_EXPONENT: i32 = 31;
const MANTISSAS: f64 = 512.0;

/// The largest value: 511/512 · 2^16.
pub const MOST: f32 = 65408.0;

/// Words of four bytes, row by row, and the values that they stand for.
pub fn pack(texels: &Texels) -> (Vec<u8>, Vec<[f32; 3]>) {
    let words: Vec<u32> = texels.values().par_iter().map(|texel| word(*texel)).collect();
    let bytes = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    (bytes, words.into_iter().map(value).collect())
}

/// Each channel in the nearest step of the finest exponent that holds the largest.
fn word(texel: [f32; 3]) -> u32 {
    let channels = texel.map(|value| f64::from(value).clamp(0.0, f64::from(MOST)));
    let largest = channels.into_iter().fold(0.0, f64::max);
    if largest <= 0.0 {
        return 0;
    }
    let step = |exponent: i32| f64::from(exponent - BIAS - MANTISSA_BITS).exp2();
    let mut exponent = (largest.log2().floor() as i32 + 1 + BIAS).max(0);
    if (largest / step(exponent)).round() >= MANTISSAS {
        exponent += 1;
    }
    let exponent = exponent.min(MOST_EXPONENT);
    let [r, g, b] = channels.map(|value| (value / step(exponent)).round() as u32);
    r | (g << 9) | (b << 18) | ((exponent as u32) << 27)
}

fn value(word: u32) -> [f32; 3] {
    let step = f64::from((word >> 27) as i32 - BIAS - MANTISSA_BITS).exp2();
    [word, word >> 9, word >> 18].map(|mantissa| (f64::from(mantissa & 511) * step) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_within_half_a_step_of_the_largest() {
        for exponent in -14..16 {
            for share in [1.0, 0.9995, 0.75, 0.5001] {
                let largest = (f64::from(exponent).exp2() * share) as f32;
                let texel = [largest * 0.01, largest, largest * 0.3];
                for (wanted, got) in texel.iter().zip(value(word(texel))) {
                    assert!(
                        (wanted - got).abs() <= largest / 512.0 * 1.0001,
                        "{texel:?}: {got}"
                    );
                }
            }
        }
        for exact in [[MOST; 3], [1.0, 0.5, 0.0], [0.0; 3], [f32::exp2(-24.0), 0.0, 0.0]] {
            assert_eq!(value(word(exact)), exact);
        }
        assert_eq!(value(word([-1.0, 0.0, 1e-9])), [0.0; 3]);
    }
}
