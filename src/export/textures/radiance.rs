//! Radiance pictures (Ward, "Real pixels", Graphics Gems II, 1991): three mantissas of eight bits and one exponent.

use image::Rgb;
use image::codecs::hdr::HdrEncoder;

use super::encoding::{Encoded, FileMetadata};
use super::shared_exponent::RGBE;
use super::texels::Texels;
use crate::error::{Error, Result};

/// Encodes a Radiance picture. Values below 0 become 0, and so do channels of less than 1/512 of their texel's largest;
/// each is rounded to the nearest step. A factor of 2^stops is stated as EXPOSURE, by which readers divide.
///
/// # Errors
/// None are known: it is encoded in memory.
pub fn encode(texels: &Texels, notes: &FileMetadata<'_>) -> Result<Encoded> {
    // The header states exposure and unit, which that of the encoder lacks.
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

    // The encoder truncates, so it gets values that are rounded already.
    let rounded = |texel: &[f32; 3]| match RGBE.code(*texel) {
        (_, exponent) if exponent == RGBE.least => [0.0; 3],
        code => RGBE.value(code),
    };
    let stored: Vec<[f32; 3]> = texels.values().iter().map(rounded).collect();
    let pixels: Vec<Rgb<f32>> = stored.iter().map(|texel| Rgb(*texel)).collect();
    let mut file = Vec::new();
    let written = HdrEncoder::new(&mut file).encode(&pixels, width, height);
    written.map_err(|error| Error::failure(notes.location, error.to_string(), "report this"))?;

    // The header of the encoder, which ends with an empty line, is replaced by the fuller one above.
    let head = file.windows(2).position(|two| two == b"\n\n").unwrap_or_default();
    bytes.extend(&file[head..]);
    Ok(Encoded {
        bytes,
        stored,
        levels: 1,
    })
}
