//! An edited scene as a `.glb`: the file that it was loaded from, with nothing changed but what was edited. What the
//! program does not know survives, in its order.

use std::mem::discriminant;
use std::path::Path;

use glam::DVec3;
use gltf::json::Value;
use serde_json::json;

use self::lights::Edited;
use self::placing::Placing;
use super::area_light;
use super::document::{self, Document};
use super::light::{self, Origin};
use super::nodes::{self, Placed};
use super::report::Report;
use super::write::lights as written_lights;
use crate::error::{Error, Result};
use crate::files;
use crate::scene::gltf::{glb, uri};
use crate::scene::{Light, LightKind, LoadOptions, Motion, Scene};

mod lights;
mod materials;
mod new_lights;
mod placing;

/// Corners of a scene that is read back may differ by this share of its extent, and other numbers of themselves: lights and
/// materials are 32-bit numbers in a file [1].
const SAME: f64 = 1e-6;

/// Writes `edited`, which `loaded` from `original` was edited to, as a `.glb`.
///
/// # Errors
/// A file that changed since it was loaded; an edit that no file can hold; a place that cannot be written.
pub fn save(
    original: &Path,
    target: &Path,
    loaded: &Scene,
    edited: &Scene,
    options: &LoadOptions,
) -> Result<()> {
    let bytes = files::read_file(original, options.memory_limit_bytes)?;
    let folder = original.parent().unwrap_or(Path::new(""));
    let mut report = Report::default();
    let split = super::container::split(&bytes, &mut report)?;
    let document = document::parse(split.json, &mut report)?;
    let placed = nodes::place(&document, &mut report)?;
    let mut lights = light::read_all(&document, &placed, folder, &mut report)?;
    area_light::add_all(&mut lights, &document, &placed, folder, &mut report)?;
    let origins: Vec<Origin> = lights.into_iter().map(|(_, origin)| origin).collect();

    let mut parts = Parts::of(&bytes, split.json, folder, options.memory_limit_bytes)?;
    let mut patch = Patch {
        loaded,
        edited,
        document: &document,
        placing: Placing::new(&placed),
        json: &mut parts.json,
    };
    patch.check_original(&placed, &origins, original)?;
    patch.lights(&origins)?;
    patch.materials()?;
    patch.objects()?;
    patch.placing.write(&document, patch.json);
    let bytes = parts.into_glb()?;
    check(&bytes, original, edited, options)?;
    files::write_atomically(target, |writer| writer.write_all(&bytes))
}

/// What is written while it is written.
struct Patch<'a> {
    loaded: &'a Scene,
    edited: &'a Scene,
    document: &'a Document,
    placing: Placing<'a>,
    json: &'a mut JsonDocument,
}

impl Patch<'_> {
    /// Another program may have written the file since.
    fn check_original(&self, placed: &[Placed], origins: &[Origin], path: &Path) -> Result<()> {
        let has_nodes = self.loaded.objects.iter().all(|object| {
            let mut placed = placed.iter();
            placed.any(|placed| placed.node == object.node && placed.name == object.name)
        });
        let has_materials = self.loaded.materials.len() >= self.document.root.materials.len();
        if has_nodes && has_materials && self.loaded.lights.len() >= origins.len() {
            return Ok(());
        }
        Err(Error::failure(
            path.display().to_string(),
            "is not the file any more that the scene was loaded from",
            "open it again and repeat the edits",
        ))
    }

    fn lights(&mut self, origins: &[Origin]) -> Result<()> {
        let materials = self.document.root.materials.len();
        let shift = self.edited.origin_world;
        for (index, is) in self.edited.lights.iter().enumerate() {
            let place = self.edited.light_when_loaded(index);
            let (was, origin) = match place {
                Some(place) => (Some(&self.loaded.lights[place]), origins.get(place)),
                None => (None, None),
            };
            let is_foreign = origin.is_none() && written_lights::stated(is).is_some();
            match (was, origin) {
                _ if is_foreign && is_to_be_written(index, self.loaded, self.edited) => {
                    new_lights::write(is, shift, self.document, self.json)?;
                }
                (Some(was), _) if was == is => {}
                (Some(was), Some(origin)) => {
                    let of_file = (self.document, shift);
                    Edited { was, is }.write(origin, of_file, &mut self.placing, self.json)?;
                }
                (was, _) => {
                    let was = was.unwrap_or(is);
                    Edited { was, is }.write_glow(self.edited, materials, self.json)?;
                }
            }
        }
        for place in &self.edited.light_list.removed {
            if let Some(origin) = origins.get(*place) {
                let path = format!("/nodes/{}/extensions/{}", origin.node, origin.list);
                self.json.remove(&path);
            }
        }
        Ok(())
    }

    fn materials(&mut self) -> Result<()> {
        let in_file = self.document.root.materials.len();
        let shift = self.edited.origin_world;
        let pairs = self.loaded.materials.iter().zip(&self.edited.materials);
        for (index, (was, is)) in pairs.enumerate() {
            if index < in_file {
                materials::write(index, was, is, shift, self.json)?;
            }
        }
        Ok(())
    }

    fn objects(&mut self) -> Result<()> {
        for (index, object) in self.edited.objects.iter().enumerate() {
            let motion = object.motion();
            if *motion != Motion::default()
                && let Some(stands) = self.placing.of(object.node)
            {
                let pivot = self.edited.pivot(index) + self.edited.origin_world;
                self.placing
                    .put(object.node, motion.about(pivot) * stands, &object.name)?;
            }
        }
        Ok(())
    }
}

