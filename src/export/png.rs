//! 8-bit pictures.

use std::io::Cursor;

use crate::error::{Error, Result};

/// The bytes of a PNG file of `width × height` sRGB-encoded pixels, row 0 at the top; `location` is named in errors.
///
/// # Errors
/// A size that does not agree with the pixels or that the format cannot hold.
pub fn encode(width: u32, height: u32, rgba: Vec<u8>, location: &str) -> Result<Vec<u8>> {
    let unusable = |reason: String| {
        Error::failure(
            location,
            format!("the picture cannot be written ({reason})"),
            "choose another size",
        )
    };
    let image = image::RgbaImage::from_raw(width, height, rgba)
        .ok_or_else(|| unusable(format!("{width}x{height} is not its size")))?;
    let mut bytes = Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, image::ImageFormat::Png)
        .map_err(|error| unusable(error.to_string()))?;
    Ok(bytes.into_inner())
}
