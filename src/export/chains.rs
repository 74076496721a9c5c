//! A scene for the browser's own eye pass in one file: a description, then what buffers and textures hold.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::{Map, json};

use crate::error::Result;
use crate::eye_pass::renderer::{Content, WebScene};
use crate::illumination::IlluminationMap;
use crate::scene::Scene;

/// Contents start at multiples of this [bytes].
const ALIGNMENT: usize = 4;

/// The file, which gzip packed: length of the description [u32], description as JSON, contents at the places that it
/// names. A place is the first byte, counted from the description's end, the length and, where they are filtered, that
/// of a record. The light of the maps lies in other files. `None` where nothing in the scene is a mirror or clear.
///
/// # Errors
/// Those of [`WebScene::new`].
pub fn encode(scene: &Scene, maps: &[IlluminationMap]) -> Result<Option<Vec<u8>>> {
    let Some(mut made) = WebScene::new(scene, maps)? else {
        return Ok(None);
    };
    let mut contents = Vec::new();
    let mut add = |content: &Content| {
        let first = contents.len();
        match content.record_bytes {
            Some(record) => contents.extend(filtered(&content.bytes, record)),
            None => contents.extend(&content.bytes),
        }
        contents.resize(contents.len().next_multiple_of(ALIGNMENT), 0);
        json!([first, content.bytes.len(), content.record_bytes])
    };
    let places: Map<_, _> = made
        .contents
        .iter()
        .map(|(name, content)| ((*name).to_string(), add(content)))
        .collect();
    made.description["contents"] = places.into();
    made.description["maps"] = made.map_tiles.iter().map(add).collect();
    let mut description = made.description.to_string().into_bytes();
    description.resize(description.len().next_multiple_of(ALIGNMENT), b' ');
    let mut file = GzEncoder::new(Vec::new(), Compression::best());
    let length = (description.len() as u32).to_le_bytes();
    let mut parts = [&length[..], &description, &contents].into_iter();
    let written = parts
        .try_for_each(|part| file.write_all(part))
        .and_then(|()| file.finish());
    Ok(Some(written.expect("memory takes all that is written to it")))
}

/// Records of so many bytes, for gzip to find what they share: words are differences from the record before, and each byte
/// of a record lies with those of the others.
fn filtered(bytes: &[u8], record: usize) -> Vec<u8> {
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(bytes);
    let before = |word: usize| word.checked_sub(record / 4).map_or(0, |before| words[before]);
    let changes = words.iter().enumerate();
    let changes: Vec<u8> = changes
        .flat_map(|(place, word)| word.wrapping_sub(before(place)).to_le_bytes())
        .collect();
    let plane = |byte: usize| changes.iter().skip(byte).step_by(record);
    (0..record).flat_map(plane).copied().collect()
}
