//! Reads an environment from a Radiance (.hdr) or OpenEXR file.

use std::io::Cursor;
use std::path::Path;

use image::codecs::hdr::HdrDecoder;
use image::codecs::openexr::OpenExrDecoder;
use image::{DynamicImage, ImageDecoder, ImageError, Limits};

use super::Environment;
use crate::error::{Error, Result};
use crate::files;
use crate::scene::gltf::guard;

/// Largest width and height [pixels]: the texture limit of common devices.
const LARGEST_SIDE: u32 = 16384;

/// Largest accepted radiance [W/(m² sr)]: what a map can hold, with room for several lights and their scales.
const BRIGHTEST: f32 = 1e36;

/// Reads an equirectangular image, whose format is recognised by its first bytes. Its values, linear sRGB, are taken as
/// radiance [W/(m² sr)]; those of a Radiance file are divided by its stated exposure, as the format requires.
///
/// # Errors
/// A file that cannot be read, is neither format, is damaged, has an unusable size or takes more than
/// `memory_limit_bytes`; values that are negative, infinite, not a number or above 1e36.
pub fn read(path: &Path, memory_limit_bytes: u64) -> Result<Environment> {
    let bytes = files::read_file(path, memory_limit_bytes)?;
    let refused = |what: String| {
        Error::failure(
            path.display().to_string(),
            what,
            "name an equirectangular image as .hdr or .exr",
        )
    };
    // Decoders may panic on damaged files.
    let pixels = guard::without_panic(|| decode(&bytes, memory_limit_bytes))
        .unwrap_or_else(|| Err("is damaged".into()))
        .map_err(refused)?;
    let (width, height) = (pixels.width() as usize, pixels.height() as usize);
    let radiance: Vec<[f32; 3]> = pixels.into_raw().as_chunks().0.to_vec();
    if radiance
        .iter()
        .flatten()
        .any(|value| value.is_finite() && *value > BRIGHTEST)
    {
        return Err(refused(format!(
            "holds values above {BRIGHTEST:e} W/(m² sr), whose sums a map cannot hold"
        )));
    }
    Environment::new(width, height, radiance).ok_or_else(|| {
        refused("holds values that are not radiance: negative, infinite or not a number".into())
    })
}

fn decode(bytes: &[u8], most_bytes: u64) -> std::result::Result<image::Rgb32FImage, String> {
    let reader = Cursor::new(bytes);
    if bytes.starts_with(b"#?") {
        let decoder = HdrDecoder::new(reader).map_err(reason)?;
        let exposure = decoder.metadata().exposure.unwrap_or(1.0);
        let mut pixels = decoded(decoder, most_bytes)?;
        if exposure != 1.0 {
            pixels.iter_mut().for_each(|value| *value /= exposure);
        }
        Ok(pixels)
    } else if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        decoded(OpenExrDecoder::new(reader).map_err(reason)?, most_bytes)
    } else {
        Err("is neither a Radiance nor an OpenEXR image".into())
    }
}

fn decoded(
    mut decoder: impl ImageDecoder,
    most_bytes: u64,
) -> std::result::Result<image::Rgb32FImage, String> {
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 {
        return Err("has no pixels".into());
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(LARGEST_SIDE);
    limits.max_image_height = Some(LARGEST_SIDE);
    limits.max_alloc = Some(most_bytes);
    decoder.set_limits(limits).map_err(reason)?;
    // Leaves room for the environment that is made from the decoded image.
    if decoder.total_bytes() > most_bytes / 2 {
        return Err(format!(
            "takes more memory than the limit of {} MB",
            most_bytes / 1_000_000
        ));
    }
    Ok(DynamicImage::from_decoder(decoder).map_err(reason)?.into_rgb32f())
}

fn reason(error: ImageError) -> String {
    let text = error.to_string();
    format!("cannot be decoded ({})", text.lines().next().unwrap_or_default())
}