/// Whether a light that is not the file's becomes so: it was added, or edited, or others make the file one with light, so
/// that it would not be given a sun any more.
fn is_to_be_written(light: usize, loaded: &Scene, edited: &Scene) -> bool {
    let was = edited.light_when_loaded(light).map(|place| &loaded.lights[place]);
    was != Some(&edited.lights[light]) || !edited.light_list.added.is_empty()
}

/// Reads what is to be written as anybody would, and refuses it where that is not the edited scene.
fn check(bytes: &[u8], original: &Path, edited: &Scene, options: &LoadOptions) -> Result<()> {
    let read = super::read_scene(bytes, original, options)?;
    let differs = |what: String| {
        Error::failure(
            what,
            "cannot be saved as it is: the file has something that stands against it",
            "take its last edit back and save again",
        )
    };
    let extent_m = edited.bounds().map_or(1.0, |(low, high)| (high - low).length());
    let shift = read.origin_world - edited.origin_world;
    let is_at = |a: DVec3, b: DVec3| (a + shift).distance(b) <= SAME * extent_m;
    for (read, is) in read.objects.iter().zip(&edited.objects) {
        let mut corners = read
            .mesh_in_scene()
            .positions
            .iter()
            .zip(&is.mesh_in_scene().positions);
        if !corners.all(|(read, is)| is_at(*read, *is)) {
            return Err(differs(format!("object `{}`", is.name)));
        }
    }
    for (read, is) in read.materials.iter().zip(&edited.materials) {
        let colours = read
            .base_colour
            .to_array()
            .into_iter()
            .zip(is.base_colour.to_array());
        let numbers = [(read.ior, is.ior), (read.roughness, is.roughness)];
        let is_same = colours.chain(numbers).all(|(read, is)| is_near(read, is))
            && read.surface == is.surface
            && read.metal == is.metal
            && read.waves.is_some() == is.waves.is_some();
        if !is_same {
            return Err(differs(format!("material `{}`", is.name)));
        }
    }
    check_lights(&read, edited, &is_at).map_err(differs)
}

/// Whether two numbers are the same but for what 32 bits make of them.
fn is_near(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME * a.abs().max(b.abs()).max(1e-9)
}

/// Every light that is to be in the file is there, in whatever order, and no other; or what is wrong.
fn check_lights(
    read: &Scene,
    edited: &Scene,
    is_at: &impl Fn(DVec3, DVec3) -> bool,
) -> std::result::Result<(), String> {
    let mut left: Vec<&Light> = read.lights.iter().collect();
    let is_same = |read: &Light, is: &Light| {
        let colours = read.colour.to_array().into_iter().zip(is.colour.to_array());
        let strengths = [(read.kind.strength(), is.kind.strength())];
        let places = read.kind.position().into_iter().zip(is.kind.position());
        discriminant(&read.kind) == discriminant(&is.kind)
            && colours.chain(strengths).all(|(read, is)| is_near(read, is))
            && places.into_iter().all(|(read, is)| is_at(read, is))
    };
    for is in &edited.lights {
        if let Some(found) = left.iter().position(|read| is_same(read, is)) {
            left.remove(found);
        } else if !is_of_program(is, read) {
            return Err(format!("light `{}`", is.name));
        }
    }
    match left.first() {
        Some(light) => Err(format!("light `{}`", light.name)),
        None => Ok(()),
    }
}

/// Whether a light is what the program gives a scene, and no part of its file: the environment, or the sun of a scene
/// without light.
fn is_of_program(light: &Light, read: &Scene) -> bool {
    let is_sun_of_dark = matches!(light.kind, LightKind::Sun { .. }) && read.lights.is_empty();
    is_sun_of_dark || matches!(light.kind, LightKind::Environment { .. })
}

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

