//! EXT_meshopt_compression and KHR_meshopt_compression: decodes compressed buffer views. Words in backticks are those
//! of the extensions' text.

use std::array;

use gltf::json::Value;
use serde::Deserialize;

/// Names of the extension in buffer views; one specification covers both.
pub const NAMES: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Compression parameters of a buffer view.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Compressed {
    /// Index of the buffer with the compressed data.
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    byte_stride: usize,
    count: usize,
    mode: Mode,
    #[serde(default)]
    filter: Filter,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
enum Mode {
    Attributes,
    Triangles,
    Indices,
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
enum Filter {
    #[default]
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// Elements per group of deltas.
const GROUP: usize = 16;

/// Largest number of elements per block.
const BLOCK: usize = 256;

impl Compressed {
    /// Compression parameters among the extensions of a buffer view; `None` if it is not compressed.
    pub fn stated(extensions: &serde_json::Map<String, Value>) -> Option<serde_json::Result<Self>> {
        let stated = NAMES.iter().find_map(|name| extensions.get(*name))?;
        Some(Self::deserialize(stated))
    }

    /// Size of the decompressed data; `None` if the compressed data are too few for it.
    pub fn unpacked_bytes(&self) -> Option<u64> {
        let least = match self.mode {
            Mode::Attributes => self.count.div_ceil(BLOCK),
            Mode::Triangles => self.count / 3,
            Mode::Indices => self.count,
        };
        let is_possible = least as u64 <= self.byte_length && self.byte_stride <= 256;
        (self.count as u64)
            .checked_mul(self.byte_stride as u64)
            .filter(|_| is_possible)
    }

    /// Decompresses the data; `None` if they are damaged.
    pub fn unpack(&self, data: &[u8]) -> Option<Vec<u8>> {
        let (count, stride) = (self.count, self.byte_stride);
        let indices = match self.mode {
            Mode::Attributes => {
                let mut unpacked = attributes(data, count, stride)?;
                self.filter.apply(&mut unpacked, stride)?;
                return Some(unpacked);
            }
            Mode::Triangles => triangles(data, count)?,
            Mode::Indices => indices(data, count)?,
        };
        let bytes = indices.into_iter().map(u32::to_le_bytes);
        matches!(stride, 2 | 4).then(|| bytes.flat_map(|bytes| bytes.into_iter().take(stride)).collect())
    }
}

/// Splits bytes off the front.
fn take<'a>(data: &mut &'a [u8], count: usize) -> Option<&'a [u8]> {
    let (taken, rest) = data.split_at_checked(count)?;
    *data = rest;
    Some(taken)
}

fn byte(data: &mut &[u8]) -> Option<u8> {
    Some(take(data, 1)?[0])
}

fn unzigzag(value: u32) -> u32 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}

fn attributes(data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    // Version 1 came with the KHR_ extension.
    let (version, mut data) = match data.split_first()? {
        (0xa0, data) => (0, data),
        (0xa1, data) => (1, data),
        _ => return None,
    };
    if !stride.is_multiple_of(4) || !(4..=BLOCK).contains(&stride) {
        return None;
    }

    // The tail, padded in front to a least size, holds the `baseline`, from which the first deltas count, and in
    // version 1 the mode of each channel of four bytes.
    let (modes, least) = if version == 0 { (0, 32) } else { (stride / 4, 24) };
    let body = data.len().checked_sub((stride + modes).max(least))?;
    let tail = &data[body..];
    data = &data[..body];
    let (baseline, modes_of_channels) = tail[tail.len() - stride - modes..].split_at(stride);
    let mut last = baseline.as_chunks::<4>().0.to_vec();

    // A block has as many whole groups as fit into 8 KiB, at most 256 elements.
    let mut unpacked = vec![0; count * stride];
    let most = ((8192 / stride) & !(GROUP - 1)).min(BLOCK);
    for block in unpacked.chunks_mut(most * stride) {
        let elements = block.len() / stride;
        let controls = take(&mut data, modes)?;

        // Each byte position has a stream of its own; the four of a channel together give its next value.
        for (channel, last) in last.iter_mut().enumerate() {
            let mut deltas = [[0; BLOCK]; 4];
            for (index, deltas) in deltas.iter_mut().enumerate() {
                let control = controls.get(channel).map(|control| control >> (2 * index) & 3);
                read_deltas(
                    &mut data,
                    control,
                    &mut deltas[..elements.next_multiple_of(GROUP)],
                    elements,
                )?;
            }
            let mode = modes_of_channels.get(channel).copied().unwrap_or(0);
            for (element, place) in block.chunks_exact_mut(stride).enumerate() {
                *last = next(*last, deltas.map(|deltas| deltas[element]), mode)?;
                place[4 * channel..][..4].copy_from_slice(last);
            }
        }
    }
    data.is_empty().then_some(unpacked)
}

