//! File formats of textures.

use half::f16;
use serde::Serialize;

use super::atlas::AtlasOptions;
use super::ktx2::{self, Packing};
use super::shared_exponent::RGBE;
use super::texels::Texels;
use super::{png16, radiance};
use crate::error::{Error, Result};
use crate::export::{FloatImage, Quantity, exr};

/// How numbers between black and white are coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Transfer {
    /// IEC 61966-2-1: finer steps where it is dark.
    Srgb,
    /// Proportional to light.
    Linear,
}

/// A kind of file and its variants.
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
        /// How they are coded.
        transfer: Transfer,
    },
    /// Radiance: three bytes and an exponent in common.
    #[serde(rename = "hdr rgbe")]
    Radiance,
    /// KTX 2.0 for graphics cards, with zstd.
    Ktx2 {
        /// How texels are packed.
        packing: Packing,
        /// Whether it holds all sizes down to one texel, or the image alone.
        mips: bool,
    },
}

/// What a file says of itself.
#[derive(Clone, Debug)]
pub struct FileMetadata<'a> {
    /// What its numbers mean.
    pub quantity: Quantity,
    /// What light was multiplied by: 2 to this power.
    pub exposure_stops: f64,
    /// Which light, on which surfaces.
    pub what: String,
    /// Where it will be, for errors.
    pub location: &'a str,
}

impl FileMetadata<'_> {
    /// One sentence.
    pub fn comment(&self) -> String {
        format!(
            "{} in {} x 2^{}, linear sRGB primaries; row 0 is v = 0",
            self.what,
            self.quantity.unit(),
            self.exposure_stops
        )
    }
}

/// A file and what is read of it.
#[derive(Clone, Debug)]
pub struct Encoded {
    /// The whole file.
    pub bytes: Vec<u8>,
    /// The values that a reader gets, row by row.
    pub stored: Vec<[f32; 3]>,
    /// How many sizes of the image it holds.
    pub levels: usize,
}

impl Encoding {
    /// Of its files' names.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Half | Self::Float => "exr",
            Self::Png16 { .. } => "png",
            Self::Radiance => "hdr",
            Self::Ktx2 { .. } => "ktx2",
        }
    }

    /// The largest value that it holds.
    pub fn most(self) -> f32 {
        match self {
            Self::Half => f16::MAX.to_f32(),
            Self::Float => f32::MAX,
            Self::Png16 { .. } => 1.0,
            Self::Radiance => RGBE.most,
            Self::Ktx2 { packing, .. } => packing.most(),
        }
    }

    /// How maps lie side by side: the borders of blocks are theirs, too.
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

    /// As people call it.
    fn name(self) -> &'static str {
        match self {
            Self::Half => "a half float",
            Self::Float => "a float",
            Self::Png16 { .. } => "a PNG",
            Self::Radiance => "a Radiance file",
            Self::Ktx2 {
                packing: Packing::Rgb9e5,
                ..
            } => "Rgb9e5",
            Self::Ktx2 {
                packing: Packing::Bc6h,
                ..
            } => "BC6H",
        }
    }

    /// The bytes of a file of a texture.
    ///
    /// # Errors
    /// Light beyond what the format holds, unless it ends at white; sizes that it cannot have.
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

    /// Nothing is clamped but at a white that was chosen.
    fn check_range(self, texels: &Texels, notes: &FileMetadata<'_>) -> Result<()> {
        let (most, peak) = (self.most(), texels.peak());
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
                "{count} of its texels are above {most}, the most that {} holds, the brightest at {peak}",
                self.name()
            ),
            format!("choose {or_floats}another unit or --exposure {stops}"),
        ))
    }
}
