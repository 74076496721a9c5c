//! The data format descriptor: where in a texel block each channel is, and what its bits mean.

use super::Packing;

const MODEL_RGBSDA: u32 = 1;
const MODEL_BC6H: u32 = 133;
const PRIMARIES_BT709: u32 = 1;
const TRANSFER_LINEAR: u32 = 1;
/// Version 1.3 of the specification.
const VERSION: u32 = 2;
const HEADER_WORDS: usize = 6;
const SAMPLE_WORDS: usize = 4;

/// Marks of a sample's channel.
const EXPONENT: u32 = 1 << 5;
const FLOAT: u32 = 1 << 7;

/// One run of bits of a channel.
struct Sample {
    /// With its marks.
    channel: u32,
    first_bit: u32,
    bits: u32,
    /// What stands for 0 and for 1.
    lower: u32,
    upper: u32,
}

/// The descriptor of one block, with its size before it.
pub fn descriptor(packing: Packing) -> Vec<u8> {
    let samples = match packing {
        Packing::Rgb9e5 => rgb9e5_samples(),
        Packing::Bc6h => vec![Sample {
            channel: FLOAT,
            first_bit: 0,
            bits: 128,
            lower: 0.0_f32.to_bits(),
            upper: 1.0_f32.to_bits(),
        }],
    };
    let (model, side, block_bytes) = match packing {
        Packing::Rgb9e5 => (MODEL_RGBSDA, 1, 4),
        Packing::Bc6h => (MODEL_BC6H, 4, 16),
    };
    let block_words = HEADER_WORDS + SAMPLE_WORDS * samples.len();
    let mut words = vec![
        4 * (block_words as u32 + 1),
        // Khronos' basic descriptor.
        0,
        VERSION | ((4 * block_words as u32) << 16),
        model | (PRIMARIES_BT709 << 8) | (TRANSFER_LINEAR << 16),
        (side - 1) | ((side - 1) << 8),
        block_bytes,
        0,
    ];
    for sample in samples {
        words.extend([
            sample.first_bit | ((sample.bits - 1) << 16) | (sample.channel << 24),
            0,
            sample.lower,
            sample.upper,
        ]);
    }
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

/// Each channel has nine bits of its own and shares the exponent. The bounds are those that the specification tabulates for
/// this format.
fn rgb9e5_samples() -> Vec<Sample> {
    let of_channel = |channel: u32| {
        [
            Sample {
                channel,
                first_bit: 9 * channel,
                bits: 9,
                lower: 0,
                upper: 8448,
            },
            Sample {
                channel: channel | EXPONENT,
                first_bit: 27,
                bits: 5,
                lower: 15,
                upper: 31,
            },
        ]
    };
    (0..3).flat_map(of_channel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Words that Khronos' own dfdutils (`vk2dfd`) make of both formats.
    #[test]
    fn descriptors_are_those_of_the_formats() {
        let words = |packing| -> Vec<u32> {
            let bytes = descriptor(packing);
            let words = bytes.as_chunks::<4>().0.iter();
            words.map(|word| u32::from_le_bytes(*word)).collect()
        };
        let header = |bytes: u32, model: u32, block: u32, plane: u32| {
            [
                bytes,
                0,
                ((bytes - 4) << 16) | 2,
                0x0001_0100 | model,
                block,
                plane,
                0,
            ]
        };
        let mut shared = header(0x7c, 1, 0, 4).to_vec();
        for channel in 0..3_u32 {
            let own = channel << 24;
            shared.extend([own | 0x0008_0000 | (9 * channel), 0, 0, 0x2100]);
            shared.extend([own | 0x2004_001b, 0, 15, 31]);
        }
        assert_eq!(words(Packing::Rgb9e5), shared);
        let mut blocks = header(0x2c, 0x85, 0x0303, 16).to_vec();
        blocks.extend([0x807f_0000, 0, 0, 0x3f80_0000]);
        assert_eq!(words(Packing::Bc6h), blocks);
    }
}
