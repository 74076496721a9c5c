//! Radiance pictures (Ward, "Real pixels", Graphics Gems II, 1991): three mantissas of eight bits and one exponent.

use image::Rgb;
use image::codecs::hdr::HdrEncoder;

use super::encoding::{Encoded, Notes};
use super::texels::Texels;
use crate::error::{Error, Result};

/// The largest value: 255/256 · 2^127.
pub const MOST: f32 = 255.0 / 256.0 * 1.701_411_8e38;

/// The file. Values below 0 become 0, and so do channels of less than 1/512 of their texel's largest; each is rounded to
/// the nearest step. Multiplied by 2^stops, it says so by EXPOSURE, by which readers divide.
///
/// # Errors
/// None that is known of: it is written in memory.
pub fn encode(texels: &Texels, notes: &Notes<'_>) -> Result<Encoded> {
    let (width, height) = texels.size();
    let mut bytes = format!(
        "#?RADIANCE\nSOFTWARE=nephroid {}\nFORMAT=32-bit_rle_rgbe\n",
        env!("CARGO_PKG_VERSION")
    )
    .into_bytes();
    if notes.exposure_stops != 0.0 {
        bytes.extend(format!("EXPOSURE={}\n", notes.exposure_stops.exp2()).bytes());
    }
    let comment: String = notes.comment().chars().filter(|c| !c.is_control()).collect();
    bytes.extend(format!("# {comment}").bytes());
    // The encoder cuts what it cannot hold, and keeps values that are rounded already.
    let stored: Vec<[f32; 3]> = texels.values().iter().map(|texel| value(code(*texel))).collect();
    let pixels: Vec<Rgb<f32>> = stored.iter().map(|texel| Rgb(*texel)).collect();
    let mut file = Vec::new();
    let written = HdrEncoder::new(&mut file).encode(&pixels, width, height);
    written.map_err(|error| Error::failure(notes.location, error.to_string(), "report this"))?;
    // Its own head ends with an empty line; this one says more.
    let head = file.windows(2).position(|two| two == b"\n\n").unwrap_or_default();
    bytes.extend(&file[head..]);
    Ok(Encoded {
        bytes,
        stored,
        levels: 1,
    })
}

/// Mantissas and exponent of a texel.
fn code(texel: [f32; 3]) -> [u8; 4] {
    let [r, g, b] = texel.map(|value| f64::from(value).max(0.0));
    let largest = r.max(g).max(b);
    if largest <= 0.0 {
        return [0; 4];
    }
    // largest = m · 2^exponent with m in [0.5, 1), unless it would be rounded up to 256/256.
    let mut exponent = largest.log2().floor() as i32 + 1;
    if (largest * f64::from(8 - exponent).exp2()).round() >= 256.0 {
        exponent += 1;
    }
    if exponent <= -128 {
        return [0; 4];
    }
    let scale = f64::from(8 - exponent).exp2();
    let [r, g, b] = [r, g, b].map(|value| (value * scale).round() as u8);
    [r, g, b, (exponent + 128).min(255) as u8]
}

/// What readers make of it, before they divide by the exposure.
fn value([r, g, b, exponent]: [u8; 4]) -> [f32; 3] {
    if exponent == 0 {
        return [0.0; 3];
    }
    let scale = f64::from(i32::from(exponent) - 136).exp2();
    [r, g, b].map(|mantissa| (f64::from(mantissa) * scale) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_within_half_a_step_of_the_largest() {
        for exponent in -40..40 {
            for share in [1.0, 0.999, 0.75, 0.5001, 0.5] {
                let largest = (f64::from(exponent).exp2() * share) as f32;
                let texel = [largest, largest * 0.3, largest * 0.01];
                let got = value(code(texel));
                for (wanted, got) in texel.iter().zip(got) {
                    assert!(
                        (wanted - got).abs() <= largest / 256.0 * 1.0001,
                        "{texel:?}: {got}"
                    );
                }
            }
        }
        assert_eq!(code([0.0, -1.0, 0.0]), [0; 4]);
        assert_eq!(code([1e-39, 0.0, 0.0]), [0; 4]);
        assert_eq!(value(code([MOST; 3])), [MOST; 3]);
    }
}
