//! Pictures as PNG.

use std::io::Cursor;

use image::{EncodableLayout, ImageBuffer, ImageFormat, PixelWithColorType};

/// A picture of so many pixels as PNG, from its pixels' codes row by row; one clause where its size is wrong or too large.
pub fn png<P>(width: u32, height: u32, codes: Vec<P::Subpixel>) -> Result<Vec<u8>, String>
where
    P: PixelWithColorType,
    [P::Subpixel]: EncodableLayout,
{
    let image = ImageBuffer::<P, _>::from_raw(width, height, codes);
    let image = image.ok_or_else(|| format!("{width}x{height} is not its size"))?;
    let mut bytes = Cursor::new(Vec::new());
    let written = image.write_to(&mut bytes, ImageFormat::Png);
    written.map_err(|error| error.to_string())?;
    Ok(bytes.into_inner())
}
