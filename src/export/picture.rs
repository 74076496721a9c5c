//! Writes pictures: display colours as PNG, radiance as EXR.

use std::path::Path;

use super::{FloatImage, exr};
use crate::error::{Error, Result};
use crate::eye_pass::{Picture, View, tone_mapping};
use crate::files;

impl Picture {
    /// Writes a `.png` with the view's exposure and tone map, or an `.exr` of radiance.
    ///
    /// # Errors
    /// A name that ends in neither; a size that the format cannot hold; output that cannot be written.
    pub fn save(&self, path: impl AsRef<Path>, view: &View) -> Result<()> {
        let path = path.as_ref();
        let location = path.display().to_string();
        let bytes = if holds_radiance(path)? {
            radiance_exr(self, &location)?
        } else {
            display_png(self, view, &location)?
        };
        files::write_atomically(path, |writer| writer.write_all(&bytes))
    }
}

/// Whether a picture file holds radiance [W/(m² sr)] rather than display colours.
///
/// # Errors
/// A name that ends neither in .png nor in .exr.
pub fn holds_radiance(path: &Path) -> Result<bool> {
    let extension = path.extension().unwrap_or_default();
    match extension.to_string_lossy().to_lowercase().as_str() {
        "png" => Ok(false),
        "exr" => Ok(true),
        _ => Err(Error::usage(
            path.display().to_string(),
            "a picture's name has to say its format",
            "name a file that ends in .png or .exr",
        )),
    }
}

/// Encodes as PNG: radiance at the view's exposure, tone-mapped and sRGB-encoded; `location` is named in errors.
///
/// # Errors
/// A size that the format cannot hold.
pub fn display_png(picture: &Picture, view: &View, location: &str) -> Result<Vec<u8>> {
    let rgba = tone_mapping::display_rgba8(picture, view.exposure_stops, view.tone_map);
    encode(picture.width, picture.height, rgba, location)
}

/// Encodes as EXR: radiance [W/(m² sr)], without exposure and tone mapping; `location` is named in errors.
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

/// Encodes `width × height` sRGB-encoded pixels as PNG, row 0 at the top; `location` is named in errors.
///
/// # Errors
/// A size that does not match the pixels, or that the format cannot hold.
pub fn encode(width: u32, height: u32, rgba: Vec<u8>, location: &str) -> Result<Vec<u8>> {
    files::png::<image::Rgba<u8>>(width, height, rgba).map_err(|reason| {
        Error::failure(
            location,
            format!("the picture cannot be written ({reason})"),
            "choose another size",
        )
    })
}
