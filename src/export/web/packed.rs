//! The file of a moment: a description, then what buffers and textures hold.

use std::collections::BTreeMap;
use std::io::Write as _;

use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::{Value, json};

use crate::eye_pass::renderer::Content;

/// Contents of buffers and textures, by name.
pub(super) type Contents = BTreeMap<String, Content>;

/// Contents start at multiples of this [bytes].
const ALIGNMENT: usize = 4;

/// The file of a moment, which gzip packed: length of the description [u32], description as JSON, contents but for
/// those of the first moment. The description has their places by name: the first byte, counted from the description's
/// end, the length and, where they are filtered, that of a record.
pub(super) fn file(mut description: Value, contents: &Contents, first: &Contents) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (name, content) in contents
        .iter()
        .filter(|(name, content)| first.get(*name) != Some(*content))
    {
        description["contents"][name] = json!([bytes.len(), content.bytes.len(), content.record_bytes]);
        match content.record_bytes {
            Some(record) => {
                let first = first.get(name).map_or(&[][..], |first| &first.bytes);
                bytes.extend(filtered(&content.bytes, record, first));
            }
            None => bytes.extend(&content.bytes),
        }
        bytes.resize(bytes.len().next_multiple_of(ALIGNMENT), 0);
    }
    let mut description = description.to_string().into_bytes();
    description.resize(description.len().next_multiple_of(ALIGNMENT), b' ');
    let length = (description.len() as u32).to_le_bytes();
    gzip(&[&length, &description, &bytes])
}

pub(super) fn gzip(parts: &[&[u8]]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    let mut parts = parts.iter();
    let written = parts.try_for_each(|part| encoder.write_all(part));
    let packed = written.and_then(|()| encoder.finish());
    packed.expect("memory takes all that is written to it")
}

/// Records of so many bytes, for gzip to find what they share: words are differences from the first moment, and these
/// from the record before; each byte of a record lies with those of the others.
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
