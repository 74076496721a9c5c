//! BC6H of unsigned halves (Direct3D 11.3 functional specification, 19.5): 16 bytes for 4 × 4 texels.

use block_compression::decode::decode_block_bc6h;
use block_compression::encode::compress_rgba16;
use block_compression::{BC6HSettings, CompressionVariant};
use half::f16;
use rayon::prelude::*;

use super::texels::Texels;

/// Side of a block [texels], and its size [bytes].
const SIDE: usize = 4;
const BLOCK_BYTES: usize = 16;

/// Largest value: that of a half.
pub const MOST: f32 = 65504.0;

/// Encodes blocks row by row, and returns the values that they decode to. If a side is no multiple of four, its last
/// texels are repeated.
pub fn pack(texels: &Texels) -> (Vec<u8>, Vec<[f32; 3]>) {
    let (width, height) = texels.size();
    let across = width.div_ceil(SIDE);
    let variant = CompressionVariant::BC6H(BC6HSettings::slow());
    let mut bytes = vec![0; across * height.div_ceil(SIDE) * BLOCK_BYTES];
    let mut stored = vec![[0.0; 3]; width * height];
    let rows = bytes.par_chunks_mut(across * BLOCK_BYTES);
    let of_rows = stored.par_chunks_mut(width * SIDE);
    rows.zip(of_rows).enumerate().for_each(|(row, (blocks, stored))| {
        let padded = (across * SIDE) as u32;
        let halves = padded_rows(texels, row * SIDE, across * SIDE);
        compress_rgba16(variant, &halves, blocks, padded, SIDE as u32, 4 * padded);
        for (column, block) in blocks.as_chunks::<BLOCK_BYTES>().0.iter().enumerate() {
            unpack(block, column * SIDE, stored, width);
        }
    });
    (bytes, stored)
}

/// Decodes a block that begins at a column, into four rows or fewer of a width.
fn unpack(block: &[u8; BLOCK_BYTES], first: usize, rows: &mut [[f32; 3]], width: usize) {
    let mut values = [f16::ZERO; 3 * SIDE * SIDE];
    decode_block_bc6h(block, &mut values, 3 * SIDE, false);
    let values = values.as_chunks::<3>().0;
    for (row, values) in rows.chunks_mut(width).zip(values.chunks(SIDE)) {
        for (texel, value) in row[first..].iter_mut().zip(values) {
            *texel = value.map(f16::to_f32);
        }
    }
}

/// Four rows, from `first` on, as halves with alpha, padded to whole blocks.
fn padded_rows(texels: &Texels, first: usize, padded: usize) -> Vec<f16> {
    let (width, height) = texels.size();
    let mut halves = Vec::with_capacity(4 * SIDE * padded);
    for row in first..first + SIDE {
        let line = &texels.values()[row.min(height - 1) * width..][..width];
        for column in 0..padded {
            let texel = line[column.min(width - 1)];
            halves.extend(texel.map(|value| f16::from_f32(value.clamp(0.0, MOST))));
            halves.push(f16::ONE);
        }
    }
    halves
}
