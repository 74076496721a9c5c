//! Writes pictures: display colours as PNG, radiance as EXR.

use super::{FloatImage, exr};
use crate::error::{Error, Result};
use crate::eye_pass::{Picture, ToneMap, tone_mapping};
use crate::files;
use crate::optics::spectrum::xyz::Matrix3;

/// The bytes of a PNG file: radiance times `white_balance` × 2^`exposure_stops`, tone-mapped and sRGB-encoded; `location`
/// is named in errors.
///
/// # Errors
/// A size that the format cannot hold.
pub fn display_png(
    picture: &Picture,
    exposure_stops: f64,
    tone_map: ToneMap,
    white_balance: &Matrix3,
    location: &str,
) -> Result<Vec<u8>> {
    let balanced = picture.clone().white_balanced(white_balance);
    let rgba = tone_mapping::display_rgba8(&balanced, exposure_stops, tone_map);
    encode(picture.width, picture.height, rgba, location)
}

/// The bytes of an EXR file: radiance [W/(m² sr)], without exposure and tone mapping; `location` is named in errors.
///
/// # Errors
/// A size that the format cannot hold.
pub fn radiance_exr(picture: &Picture, location: &str) -> Result<Vec<u8>> {
    let size = (picture.width as usize, picture.height as usize);
    exr::encode(
        FloatImage::of_rgb(size, &picture.radiance),
        "radiance in W/(m^2 sr) (cd/m^2 / 683), linear sRGB; row 0 is the top",
        location,
    )
}

/// The bytes of a PNG file of `width × height` sRGB-encoded pixels, row 0 at the top; `location` is named in errors.
///
/// # Errors
/// A size that does not agree with the pixels or that the format cannot hold.
pub fn encode(width: u32, height: u32, rgba: Vec<u8>, location: &str) -> Result<Vec<u8>> {
    files::png::<image::Rgba<u8>>(width, height, rgba).map_err(|reason| {
        Error::failure(
            location,
            format!("the picture cannot be written ({reason})"),
            "choose another size",
        )
    })
}
