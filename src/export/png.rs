//! 8-bit pictures.

use crate::error::{Error, Result};
use crate::files;

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