/// Deltas of one byte position for the elements of a block; `control` is `None` in version 0.
fn read_deltas(data: &mut &[u8], control: Option<u8>, deltas: &mut [u8], elements: usize) -> Option<()> {
    let bits_of_headers = match control {
        None => [0, 2, 4, 8],
        Some(0) => [0, 1, 2, 4],
        Some(1) => [1, 2, 4, 8],
        Some(2) => return Some(()),
        Some(_) => {
            deltas[..elements].copy_from_slice(take(data, elements)?);
            return Some(());
        }
    };

    // Two bits for each group choose the width of its deltas.
    let headers = take(data, deltas.len().div_ceil(4 * GROUP))?;
    for (group, deltas) in deltas.chunks_exact_mut(GROUP).enumerate() {
        let header = headers[group / 4] >> (2 * (group % 4)) & 3;
        match bits_of_headers[usize::from(header)] {
            0 => {}
            8 => deltas.copy_from_slice(take(data, GROUP)?),
            bits => {
                let packed = take(data, GROUP * bits / 8)?;

                // The largest number that fits stands for a delta that does not fit, which follows as a whole byte.
                let sentinel = (1 << bits) - 1;
                for (index, delta) in deltas.iter_mut().enumerate() {
                    let at = index * bits;
                    // Single bits are packed from the least significant one, pairs and nibbles from the most
                    // significant.
                    let shift = if bits == 1 { at % 8 } else { 8 - bits - at % 8 };
                    let value = packed[at / 8] >> shift & sentinel;
                    *delta = if value == sentinel { byte(data)? } else { value };
                }
            }
        }
    }
    Some(())
}

/// The four bytes that follow `last`, by the `channel mode`.
fn next(last: [u8; 4], delta: [u8; 4], mode: u8) -> Option<[u8; 4]> {
    let halves = |[a, b, c, d]: [u8; 4]| [u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d])];
    Some(match mode {
        0 => array::from_fn(|i| last[i].wrapping_add(unzigzag(delta[i].into()) as u8)),
        1 => {
            let (last, delta) = (halves(last), halves(delta));
            let [low, high] = array::from_fn(|i| last[i].wrapping_add(unzigzag(delta[i].into()) as u16));
            let ([a, b], [c, d]) = (low.to_le_bytes(), high.to_le_bytes());
            [a, b, c, d]
        }
        _ if mode & 15 == 2 => {
            let delta = u32::from_le_bytes(delta).rotate_right((mode >> 4).into());
            (delta ^ u32::from_le_bytes(last)).to_le_bytes()
        }
        _ => return None,
    })
}

/// The last 16 values pushed.
struct Fifo<T>([T; 16], usize);

impl<T: Copy> Fifo<T> {
    fn push(&mut self, value: T) {
        self.0[self.1 % 16] = value;
        self.1 += 1;
    }

    /// The value after which `age` others were pushed.
    fn get(&self, age: u8) -> T {
        self.0[(self.1 + 15 - usize::from(age)) % 16]
    }
}

/// An index stored as the difference from the last one stored so.
fn explicit(data: &mut &[u8], last: &mut u32) -> Option<u32> {
    *last = last.wrapping_add(unzigzag(varint(data)?));
    Some(*last)
}

fn varint(data: &mut &[u8]) -> Option<u32> {
    let mut value = 0;
    for shift in [0, 7, 14, 21, 28] {
        let part = byte(data)?;
        value |= u32::from(part & 0x7f) << shift;
        if part < 0x80 {
            return Some(value);
        }
    }
    None
}

fn triangles(data: &[u8], count: usize) -> Option<Vec<u32>> {
    // A code for each triangle, then the data that codes call for, then the 16 most frequent pairs of vertex codes.
    let (codes, data) = data.strip_prefix(&[0xe1])?.split_at_checked(count / 3)?;
    let (mut data, table) = data.split_last_chunk::<16>()?;
    let (mut edges, mut vertices) = (Fifo([[0; 2]; 16], 0), Fifo([0; 16], 0));
    let (mut next, mut last) = (0_u32, 0_u32);
    let mut unpacked = Vec::with_capacity(count);
    for code in codes {
        let mut new = || {
            next = next.wrapping_add(1);
            next.wrapping_sub(1)
        };
        let (high, low) = (code >> 4, code & 15);

        // The triangle continues a recent edge, so that only its third vertex is coded.
        if high < 15 {
            let [a, b] = edges.get(high);
            let c = match low {
                0 => new(),
                1..=12 => vertices.get(low),
                13 | 14 => {
                    last = if low == 13 {
                        last.wrapping_sub(1)
                    } else {
                        last.wrapping_add(1)
                    };
                    last
                }
                _ => explicit(&mut data, &mut last)?,
            };
            if !(1..=12).contains(&low) {
                vertices.push(c);
            }
            edges.push([c, b]);
            edges.push([a, c]);
            unpacked.extend([a, b, c]);
            continue;
        }

        // The triangle stands by itself; a pair from the table or the data codes its second and third vertex.
        let is_listed = low < 14;
        let pair = if is_listed {
            table[usize::from(low)]
        } else {
            byte(&mut data)?
        };

        // A pair of 0 outside the table restarts the numbering of new vertices.
        if !is_listed && pair == 0 {
            next = 0;
        }
        let mut corner = |code: u8| match code {
            0 => {
                next = next.wrapping_add(1);
                Some(next.wrapping_sub(1))
            }
            15 => explicit(&mut data, &mut last),
            _ => Some(vertices.get(code - 1)),
        };

        // Vertices that were found in the queue are not queued again.
        let codes = [if low == 15 { 15 } else { 0 }, pair >> 4, pair & 15];
        let [a, b, c] = [corner(codes[0])?, corner(codes[1])?, corner(codes[2])?];
        for (code, vertex) in codes.into_iter().zip([a, b, c]) {
            if matches!(code, 0 | 15) {
                vertices.push(vertex);
            }
        }
        for edge in [[b, a], [c, b], [a, c]] {
            edges.push(edge);
        }
        unpacked.extend([a, b, c]);
    }
    (data.is_empty() && count.is_multiple_of(3)).then_some(unpacked)
}

