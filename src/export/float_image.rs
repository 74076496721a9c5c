//! Float images as read from files, with any number of channels.

use std::path::Path;

use super::{exr, pfm};
use crate::error::{Error, Result};
use crate::files;
use crate::illumination::compare::Grid;
use crate::optics::luminance;
use crate::settings::MAX_MAP_SIDE;

/// Maximum size of a file that is read [bytes].
const MAX_FILE_BYTES: u64 = 8 << 30;

/// One channel of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// `R`, `caustic.G`, `error.Y`, …
    pub name: String,
    /// `width × height` values, row by row.
    pub values: Vec<f32>,
}

/// Channels on a rectangle of texels. Row 0 is v = 0 in maps and the top in pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct FloatImage {
    /// Texels across, 1 to [`MAX_MAP_SIDE`].
    pub width: usize,
    /// Texels down, 1 to [`MAX_MAP_SIDE`].
    pub height: usize,
    /// Their names are distinct.
    pub channels: Vec<Channel>,
}

impl FloatImage {
    /// An image of channels `R/G/B`, of a width and height.
    pub fn of_rgb((width, height): (usize, usize), values: &[[f32; 3]]) -> Self {
        let channels = rgb_names("")
            .into_iter()
            .enumerate()
            .map(|(channel, name)| Channel {
                name,
                values: values.iter().map(|rgb| rgb[channel]).collect(),
            });
        Self {
            width,
            height,
            channels: channels.collect(),
        }
    }

    /// Reads an OpenEXR or PFM file, told apart by their first bytes.
    ///
    /// # Errors
    /// A file that cannot be read, is neither format, is damaged or has an unusable size.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = files::read_file(path, MAX_FILE_BYTES)?;
        let location = path.display().to_string();
        if exr::is_exr(&bytes) {
            exr::decode(&bytes, &location)
        } else if pfm::is_pfm(&bytes) {
            pfm::decode(&bytes, &location)
        } else {
            Err(Error::failure(
                location,
                "this is neither an OpenEXR nor a PFM image",
                "name an .exr or .pfm file",
            ))
        }
    }

    /// Values of a channel, if it exists.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels
            .iter()
            .find(|channel| channel.name == name)
            .map(|channel| channel.values.as_slice())
    }

    /// Texels of the channels `PREFIX.R/G/B` (`R/G/B` for an empty prefix), if all three exist.
    pub fn rgb(&self, prefix: &str) -> Option<Vec<[f32; 3]>> {
        let [r, g, b] = rgb_names(prefix).map(|name| self.channel(&name));
        let (r, g, b) = (r?, g?, b?);
        Some((0..r.len()).map(|i| [r[i], g[i], b[i]]).collect())
    }

    /// Luminance of the channels `PREFIX.R/G/B`, or of a lone `Y` for an empty prefix.
    pub fn luminance(&self, prefix: &str) -> Option<Grid> {
        let values = match self.rgb(prefix) {
            Some(rgb) => rgb.iter().map(luminance).collect(),
            None if prefix.is_empty() => self.channel("Y")?.iter().map(|y| f64::from(*y)).collect(),
            None => return None,
        };
        Some(Grid {
            width: self.width,
            height: self.height,
            values,
        })
    }
}

/// Channel names of a colour triple: `PREFIX.R/G/B`, or plain `R/G/B`.
pub fn rgb_names(prefix: &str) -> [String; 3] {
    ["R", "G", "B"].map(|channel| {
        if prefix.is_empty() {
            channel.to_string()
        } else {
            format!("{prefix}.{channel}")
        }
    })
}

/// Refuses sizes that neither maps nor pictures have, before memory is allocated.
pub(super) fn check_size(width: usize, height: usize, location: &str) -> Result<()> {
    let sides = 1..=MAX_MAP_SIDE;
    if sides.contains(&width) && sides.contains(&height) {
        return Ok(());
    }
    Err(Error::failure(
        location,
        format!("its size of {width}x{height} texels is outside 1 to {MAX_MAP_SIDE} a side"),
        "use a smaller image",
    ))
}
