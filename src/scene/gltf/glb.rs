//! An editable `.glb`: its JSON document and its binary chunk.

use std::path::Path;

use gltf::json::Value;
use serde_json::json;

use super::container::{Container, HEADER_BYTES};
use super::context::damaged;
use super::uri;
use crate::error::{Error, Result};

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;

/// Document and binary data of a `.glb` file in the making.
#[derive(Clone, Debug)]
pub struct Glb {
    /// The document; [`into_bytes`](Self::into_bytes) states the length of its first buffer.
    pub json: Value,
    binary: Vec<u8>,
    /// Chunks after the binary one, with their headers.
    others: Vec<u8>,
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
            others: Vec::new(),
        }
    }

    /// Opens an existing file. A `.gltf` takes in everything beside it: its first buffer as the binary chunk, all else
    /// as data URIs.
    ///
    /// # Errors
    /// Text that is not JSON; a buffer or an image that cannot be read.
    pub(super) fn of(file: &Container, folder: &Path, most_bytes: u64) -> Result<Self> {
        let json = serde_json::from_slice(file.json).map_err(|error| {
            let what = format!("is damaged ({error})");
            damaged("JSON", what)
        })?;
        let mut glb = Self {
            json,
            binary: file.binary.unwrap_or_default().to_vec(),
            others: file.others.to_vec(),
        };
        // Removes the padding of the chunk.
        if glb.owns_first_buffer()
            && let Some(stated) = glb.json["buffers"][0]["byteLength"].as_u64()
        {
            glb.binary.truncate(usize::try_from(stated).unwrap_or(usize::MAX));
        }
        if !file.is_binary {
            glb.gather(folder, most_bytes)?;
        }
        Ok(glb)
    }

    fn gather(&mut self, folder: &Path, most_bytes: u64) -> Result<()> {
        for list in ["buffers", "images"] {
            let items = self.json.get_mut(list).and_then(Value::as_array_mut);
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
                    remove(item, "/uri");
                    self.binary = data;
                } else {
                    item["uri"] = json!(uri::data(kind(list, &data), &data));
                }
            }
        }
        Ok(())
    }

    /// Whether the first buffer, if any, is the binary chunk.
    pub(super) fn owns_first_buffer(&self) -> bool {
        self.json["buffers"][0].get("uri").is_none()
    }

    /// Binary data so far.
    pub fn binary(&self) -> &[u8] {
        &self.binary
    }

    /// The value at a JSON pointer, null if it is missing; creates the objects on the way. `None` if the path leads
    /// through a number, a text or beyond the end of a list.
    fn at(&mut self, pointer: &str) -> Option<&mut Value> {
        let mut place = &mut self.json;
        for name in pointer.split('/').skip(1) {
            if place.is_null() {
                *place = json!({});
            }
            place = match place {
                Value::Object(members) => members.entry(name).or_insert(Value::Null),
                Value::Array(items) => items.get_mut(name.parse::<usize>().ok()?)?,
                _ => return None,
            };
        }
        Some(place)
    }

    /// Sets the value at a JSON pointer, if the document has room for it there.
    pub fn set(&mut self, pointer: &str, value: Value) {
        if let Some(place) = self.at(pointer) {
            *place = value;
        }
    }

    /// Removes a member of an object.
    pub fn remove(&mut self, pointer: &str) {
        remove(&mut self.json, pointer);
    }

    /// Applies the differences between two statements of the same thing at a JSON pointer, and changes nothing else.
    pub fn patch(&mut self, pointer: &str, before: &Value, after: &Value) {
        if before != after
            && let Some(place) = self.at(pointer)
        {
            patch(place, before, after);
            let patched = place.clone();
            self.name_extensions(&patched);
        }
    }

    /// Appends to a list of the document, which is created if missing, and returns the index.
    pub fn push(&mut self, list: &str, item: Value) -> usize {
        self.name_extensions(&item);
        match self.at(list) {
            Some(Value::Array(items)) => {
                items.push(item);
                items.len() - 1
            }
            Some(list @ Value::Null) => {
                *list = json!([item]);
                0
            }
            // Not a list: whoever reads the file will notice that the item is missing.
            _ => 0,
        }
    }

    /// Adds a root node to the default scene and returns its index.
    pub fn push_root(&mut self, node: Value) -> usize {
        let node = self.push("/nodes", node);
        let scene = self.json["scene"].as_u64().unwrap_or(0);
        // Without scenes, all nodes that are no child are roots.
        if self.json.pointer(&format!("/scenes/{scene}")).is_some() {
            self.push(&format!("/scenes/{scene}/nodes"), json!(node));
        }
        node
    }

    /// Adds an extension to `extensionsUsed`.
    pub fn name_extension(&mut self, name: &str) {
        let named = self.json["extensionsUsed"].as_array();
        if !named.is_some_and(|named| named.iter().any(|other| other == name)) {
            self.push("/extensionsUsed", json!(name));
        }
    }

    /// Adds all extensions within an item.
    fn name_extensions(&mut self, item: &Value) {
        match item {
            Value::Array(items) => items.iter().for_each(|item| self.name_extensions(item)),
            Value::Object(members) => {
                let used = item["extensions"].as_object().into_iter().flatten();
                used.for_each(|(name, _)| self.name_extension(name));
                let members = members.iter().filter(|(name, _)| *name != "extras");
                members.for_each(|(_, member)| self.name_extensions(member));
            }
            _ => {}
        }
    }

    /// Appends binary data, aligned to four bytes, and returns the index of its view.
    pub fn push_view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let offset = self.binary.len();
        self.binary.extend(bytes);
        self.push(
            "/bufferViews",
            json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }),
        )
    }

    /// Adds vectors of two to four components with their bounds and returns the index of the accessor. There must be at
    /// least one, and all must be finite.
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
            "/accessors",
            json!({ "bufferView": view, "componentType": FLOAT, "count": vectors.len(),
                "type": format!("VEC{N}"), "min": low, "max": high }),
        )
    }

    /// Adds vertex indices and returns the index of the accessor.
    pub fn push_indices(&mut self, indices: impl IntoIterator<Item = u32>) -> usize {
        let bytes: Vec<u8> = indices.into_iter().flat_map(u32::to_le_bytes).collect();
        let view = self.push_view(&bytes);
        self.push(
            "/accessors",
            json!({ "bufferView": view, "componentType": UNSIGNED_INT, "count": bytes.len() / 4,
                "type": "SCALAR" }),
        )
    }

    /// Adds a PNG image and returns its index.
    pub fn push_png(&mut self, name: &str, bytes: &[u8]) -> usize {
        let view = self.push_view(bytes);
        self.push(
            "/images",
            json!({ "name": name, "bufferView": view, "mimeType": "image/png" }),
        )
    }

    /// Serialises the file.
    ///
    /// # Errors
    /// More than the 4 GiB that a `.glb` can hold.
    pub fn into_bytes(mut self) -> Result<Vec<u8>> {
        let mut chunks = Vec::new();
        if !self.binary.is_empty() && self.owns_first_buffer() {
            let length = json!(self.binary.len());
            match self.json["buffers"].get_mut(0) {
                Some(buffer) => buffer["byteLength"] = length,
                None => self.json["buffers"] = json!([{ "byteLength": length }]),
            }
        }
        push_chunk(&mut chunks, *b"JSON", self.json.to_string().as_bytes(), b' ');
        if !self.binary.is_empty() {
            push_chunk(&mut chunks, *b"BIN\0", &self.binary, 0);
        }
        chunks.extend(self.others);
        let length = u32::try_from(chunks.len() + HEADER_BYTES).map_err(|_| {
            Error::failure(
                "GLB",
                "would be larger than 4 GiB",
                "use smaller maps or a smaller scene",
            )
        })?;
        Ok([&b"glTF\x02\0\0\0"[..], &length.to_le_bytes(), &chunks].concat())
    }
}

