//! A `.glb` in the making: its document, in which anything may be changed, and its binary chunk.

use gltf::json::Value;
use serde_json::json;

use crate::error::{Error, Result};

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;

/// Document and binary data of a file to be.
#[derive(Clone, Debug)]
pub struct Glb {
    /// The document without its `buffers`' first entry's length, which [`into_bytes`](Self::into_bytes) states.
    pub json: Value,
    binary: Vec<u8>,
}

impl Glb {
    /// A file with one empty scene.
    pub fn empty() -> Self {
        let generator = concat!("Nephroid ", env!("CARGO_PKG_VERSION"));
        Self {
            json: json!({
                "asset": { "version": "2.0", "generator": generator },
                "scene": 0,
                "scenes": [{}],
            }),
            binary: Vec::new(),
        }
    }

    /// A file that was there, with the data of its first buffer.
    pub fn from_parts(json: Value, binary: Vec<u8>) -> Self {
        Self { json, binary }
    }

    /// The data so far.
    pub fn binary(&self) -> &[u8] {
        &self.binary
    }

    /// Appends to a list of the document, which is made where it is missing, and returns the index.
    pub fn push(&mut self, list: &str, item: Value) -> usize {
        let Some(items) = self.json[list].as_array_mut() else {
            self.json[list] = json!([item]);
            return 0;
        };
        items.push(item);
        items.len() - 1
    }

    /// Lists a node in the first scene.
    pub fn push_root(&mut self, node: usize) {
        let scene = &mut self.json["scenes"][0];
        match scene["nodes"].as_array_mut() {
            Some(nodes) => nodes.push(json!(node)),
            None => scene["nodes"] = json!([node]),
        }
    }

    /// Names an extension among those that the file uses.
    pub fn use_extension(&mut self, name: &str) {
        let is_named = self.json["extensionsUsed"]
            .as_array()
            .is_some_and(|used| used.iter().any(|used| used == name));
        if !is_named {
            self.push("extensionsUsed", json!(name));
        }
    }

    /// Adds data, aligned to four bytes, and returns the index of its view.
    pub fn push_view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let offset = self.binary.len();
        self.binary.extend(bytes);
        self.push(
            "bufferViews",
            json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }),
        )
    }

    /// Adds vectors of two to four components with their bounds and returns the index of their accessor. There has to be
    /// one at least, and all have to be finite.
    pub fn push_vectors<const N: usize>(&mut self, vectors: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = vectors
            .iter()
            .flatten()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        let view = self.push_view(&bytes);
        let bound = |pick: fn(f32, f32) -> f32, from: f32| {
            let mut bound = [from; N];
            for vector in vectors {
                for axis in 0..N {
                    bound[axis] = pick(bound[axis], vector[axis]);
                }
            }
            bound.to_vec()
        };
        let (low, high) = (bound(f32::min, f32::INFINITY), bound(f32::max, f32::NEG_INFINITY));
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": FLOAT, "count": vectors.len(),
                "type": format!("VEC{N}"), "min": low, "max": high }),
        )
    }

    /// Adds indices of vertices and returns the index of their accessor.
    pub fn push_indices(&mut self, indices: impl IntoIterator<Item = u32>) -> usize {
        let bytes: Vec<u8> = indices.into_iter().flat_map(u32::to_le_bytes).collect();
        let view = self.push_view(&bytes);
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": UNSIGNED_INT, "count": bytes.len() / 4,
                "type": "SCALAR" }),
        )
    }

    /// Adds a PNG as an image and returns its index.
    pub fn push_png(&mut self, name: &str, bytes: &[u8]) -> usize {
        let view = self.push_view(bytes);
        self.push(
            "images",
            json!({ "name": name, "bufferView": view, "mimeType": "image/png" }),
        )
    }

    /// The bytes of the file.
    ///
    /// # Errors
    /// More than the 4 GiB that such a file can hold.
    pub fn into_bytes(mut self) -> Result<Vec<u8>> {
        let mut chunks = Vec::new();
        if !self.binary.is_empty() {
            let length = json!(self.binary.len());
            match self.json["buffers"].get_mut(0) {
                Some(buffer) => buffer["byteLength"] = length,
                None => self.json["buffers"] = json!([{ "byteLength": length }]),
            }
            chunks = chunk(*b"BIN\0", self.binary, 0);
        }
        file_of(self.json.to_string(), &chunks)
    }
}

/// Data with a header, padded to four bytes.
pub fn chunk(kind: [u8; 4], mut data: Vec<u8>, padding: u8) -> Vec<u8> {
    data.resize(data.len().next_multiple_of(4), padding);
    let mut bytes = (data.len() as u32).to_le_bytes().to_vec();
    bytes.extend(kind);
    bytes.extend(data);
    bytes
}

/// A file of a document and the chunks after it.
///
/// # Errors
/// More than the 4 GiB that such a file can hold.
pub fn file_of(json: String, chunks: &[u8]) -> Result<Vec<u8>> {
    let json = chunk(*b"JSON", json.into_bytes(), b' ');
    let length = u32::try_from(json.len() + chunks.len() + 12).map_err(|_| {
        Error::failure(
            "GLB",
            "would be larger than 4 GiB",
            "use smaller maps or a smaller scene",
        )
    })?;
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend(length.to_le_bytes());
    bytes.extend(json);
    bytes.extend(chunks);
    Ok(bytes)
}
