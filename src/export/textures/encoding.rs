//! File formats of textures.

use half::f16;
use serde::Serialize;

use super::atlas::AtlasOptions;
use super::ktx2::{self, Packing};
use super::shared_exponent::{RGB9E5, RGBE};
use super::texels::Texels;
use super::{bc6h, png16, radiance};
use crate::error::{Error, Result};
use crate::export::{FloatImage, Quantity, exr};

/// Transfer function of integers between black and white.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Transfer {
    /// IEC 61966-2-1, with finer steps in the dark.
    Srgb,
    /// Proportional to light.
    Linear,
}

/// File format and its variant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "format", rename_all = "lowercase")]
pub enum Encoding {
    /// OpenEXR of 16-bit floats: 11 bits of precision, up to 65504.
    #[serde(rename = "exr half")]
    Half,
    /// OpenEXR of 32-bit floats.
    #[serde(rename = "exr float")]
    Float,
    /// PNG of 16-bit integers, 0 to 1.
    #[serde(rename = "png 16")]
    Png16 {
        /// Transfer function of the integers.
        transfer: Transfer,
    },
    /// Radiance: three bytes and a shared exponent.
    #[serde(rename = "hdr rgbe")]
    Radiance,
    /// KTX 2.0 with Zstandard, for graphics cards.
    Ktx2 {
        /// Texel format.
        packing: Packing,
        /// Whether to add the mip levels, down to one texel.
        mips: bool,
    },
}

/// Metadata of a file.
#[derive(Clone, Debug)]
pub struct FileMetadata<'a> {
    /// Meaning of its numbers.
    pub quantity: Quantity,
    /// Light was multiplied by 2 to this power [stops].
    pub exposure_stops: f64,
    /// Which light, and on which surfaces.
    pub what: String,
    /// Path of the file, for errors.
    pub location: &'a str,
}

impl FileMetadata<'_> {
    /// All of it in one sentence.
    pub fn comment(&self) -> String {
        format!(
            "{} in {} x 2^{}, linear sRGB primaries; row 0 is v = 0",
            self.what,
            self.quantity.unit(),
            self.exposure_stops
        )
    }
}

/// A file, and the values that it decodes to.
#[derive(Clone, Debug)]
pub struct Encoded {
    /// The whole file.
    pub bytes: Vec<u8>,
    /// Values that a reader gets, row by row.
    pub stored: Vec<[f32; 3]>,
    /// Number of mip levels.
    pub levels: usize,
}

impl Encoding {
    /// Extension of file names, name in messages, and largest value.
    fn traits(self) -> (&'static str, &'static str, f32) {
        match self {
            Self::Half => ("exr", "a half float", f16::MAX.to_f32()),
            Self::Float => ("exr", "a float", f32::MAX),
            Self::Png16 { .. } => ("png", "a PNG", 1.0),
            Self::Radiance => ("hdr", "a Radiance file", RGBE.most),
            Self::Ktx2 { packing, .. } => match packing {
                Packing::Rgb9e5 => ("ktx2", "Rgb9e5", RGB9E5.most),
                Packing::Bc6h => ("ktx2", "BC6H", bc6h::MOST),
            },
        }
    }

    /// Extension of file names.
    pub fn extension(self) -> &'static str {
        self.traits().0
    }

    /// Largest value that the format holds.
    pub fn most(self) -> f32 {
        self.traits().2
    }

    /// Layout of an atlas; no two maps share a compression block.
    pub fn atlas_options(self, most_side: usize) -> AtlasOptions {
        let (gutter, grid) = match self {
            Self::Ktx2 {
                packing: Packing::Bc6h,
                ..
            } => (4, 4),
            _ => (2, 1),
        };
        AtlasOptions {
            most_side,
            gutter,
            grid,
        }
    }

    /// Encodes a texture as a file.
    ///
    /// # Errors
    /// Light beyond the range of the format, unless white is chosen to clip; a size that the format cannot hold.
    pub fn encode(self, texels: &Texels, notes: &FileMetadata<'_>) -> Result<Encoded> {
        self.check_range(texels, notes)?;
        match self {
            Self::Half => {
                let halves: Vec<[f16; 3]> = texels
                    .values()
                    .iter()
                    .map(|texel| texel.map(f16::from_f32))
                    .collect();
                Ok(Encoded {
                    bytes: exr::encode_half(&halves, texels.size(), &notes.comment(), notes.location)?,
                    stored: halves.iter().map(|texel| texel.map(f16::to_f32)).collect(),
                    levels: 1,
                })
            }
            Self::Float => Ok(Encoded {
                bytes: exr::encode(
                    FloatImage::of_rgb(texels.size(), texels.values()),
                    &notes.comment(),
                    notes.location,
                )?,
                stored: texels.values().to_vec(),
                levels: 1,
            }),
            Self::Png16 { transfer } => png16::encode(texels, transfer, notes),
            Self::Radiance => radiance::encode(texels, notes),
            Self::Ktx2 { packing, mips } => ktx2::encode(texels, packing, mips, notes),
        }
    }

    /// Refuses values that would be clamped, except above a chosen white.
    fn check_range(self, texels: &Texels, notes: &FileMetadata<'_>) -> Result<()> {
        let ((_, name, most), peak) = (self.traits(), texels.peak());
        if matches!(self, Self::Png16 { .. }) || peak <= most {
            return Ok(());
        }
        let is_above = |texel: &&[f32; 3]| texel.iter().any(|value| *value > most);
        let count = texels.values().iter().filter(is_above).count();
        let stops = notes.exposure_stops - f64::from(peak / most).log2().ceil();
        let or_floats = match self {
            Self::Half => "--bits 32, ",
            _ => "",
        };
        Err(Error::failure(
            notes.location,
            format!(
                "{count} of its texels are above {most}, the most that {name} holds, the brightest at {peak}"
            ),
            format!("choose {or_floats}another unit or --exposure {stops}"),
        ))
    }
}
