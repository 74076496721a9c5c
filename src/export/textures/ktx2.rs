//! KTX 2.0 with Zstandard: textures in formats that graphics cards sample directly.
//!
//! Khronos, "KTX File Format Specification" 2.0.

use ktx2::dfd::{Basic, Block};
use ktx2::{Format, Header, Index, LevelIndex, SupercompressionScheme};
use rayon::prelude::*;
use serde::Serialize;

use super::bc6h;
use super::encoding::{Encoded, FileMetadata};
use super::shared_exponent::{RGB9E5, rgb9e5_word};
use super::texels::Texels;
use crate::error::{Error, Result};

/// Compression level, 1 to 22; higher ones gain little on floats.
const ZSTD_LEVEL: i32 = 12;

/// Texel format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Packing {
    /// Nine bits per channel and a shared exponent, 32 bits per texel.
    Rgb9e5,
    /// Blocks of 4 × 4 texels, 8 bits per texel.
    Bc6h,
}

impl Packing {
    fn format(self) -> Format {
        match self {
            Self::Rgb9e5 => Format::E5B9G9R9_UFLOAT_PACK32,
            Self::Bc6h => Format::BC6H_UFLOAT_BLOCK,
        }
    }

    /// Encodes one mip level, and returns the values that it decodes to.
    fn pack(self, texels: &Texels) -> (Vec<u8>, Vec<[f32; 3]>) {
        match self {
            Self::Rgb9e5 => {
                let codes = texels.values().par_iter().map(|texel| RGB9E5.code(*texel));
                let codes: Vec<_> = codes.collect();
                let bytes = codes.iter().flat_map(|code| rgb9e5_word(*code)).collect();
                (bytes, codes.into_iter().map(|code| RGB9E5.value(code)).collect())
            }
            Self::Bc6h => bc6h::pack(texels),
        }
    }
}

/// Encodes a texture, with all mip levels down to one texel if `mips`. Values below 0 become 0.
///
/// # Errors
/// Too little memory for zstd.
pub fn encode(texels: &Texels, packing: Packing, mips: bool, notes: &FileMetadata<'_>) -> Result<Encoded> {
    // Each mip level is halved from the unpacked one above, so that rounding does not add up.
    let (packed, stored) = packing.pack(texels);
    let mut images = vec![packed];
    let mut smaller = texels.clone();
    while mips && smaller.size() != (1, 1) {
        smaller = smaller.halved();
        images.push(packing.pack(&smaller).0);
    }

    // Levels are compressed by themselves, as readers load them one by one, and on all threads.
    let refused = |why: String| {
        let what = format!("the texture cannot be compressed ({why})");
        Error::failure(notes.location, what, "write smaller maps")
    };
    let compressed: std::io::Result<Vec<Vec<u8>>> = images
        .par_iter()
        .map(|packed| zstd::bulk::compress(packed, ZSTD_LEVEL))
        .collect();
    let compressed = compressed.map_err(|error| refused(error.to_string()))?;

    // The data format descriptor says how the bits of a texel become channels.
    let (descriptor, type_size) =
        Basic::from_format(packing.format()).map_err(|error| refused(error.to_string()))?;
    let descriptor = Block::Basic(descriptor);
    // The descriptor is preceded by its length.
    let mut described = vec![0; 4 + descriptor.serialized_length()];
    let length = described.len() as u32;
    described[..4].copy_from_slice(&length.to_le_bytes());
    descriptor.to_bytes(&mut described[4..]);
    let about = about(notes);

    // Header, index of levels, descriptor, notes and levels follow each other: lengths give the offsets.
    let descriptor_at = Header::LENGTH + LevelIndex::LENGTH * images.len();
    let about_at = descriptor_at + described.len();
    let (width, height) = texels.size();
    let header = Header {
        format: Some(packing.format()),
        type_size,
        pixel_width: width as u32,
        pixel_height: height as u32,
        pixel_depth: 0,
        layer_count: 0,
        face_count: 1,
        level_count: images.len() as u32,
        supercompression_scheme: Some(SupercompressionScheme::Zstandard),
        index: Index {
            dfd_byte_offset: descriptor_at as u32,
            dfd_byte_length: length,
            kvd_byte_offset: about_at as u32,
            kvd_byte_length: about.len() as u32,
            sgd_byte_offset: 0,
            sgd_byte_length: 0,
        },
    };

    let mut bytes = header.as_bytes().to_vec();
    // The index begins with the largest level, the data with the smallest.
    let mut end = about_at + about.len() + compressed.iter().map(Vec::len).sum::<usize>();
    for (packed, compressed) in images.iter().zip(&compressed) {
        end -= compressed.len();
        let level = LevelIndex {
            byte_offset: end as u64,
            byte_length: compressed.len() as u64,
            uncompressed_byte_length: packed.len() as u64,
        };
        bytes.extend(level.as_bytes());
    }

    bytes.extend(described);
    bytes.extend(about);
    compressed.iter().rev().for_each(|level| bytes.extend(level));
    Ok(Encoded {
        bytes,
        stored,
        levels: images.len(),
    })
}

/// Key/value data, sorted by key.
fn about(notes: &FileMetadata<'_>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (key, value) in [
        // Columns go right, rows down: (0, 0) is the origin of glTF's texture coordinates.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected words as Khronos' own dfdutils (`vk2dfd`) make them for both formats.
    #[test]
    fn descriptors_are_those_of_the_formats() {
        let texels = Texels::black((1, 1));
        let words = |packing| -> Vec<u32> {
            let notes = FileMetadata {
                quantity: crate::export::Quantity::Irradiance,
                exposure_stops: 0.0,
                what: String::new(),
                location: "",
            };
            let bytes = encode(&texels, packing, false, &notes).expect("it fits").bytes;
            let word = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|byte| bytes[at + byte]));
            let first = word(48) as usize;
            (0..word(first) as usize / 4)
                .map(|index| word(first + 4 * index))
                .collect()
        };
        let header = |bytes: u32, model: u32, block: u32, plane: u32| {
            let size = ((bytes - 4) << 16) | 2;
            vec![bytes, 0, size, 0x0001_0100 | model, block, plane, 0]
        };
        let mut shared = header(0x7c, 1, 0, 4);
        for channel in 0..3_u32 {
            let own = channel << 24;
            shared.extend([own | 0x0008_0000 | (9 * channel), 0, 0, 0x2100]);
            shared.extend([own | 0x2004_001b, 0, 15, 31]);
        }
        assert_eq!(words(Packing::Rgb9e5), shared);
        let blocks = [
            header(0x2c, 0x85, 0x0303, 16),
            vec![0x807f_0000, 0, 0, 0x3f80_0000],
        ];
        assert_eq!(words(Packing::Bc6h), blocks.concat());
    }
}