/// Appends a chunk with its header, padded to four bytes.
fn push_chunk(chunks: &mut Vec<u8>, kind: [u8; 4], data: &[u8], padding: u8) {
    chunks.extend((data.len().next_multiple_of(4) as u32).to_le_bytes());
    chunks.extend(kind);
    chunks.extend(data);
    chunks.resize(chunks.len().next_multiple_of(4), padding);
}

fn kind(list: &str, data: &[u8]) -> &'static str {
    match data {
        _ if list == "buffers" => "application/octet-stream",
        [0x89, b'P', b'N', b'G', ..] => "image/png",
        [b'R', b'I', b'F', b'F', ..] => "image/webp",
        [0xab, b'K', b'T', b'X', ..] => "image/ktx2",
        _ => "image/jpeg",
    }
}

/// Removes a member of an object within a value.
pub fn remove(value: &mut Value, pointer: &str) {
    if let Some((owner, name)) = pointer.rsplit_once('/')
        && let Some(Value::Object(owner)) = value.pointer_mut(owner)
    {
        owner.shift_remove(name);
    }
}

fn patch(place: &mut Value, before: &Value, after: &Value) {
    if place.is_null() && after.is_object() {
        *place = json!({});
    }
    match (place, after) {
        (Value::Object(members), Value::Object(after)) => {
            for (name, after) in after {
                let before = &before[name];
                if before != after {
                    patch(members.entry(name).or_insert(Value::Null), before, after);
                }
            }
            let lost = before.as_object().into_iter().flatten().map(|(name, _)| name);
            lost.filter(|name| !after.contains_key(*name)).for_each(|name| {
                members.shift_remove(name);
            });
        }
        (Value::Array(items), Value::Array(after)) if items.len() == after.len() => {
            for (index, (item, after)) in items.iter_mut().zip(after).enumerate() {
                if before.get(index) != Some(after) {
                    patch(item, &before[index], after);
                }
            }
        }
        // A value of another kind belongs to somebody else and is kept.
        (_, Value::Object(_)) => {}
        (place, after) => *place = after.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file() -> Glb {
        let json = json!({ "ab": [1.5, { "x": "}]" }], "n": {}, "l": [], "n2": { "k": 1.0 } });
        Glb { json, ..Glb::empty() }
    }

    #[test]
    fn values_are_replaced_in_place_and_missing_ones_added_last() {
        let text = file().json.to_string();
        for (pointer, before, after) in [
            ("/ab/1/x", r#""}]""#, "7"),
            ("/n/p/q", "{}", r#"{"p":{"q":7}}"#),
            ("/n2/m", "1.0}", r#"1.0,"m":7}"#),
            ("/l/5", "", ""),
            ("/ab/0/x", "", ""),
        ] {
            let mut file = file();
            file.set(pointer, json!(7));
            assert_eq!(file.json.to_string(), text.replace(before, after), "{pointer}");
        }
        for (list, before, after) in [
            ("/l", "[]", "[7]"),
            ("/n/l", "{}", r#"{"l":[7]}"#),
            ("/n2", "", ""),
        ] {
            let mut file = file();
            assert_eq!(file.push(list, json!(7)), 0);
            assert_eq!(file.json.to_string(), text.replace(before, after), "{list}");
        }
    }

    #[test]
    fn members_are_removed_and_the_others_keep_their_order() {
        let text = file().json.to_string();
        for (pointer, before) in [("/n", r#""n":{},"#), ("/n2/k", r#""k":1.0"#), ("/none", "")] {
            let mut file = file();
            file.remove(pointer);
            assert_eq!(file.json.to_string(), text.replace(before, ""), "{pointer}");
        }
    }

    #[test]
    fn a_patch_changes_only_what_differs() {
        let mut file = file();
        let before = json!({ "colour": [1, 2, 3, 1], "gone": 1, "same": 2 });
        let after = json!({ "colour": [1, 5, 3, 1], "same": 2, "extensions": { "NEW": { "a": 1 } } });
        file.set(
            "/n",
            json!({ "gone": 4, "same": 9, "colour": [8, 8, 8, 0.5], "own": 1 }),
        );
        file.patch("/n", &before, &after);
        let patched =
            json!({ "same": 9, "colour": [8, 5, 8, 0.5], "own": 1, "extensions": { "NEW": { "a": 1 } } });
        assert_eq!(file.json["n"].to_string(), patched.to_string());
        assert_eq!(file.json["extensionsUsed"], json!(["NEW"]));
        file.set("/n/extras", json!("a text"));
        file.patch("/n", &json!({}), &json!({ "extras": { "a": 1 } }));
        assert_eq!(file.json["n"]["extras"], "a text");
        file.patch("/n3", &before, &after);
        assert_eq!(file.json["n3"]["colour"], after["colour"]);
    }
}
