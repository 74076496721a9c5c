//! The file of a moment: a description, then what buffers and textures hold.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::{Map, Value, json};

use crate::eye_pass::renderer::Content;

/// Contents start at multiples of this [bytes].
const ALIGNMENT: usize = 4;

/// Contents of a moment, and their places by name: the first byte, counted from the description's end, the length and,
/// where they are filtered, that of a record.
#[derive(Debug, Default)]
pub(super) struct Packed {
    places: Map<String, Value>,
    bytes: Vec<u8>,
}

impl Packed {
    /// Adds content, unless it is that of the first moment.
    pub(super) fn add(&mut self, name: &str, content: &Content, first: Option<&Content>) {
        if first == Some(content) {
            return;
        }
        let place = json!([self.bytes.len(), content.bytes.len(), content.record_bytes]);
        self.places.insert(name.into(), place);
        match content.record_bytes {
            Some(record) => {
                let first = first.map_or(&[][..], |first| &first.bytes);
                self.bytes.extend(filtered(&content.bytes, record, first));
            }
            None => self.bytes.extend(&content.bytes),
        }
        self.bytes.resize(self.bytes.len().next_multiple_of(ALIGNMENT), 0);
    }

    /// The file, which gzip packed: length of the description [u32], description as JSON, contents.
    pub(super) fn file(self, mut description: Value) -> Vec<u8> {
        description["contents"] = self.places.into();
        let mut description = description.to_string().into_bytes();
        description.resize(description.len().next_multiple_of(ALIGNMENT), b' ');
        let length = (description.len() as u32).to_le_bytes();
        gzip(&[&length, &description, &self.bytes])
    }
}

pub(super) fn gzip(parts: &[&[u8]]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    let mut parts = parts.iter();
    let written = parts.try_for_each(|part| encoder.write_all(part));
    let packed = written.and_then(|()| encoder.finish());
    packed.expect("memory takes all that is written to it")
}

/// Records of so many bytes, for gzip to find what they share: words are differences from the first moment, and these from
/// the record before; each byte of a record lies with those of the others.
fn filtered(bytes: &[u8], record: usize, first: &[u8]) -> Vec<u8> {
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(bytes);
    let first: Vec<u32> = bytemuck::pod_collect_to_vec(first);
    let moved = |word: usize| words[word].wrapping_sub(first.get(word).copied().unwrap_or(0));
    let before = |word: usize| word.checked_sub(record / 4).map_or(0, moved);
    let changes = (0..words.len()).flat_map(|word| moved(word).wrapping_sub(before(word)).to_le_bytes());
    let changes: Vec<u8> = changes.collect();
    let plane = |byte: usize| changes.iter().skip(byte).step_by(record);
    (0..record).flat_map(plane).copied().collect()
}