fn indices(data: &[u8], count: usize) -> Option<Vec<u32>> {
    let (mut data, _) = data.strip_prefix(&[0xd1])?.split_last_chunk::<4>()?;
    let mut last = [0_u32; 2];
    let mut unpacked = Vec::with_capacity(count);
    for _ in 0..count {
        let value = varint(&mut data)?;
        let last = &mut last[value as usize & 1];
        *last = last.wrapping_add(unzigzag(value >> 1));
        unpacked.push(*last);
    }
    data.is_empty().then_some(unpacked)
}

impl Filter {
    fn apply(self, data: &mut [u8], stride: usize) -> Option<()> {
        match (self, stride) {
            (Self::None, _) => {}
            (Self::Exponential, _) => data.as_chunks_mut::<4>().0.iter_mut().for_each(exponential),
            (Self::Octahedral, 4) => change::<1>(data, |v| octahedral(v, 127.0)),
            (Self::Octahedral, 8) => change::<2>(data, |v| octahedral(v, 32767.0)),
            (Self::Quaternion, 8) => change::<2>(data, quaternion),
            (Self::Color, 4) => change::<1>(data, |v| colour(v, 0xff)),
            (Self::Color, 8) => change::<2>(data, |v| colour(v, 0xffff)),
            _ => return None,
        }
        Some(())
    }
}

/// Maps all elements of four signed integers of `BYTES` bytes each.
fn change<const BYTES: usize>(data: &mut [u8], changed: impl Fn([i32; 4]) -> [i32; 4]) {
    for element in data.chunks_exact_mut(4 * BYTES) {
        let number = |i: usize| match BYTES {
            1 => i32::from(element[i] as i8),
            _ => i32::from(i16::from_le_bytes([element[2 * i], element[2 * i + 1]])),
        };
        let numbers = changed(array::from_fn(number));
        for (place, number) in element.chunks_exact_mut(BYTES).zip(numbers) {
            place.copy_from_slice(&number.to_le_bytes()[..BYTES]);
        }
    }
}

fn exponential(value: &mut [u8; 4]) {
    let stored = i32::from_le_bytes(*value);
    let (exponent, mantissa) = (stored >> 24, stored << 8 >> 8);
    let number = f64::from(exponent).exp2() * f64::from(mantissa);
    *value = (number as f32).to_le_bytes();
}

fn octahedral([x, y, one, other]: [i32; 4], most: f32) -> [i32; 4] {
    let [x, y] = [x, y].map(|part| part as f32 / one as f32);
    let z = 1.0 - x.abs() - y.abs();
    let fold = z.min(0.0);
    let normal = [x - fold.copysign(x), y - fold.copysign(y), z];
    let length = normal.iter().map(|part| part * part).sum::<f32>().sqrt();
    let [x, y, z] = normal.map(|part| (part / length * most).round() as i32);
    [x, y, z, other]
}

fn quaternion([x, y, z, one]: [i32; 4]) -> [i32; 4] {
    let parts = [x, y, z].map(|part| part as f32 / (one | 3) as f32 * std::f32::consts::FRAC_1_SQRT_2);
    let largest = (1.0 - parts.iter().map(|part| part * part).sum::<f32>())
        .max(0.0)
        .sqrt();
    let mut quaternion = [largest, parts[0], parts[1], parts[2]].map(|part| (part * 32767.0).round() as i32);
    quaternion.rotate_right((one & 3) as usize);
    quaternion
}

fn colour([y, orange, green, alpha]: [i32; 4], most: i32) -> [i32; 4] {
    let (y, alpha) = (y & most, alpha & most);
    let range = (1_i32 << (32 - alpha.leading_zeros())) - 1;
    let alpha = alpha & range >> 1;
    let channels = [
        y + orange - green,
        y + green,
        y - orange - green,
        alpha << 1 | alpha & 1,
    ];
    channels.map(|channel| (channel as f32 * (most as f32 / range as f32)).round() as i32)
}
