//! The parts of a file and how they are put together again.

use std::path::Path;

use gltf::json::Value;
use serde_json::json;

use super::json_document::JsonDocument;
use crate::error::Result;
use crate::scene::gltf::{glb, uri};

const HEADER_BYTES: usize = 12;

/// A file as text and the bytes that go with it.
pub struct Parts {
    /// The JSON.
    pub json: JsonDocument,
    /// Every chunk after the JSON, with its header.
    pub chunks: Vec<u8>,
}

impl Parts {
    /// Of a `.glb`, or of a `.gltf` with all that lies beside it.
    ///
    /// # Errors
    /// A buffer or an image that cannot be read, or text that is not UTF-8.
    pub fn of(bytes: &[u8], json: &[u8], folder: &Path, most_bytes: u64) -> Result<Self> {
        let document = JsonDocument::parse(json)?;
        if bytes.starts_with(b"glTF") {
            let stated = bytes.get(8..HEADER_BYTES).and_then(|four| four.try_into().ok());
            let end = stated.map_or(bytes.len(), |four| u32::from_le_bytes(four) as usize);
            let begin = HEADER_BYTES + 8 + json.len();
            let chunks = bytes
                .get(begin..end.min(bytes.len()))
                .unwrap_or_default()
                .to_vec();
            return Ok(Self {
                json: document,
                chunks,
            });
        }
        Self::gathered(document, folder, most_bytes)
    }

    /// Takes in what lies beside a `.gltf`: its first buffer as the binary chunk, everything else as data URIs.
    fn gathered(mut json: JsonDocument, folder: &Path, most_bytes: u64) -> Result<Self> {
        let mut chunks = Vec::new();
        for list in ["buffers", "images"] {
            let count = json
                .get(&format!("/{list}"))
                .and_then(Value::as_array)
                .map_or(0, Vec::len);
            for index in 0..count {
                let Some(stated) = json.get(&format!("/{list}/{index}/uri")).and_then(Value::as_str) else {
                    continue;
                };
                let is_first = list == "buffers" && index == 0;
                if stated.starts_with("data:") && !is_first {
                    continue;
                }
                let data = uri::read(stated, folder, most_bytes, &format!("{list} {index}"))?;
                if is_first {
                    json.remove("/buffers/0/uri");
                    json.set("/buffers/0/byteLength", json!(data.len()));
                    chunks = glb::chunk(*b"BIN\0", data, 0);
                } else {
                    let uri = format!("data:{};base64,{}", kind(list, &data), encoded(&data));
                    json.set(&format!("/{list}/{index}/uri"), json!(uri));
                }
            }
        }
        Ok(Self { json, chunks })
    }

    /// As a `.glb`.
    ///
    /// # Errors
    /// More than the 4 GiB that such a file can hold.
    pub fn into_glb(self) -> Result<Vec<u8>> {
        glb::file_of(self.json.into_text(), &self.chunks)
    }
}

fn kind(list: &str, data: &[u8]) -> &'static str {
    match data {
        _ if list == "buffers" => "application/octet-stream",
        [0x89, b'P', b'N', b'G', ..] => "image/png",
        [b'R', b'I', b'F', b'F', ..] => "image/webp",
        _ => "image/jpeg",
    }
}

/// Base64 (RFC 4648, section 4).
fn encoded(data: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(data.len().div_ceil(3) * 4);
    for three in data.chunks(3) {
        let byte = |index: usize| u32::from(three.get(index).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for digit in 0..4 {
            text.push(if digit > three.len() {
                '='
            } else {
                char::from(DIGITS[(bits >> (18 - 6 * digit) & 63) as usize])
            });
        }
    }
    text
}
