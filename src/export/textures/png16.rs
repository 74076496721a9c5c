//! PNG with 16 bits per channel.

use png::{BitDepth, ColorType, ScaledFloat, SrgbRenderingIntent};

use super::encoding::{Encoded, FileMetadata, Transfer};
use super::texels::Texels;
use crate::error::{Error, Result};
use crate::optics::LinearSrgb;

/// Code of the value 1.
const WHITE: f64 = u16::MAX as f64;

/// Encodes values from 0 to 1; values outside are clamped. The file states the transfer function, and the exposure in a
/// text chunk.
///
/// # Errors
/// A size that the format cannot hold.
pub fn encode(texels: &Texels, transfer: Transfer, notes: &FileMetadata<'_>) -> Result<Encoded> {
    let codes: Vec<[u16; 3]> = texels
        .values()
        .iter()
        .map(|texel| texel.map(|value| code(f64::from(value), transfer)))
        .collect();
    let unusable = |error: png::EncodingError| {
        let what = format!("the texture cannot be written ({error})");
        Error::failure(notes.location, what, "choose another size")
    };
    let mut bytes = Vec::new();
    let mut writer = encoder(&mut bytes, texels.size(), transfer, notes)
        .and_then(png::Encoder::write_header)
        .map_err(unusable)?;
    let data: Vec<u8> = codes
        .as_flattened()
        .iter()
        .flat_map(|code| code.to_be_bytes())
        .collect();
    writer.write_image_data(&data).map_err(unusable)?;
    writer.finish().map_err(unusable)?;
    let value = |code: u16| value(code, transfer) as f32;
    Ok(Encoded {
        bytes,
        stored: codes.into_iter().map(|texel| texel.map(value)).collect(),
        levels: 1,
    })
}

/// An encoder with everything that precedes the image.
fn encoder<'a>(
    bytes: &'a mut Vec<u8>,
    (width, height): (usize, usize),
    transfer: Transfer,
    notes: &FileMetadata<'_>,
) -> std::result::Result<png::Encoder<'static, &'a mut Vec<u8>>, png::EncodingError> {
    let mut encoder = png::Encoder::new(bytes, width as u32, height as u32);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Sixteen);
    match transfer {
        Transfer::Srgb => encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric),
        Transfer::Linear => encoder.set_source_gamma(ScaledFloat::new(1.0)),
    }
    // Names may contain letters that only this kind of chunk supports.
    encoder.add_itxt_chunk("Description".into(), notes.comment())?;
    for (keyword, text) in [
        (
            "Software",
            concat!("nephroid ", env!("CARGO_PKG_VERSION")).to_owned(),
        ),
        ("Unit", notes.quantity.unit().to_owned()),
        ("Exposure", format!("{} stops", notes.exposure_stops)),
    ] {
        encoder.add_text_chunk(keyword.into(), text)?;
    }
    Ok(encoder)
}

/// Code nearest to a value.
fn code(value: f64, transfer: Transfer) -> u16 {
    let share = match transfer {
        Transfer::Srgb => LinearSrgb::encode_channel(value),
        Transfer::Linear => value.clamp(0.0, 1.0),
    };
    (share * WHITE).round() as u16
}

/// Value of a code.
fn value(code: u16, transfer: Transfer) -> f64 {
    let share = f64::from(code) / WHITE;
    match transfer {
        Transfer::Linear => share,
        Transfer::Srgb => LinearSrgb::decode(share),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_stand_for_what_they_were_made_from() {
        for transfer in [Transfer::Srgb, Transfer::Linear] {
            for exact in [0, 1, 2000, 2650, 2660, 40_000, u16::MAX] {
                assert_eq!(code(value(exact, transfer), transfer), exact);
            }
            assert_eq!((code(-1.0, transfer), code(7.0, transfer)), (0, u16::MAX));
        }
    }
}
