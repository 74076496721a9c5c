//! The parts of a file and how they are put together again.

use std::path::Path;

use gltf::json::Value;
use serde_json::json;

use super::json_text::JsonText;
use crate::error::{Error, Result};
use crate::scene::gltf::uri;

const HEADER_BYTES: usize = 12;

/// A file as text and the bytes that go with it.
pub struct Parts {
    /// The JSON.
    pub text: JsonText,
    /// Every chunk after the JSON, with its header.
    pub chunks: Vec<u8>,
}

impl Parts {
    /// Of a `.glb`, or of a `.gltf` with all that lies beside it.
    ///
    /// # Errors
    /// A buffer or an image that cannot be read, or text that is not UTF-8.
    pub fn of(bytes: &[u8], json: &[u8], folder: &Path, most_bytes: u64) -> Result<Self> {
        let text = std::str::from_utf8(json)
            .map_err(|_| Error::failure("JSON", "is not UTF-8", "export the file again"))?;
        let text = JsonText::new(text.trim_end_matches([' ', '\0']).to_owned());
        if bytes.starts_with(b"glTF") {
            let stated = bytes.get(8..HEADER_BYTES).and_then(|four| four.try_into().ok());
            let end = stated.map_or(bytes.len(), |four| u32::from_le_bytes(four) as usize);
            let begin = HEADER_BYTES + 8 + json.len();
            let chunks = bytes
                .get(begin..end.min(bytes.len()))
                .unwrap_or_default()
                .to_vec();
            return Ok(Self { text, chunks });
        }
        Self::gathered(text, json, folder, most_bytes)
    }

    /// Takes in what lies beside a `.gltf`: its first buffer as the binary chunk, everything else as data URIs.
    fn gathered(mut text: JsonText, json: &[u8], folder: &Path, most_bytes: u64) -> Result<Self> {
        let root: Value = serde_json::from_slice(json).unwrap_or_default();
        let mut chunks = Vec::new();
        for list in ["buffers", "images"] {
            let items = root.get(list).and_then(Value::as_array);
            for (index, item) in items.into_iter().flatten().enumerate() {
                let Some(stated) = item.get("uri").and_then(Value::as_str) else {
                    continue;
                };
                let is_first = list == "buffers" && index == 0;
                if stated.starts_with("data:") && !is_first {
                    continue;
                }
                let data = uri::read(stated, folder, most_bytes, &format!("{list} {index}"))?;
                if is_first {
                    text.remove("/buffers/0/uri");
                    text.set("/buffers/0/byteLength", &json!(data.len()));
                    chunks = chunk(*b"BIN\0", data, 0);
                } else {
                    let uri = format!("data:{};base64,{}", kind(list, &data), encoded(&data));
                    text.set(&format!("/{list}/{index}/uri"), &json!(uri));
                }
            }
        }
        Ok(Self { text, chunks })
    }

    /// As a `.glb`.
    ///
    /// # Errors
    /// More than the 4 GiB that such a file can hold.
    pub fn into_glb(self) -> Result<Vec<u8>> {
        let json = chunk(*b"JSON", self.text.into_text().into_bytes(), b' ');
        let length = HEADER_BYTES + json.len() + self.chunks.len();
        let length = u32::try_from(length)
            .map_err(|_| Error::failure("GLB", "would be larger than 4 GiB", "save a smaller scene"))?;
        let mut bytes = b"glTF\x02\0\0\0".to_vec();
        bytes.extend(length.to_le_bytes());
        bytes.extend(json);
        bytes.extend(self.chunks);
        Ok(bytes)
    }
}

/// Data with a header, padded to four bytes.
fn chunk(kind: [u8; 4], mut data: Vec<u8>, padding: u8) -> Vec<u8> {
    data.resize(data.len().next_multiple_of(4), padding);
    let mut bytes = (data.len() as u32).to_le_bytes().to_vec();
    bytes.extend(kind);
    bytes.extend(data);
    bytes
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