/// A document that was parsed before.
#[derive(Clone, Debug)]
pub struct JsonDocument {
    root: Value,
    /// As it was read, until something changes.
    unchanged: Option<String>,
}

impl JsonDocument {
    /// Parses a text.
    ///
    /// # Errors
    /// Something else than JSON in UTF-8.
    pub fn parse(json: &[u8]) -> Result<Self> {
        let refused = |what: String| Error::failure("JSON", what, "export the file again");
        let text = std::str::from_utf8(json).map_err(|_| refused("is not UTF-8".into()))?;
        let text = text.trim_end_matches([' ', '\0']);
        Ok(Self {
            root: serde_json::from_str(text).map_err(|error| refused(format!("is damaged ({error})")))?,
            unchanged: Some(text.to_owned()),
        })
    }

    /// As it is now.
    pub fn into_text(self) -> String {
        self.unchanged.unwrap_or_else(|| self.root.to_string())
    }

    /// The value that a path of names and indices leads to; `None` where there is none.
    pub fn get(&self, path: &str) -> Option<&Value> {
        self.root.pointer(path)
    }

    /// Sets a value; objects on the way to it are made where they are missing, and a list takes one more item at its end.
    /// Nothing happens where the path cannot be: a number is no object, and a list has no names.
    pub fn set(&mut self, path: &str, value: Value) {
        let mut place = &mut self.root;
        for name in path.split('/').skip(1) {
            place = match place {
                Value::Object(members) => members.entry(name).or_insert_with(|| json!({})),
                Value::Array(items) => {
                    let Some(index) = name.parse::<usize>().ok().filter(|index| *index <= items.len()) else {
                        return;
                    };
                    if index == items.len() {
                        items.push(json!({}));
                    }
                    &mut items[index]
                }
                _ => return,
            };
        }
        *place = value;
        self.unchanged = None;
    }

    /// Adds an item to a list, which is made where it is missing; gives its index.
    pub fn append(&mut self, list: &str, item: Value) -> usize {
        let count = self.get(list).and_then(Value::as_array).map_or(0, Vec::len);
        match count {
            0 => self.set(list, json!([item])),
            _ => self.set(&format!("{list}/{count}"), item),
        }
        count
    }

    /// Takes a member out of an object.
    pub fn remove(&mut self, path: &str) {
        let Some((owner, name)) = path.rsplit_once('/') else {
            return;
        };
        let owner = self.root.pointer_mut(owner).and_then(Value::as_object_mut);
        if owner.and_then(|owner| owner.shift_remove(name)).is_some() {
            self.unchanged = None;
        }
    }

    /// Names an extension among those that the file uses.
    pub fn use_extension(&mut self, name: &str) {
        const USED: &str = "/extensionsUsed";
        let used = self.get(USED).and_then(Value::as_array);
        if !used.is_some_and(|used| used.iter().any(|used| used == name)) {
            self.append(USED, json!(name));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"{"ab":[1.5,{"x":"}]"}],"n":{},"l":[],"n2":{"k":1.0}}"#;

    fn changed(change: impl FnOnce(&mut JsonDocument)) -> String {
        let mut document = JsonDocument::parse(TEXT.as_bytes()).expect("it is JSON");
        change(&mut document);
        document.into_text()
    }

    #[test]
    fn values_are_replaced_in_place_and_missing_ones_added_last() {
        for (path, before, after) in [
            ("/ab/1/x", r#""}]""#, "7"),
            ("/n/p/q", "{}", r#"{"p":{"q":7}}"#),
            ("/n2/m", "1.0}", r#"1.0,"m":7}"#),
            ("/l/0", "[]", "[7]"),
            ("/l/5", "", ""),
            ("/ab/0/x", "", ""),
        ] {
            let text = changed(|document| document.set(path, json!(7)));
            assert_eq!(text, TEXT.replace(before, after), "{path}");
        }
    }

    #[test]
    fn members_are_removed_and_the_others_keep_their_order() {
        for (path, before) in [("/n", r#""n":{},"#), ("/n2/k", r#""k":1.0"#), ("/none", "")] {
            let text = changed(|document| document.remove(path));
            assert_eq!(text, TEXT.replace(before, ""), "{path}");
        }
    }

    #[test]
    fn without_a_change_the_text_stays_as_it_was_written() {
        let text = "{ \"a\" : 1e-0,\n \"b\":[ ] }";
        let document = JsonDocument::parse(text.as_bytes()).expect("it is JSON");
        assert_eq!(document.into_text(), text);
    }
}
