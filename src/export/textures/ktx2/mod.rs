//! KTX 2.0 with zstd: what graphics cards sample as it is.
//!
//! Khronos, "KTX File Format Specification" 2.0; the data format descriptor by the "Khronos Data Format Specification" 1.3.

use rayon::prelude::*;
use serde::Serialize;

use super::encoding::{Encoded, Notes};
use super::texels::Texels;
use crate::error::{Error, Result};

mod bc6h;
mod descriptor;

/// What every file starts with.
const IDENTIFIER: [u8; 12] = *b"\xABKTX 20\xBB\r\n\x1A\n";
/// Bytes of the header with the index of what follows, and of an entry of the index of levels.
const HEADER_BYTES: usize = 80;
const LEVEL_BYTES: usize = 24;
/// Zstandard, as the format numbers it.
const ZSTD_SCHEME: u32 = 2;
/// How hard zstd tries, 1 to 22: beyond, it gains little on floats.
const ZSTD_LEVEL: i32 = 12;

/// How texels are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Packing {
    /// Nine bits a channel and one exponent, 32 bits a texel.
    Rgb9e5,
    /// Blocks of 4 × 4 texels, 8 bits a texel.
    Bc6h,
}

impl Packing {
    /// The largest value that it holds.
    pub fn most(self) -> f32 {
        match self {
            Self::Rgb9e5 => MOST,
            Self::Bc6h => bc6h::MOST,
        }
    }

    /// Its number in Vulkan: VK_FORMAT_E5B9G9R9_UFLOAT_PACK32, VK_FORMAT_BC6H_UFLOAT_BLOCK.
    fn vulkan_format(self) -> u32 {
        match self {
            Self::Rgb9e5 => 123,
            Self::Bc6h => 143,
        }
    }

    /// Bytes that have an order of their own.
    fn type_bytes(self) -> u32 {
        match self {
            Self::Rgb9e5 => 4,
            Self::Bc6h => 1,
        }
    }

    /// The bytes of one size of an image, and the values that are read of them.
    fn pack(self, texels: &Texels) -> (Vec<u8>, Vec<[f32; 3]>) {
        match self {
            Self::Rgb9e5 => pack(texels),
            Self::Bc6h => bc6h::pack(texels),
        }
    }
}

/// One size of the image.
struct Level {
    packed: Vec<u8>,
    compressed: Vec<u8>,
}

/// The file: all sizes down to one texel where `mips`, or the image alone. Values below 0 become 0.
///
/// # Errors
/// Memory that zstd does not get.
pub fn encode(texels: &Texels, packing: Packing, mips: bool, notes: &Notes<'_>) -> Result<Encoded> {
    let (packed, stored) = packing.pack(texels);
    let mut images = vec![packed];
    let mut size = texels.size();
    let mut smaller = texels.clone();
    while mips && size != (1, 1) {
        smaller = smaller.halved();
        size = smaller.size();
        images.push(packing.pack(&smaller).0);
    }
    let levels: Result<Vec<Level>> = images
        .into_par_iter()
        .map(|packed| {
            let compressed = zstd::bulk::compress(&packed, ZSTD_LEVEL).map_err(|error| {
                Error::failure(
                    notes.location,
                    format!("the texture cannot be compressed ({error})"),
                    "write smaller maps",
                )
            })?;
            Ok(Level { packed, compressed })
        })
        .collect();
    let levels = levels?;
    Ok(Encoded {
        bytes: container(texels.size(), packing, &levels, notes),
        stored,
        levels: levels.len(),
    })
}

