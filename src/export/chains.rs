//! A scene for the browser's own eye pass in one file: a description, then what buffers and textures hold.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::GzEncoder;
use rayon::prelude::*;
use serde_json::{Map, json};

use super::textures::shared_exponent::{RGB9E5, rgb9e5_word};
use crate::error::Result;
use crate::eye_pass::renderer::WebScene;
use crate::illumination::IlluminationMap;
use crate::scene::Scene;

/// Contents start at multiples of this [bytes].
const ALIGNMENT: usize = 4;

/// The file, which gzip packed: length of the description [u32], description as JSON, contents at the places that it
/// names, counted from the description's end. `None` where nothing in the scene is a mirror or clear.
///
/// # Errors
/// Those of [`WebScene::new`].
pub fn encode(scene: &Scene, maps: &[IlluminationMap]) -> Result<Option<Vec<u8>>> {
    let Some(mut made) = WebScene::new(scene, maps)? else {
        return Ok(None);
    };
    let mut contents = Vec::new();
    let mut add = |bytes: &[u8]| {
        let first = contents.len();
        contents.extend(bytes);
        contents.resize(contents.len().next_multiple_of(ALIGNMENT), 0);
        json!([first, bytes.len()])
    };
    let places: Map<_, _> = made
        .contents
        .iter()
        .map(|(name, bytes)| ((*name).to_string(), add(bytes)))
        .collect();
    let layers: Map<_, _> = made
        .layers
        .iter()
        .map(|(kind, texels)| {
            let words: Vec<[u8; 4]> = texels
                .par_iter()
                .map(|[r, g, b, _]| rgb9e5_word(RGB9E5.code([r, g, b].map(|channel| channel.to_f32()))))
                .collect();
            (kind.name().to_string(), add(words.as_flattened()))
        })
        .collect();
    made.description["contents"] = places.into();
    made.description["layers"] = layers.into();
    let mut description = made.description.to_string().into_bytes();
    description.resize(description.len().next_multiple_of(ALIGNMENT), b' ');
    let mut file = GzEncoder::new(Vec::new(), Compression::default());
    let length = (description.len() as u32).to_le_bytes();
    let mut parts = [&length[..], &description, &contents].into_iter();
    let written = parts
        .try_for_each(|part| file.write_all(part))
        .and_then(|()| file.finish());
    Ok(Some(written.expect("memory takes all that is written to it")))
}