/// Header, index of levels, descriptor, notes, and the levels from the smallest on.
fn container(
    (width, height): (usize, usize),
    packing: Packing,
    levels: &[Level],
    notes: &Notes<'_>,
) -> Vec<u8> {
    let descriptor = descriptor::descriptor(packing);
    let about = about(notes);
    let descriptor_at = HEADER_BYTES + LEVEL_BYTES * levels.len();
    let about_at = descriptor_at + descriptor.len();
    let mut bytes = IDENTIFIER.to_vec();
    let header = [
        packing.vulkan_format(),
        packing.type_bytes(),
        width as u32,
        height as u32,
        // No depth, no array, one face.
        0,
        0,
        1,
        levels.len() as u32,
        ZSTD_SCHEME,
        descriptor_at as u32,
        descriptor.len() as u32,
        about_at as u32,
        about.len() as u32,
    ];
    bytes.extend(header.iter().flat_map(|word| word.to_le_bytes()));
    // No global data.
    bytes.extend([0; 16]);
    let mut at = about_at + about.len();
    let mut index = Vec::new();
    for level in levels.iter().rev() {
        index.push([at, level.compressed.len(), level.packed.len()]);
        at += level.compressed.len();
    }
    for entry in index.iter().rev() {
        bytes.extend(entry.iter().flat_map(|word| (*word as u64).to_le_bytes()));
    }
    bytes.extend(descriptor);
    bytes.extend(about);
    for level in levels.iter().rev() {
        bytes.extend(&level.compressed);
    }
    bytes
}

/// Keys and values, by the keys' order.
fn about(notes: &Notes<'_>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (key, value) in [
        // Columns go right, rows down: (0, 0) is glTF's origin of coordinates.
        ("KTXorientation", "rd".to_owned()),
        (
            "KTXwriter",
            concat!("nephroid ", env!("CARGO_PKG_VERSION")).to_owned(),
        ),
        ("nephroid.comment", notes.comment()),
        ("nephroid.exposure_stops", notes.exposure_stops.to_string()),
        ("nephroid.unit", notes.quantity.unit().to_owned()),
    ] {
        let entry = [key.as_bytes(), &[0], value.as_bytes(), &[0]].concat();
        bytes.extend((entry.len() as u32).to_le_bytes());
        bytes.extend(&entry);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes
}

const MANTISSA_BITS: i32 = 9;
const BIAS: i32 = 15;
const MOST_EXPONENT: i32 = 31;
const MANTISSAS: f64 = 512.0;

/// The largest value: 511/512 · 2^16.
pub const MOST: f32 = 65408.0;

/// Words of four bytes, row by row, and the values that they stand for.
pub fn pack(texels: &Texels) -> (Vec<u8>, Vec<[f32; 3]>) {
    let words: Vec<u32> = texels.values().par_iter().map(|texel| word(*texel)).collect();
    let bytes = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    (bytes, words.into_iter().map(value).collect())
}

/// Each channel in the nearest step of the finest exponent that holds the largest.
fn word(texel: [f32; 3]) -> u32 {
    let channels = texel.map(|value| f64::from(value).clamp(0.0, f64::from(MOST)));
    let largest = channels.into_iter().fold(0.0, f64::max);
    if largest <= 0.0 {
        return 0;
    }
    let step = |exponent: i32| f64::from(exponent - BIAS - MANTISSA_BITS).exp2();
    let mut exponent = (largest.log2().floor() as i32 + 1 + BIAS).max(0);
    if (largest / step(exponent)).round() >= MANTISSAS {
        exponent += 1;
    }
    let exponent = exponent.min(MOST_EXPONENT);
    let [r, g, b] = channels.map(|value| (value / step(exponent)).round() as u32);
    r | (g << 9) | (b << 18) | ((exponent as u32) << 27)
}

fn value(word: u32) -> [f32; 3] {
    let step = f64::from((word >> 27) as i32 - BIAS - MANTISSA_BITS).exp2();
    [word, word >> 9, word >> 18].map(|mantissa| (f64::from(mantissa & 511) * step) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_within_half_a_step_of_the_largest() {
        for exponent in -14..16 {
            for share in [1.0, 0.9995, 0.75, 0.5001] {
                let largest = (f64::from(exponent).exp2() * share) as f32;
                let texel = [largest * 0.01, largest, largest * 0.3];
                for (wanted, got) in texel.iter().zip(value(word(texel))) {
                    assert!(
                        (wanted - got).abs() <= largest / 512.0 * 1.0001,
                        "{texel:?}: {got}"
                    );
                }
            }
        }
        for exact in [[MOST; 3], [1.0, 0.5, 0.0], [0.0; 3], [f32::exp2(-24.0), 0.0, 0.0]] {
            assert_eq!(value(word(exact)), exact);
        }
        assert_eq!(value(word([-1.0, 0.0, 1e-9])), [0.0; 3]);
    }
}
