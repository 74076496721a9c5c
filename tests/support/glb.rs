//! Small glTF files made in memory.

use std::path::Path;

use nephroid::error::Result;

use crate::prelude::*;
use crate::project_file;

/// JSON and binary data of a file.
#[derive(Clone)]
pub struct Glb {
    pub json: Value,
    pub binary: Vec<u8>,
}

impl Glb {
    /// A file with an empty scene.
    pub fn empty() -> Self {
        let json = json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "nodes": [] }],
            "nodes": [], "meshes": [], "accessors": [], "bufferViews": [], "materials": [],
        });
        Self {
            json,
            binary: Vec::new(),
        }
    }

    /// Appends to a list in the JSON; returns the index.
    pub fn push(&mut self, list: &str, item: Value) -> usize {
        let fields = self.json.as_object_mut().expect("a file is an object");
        let items = fields.entry(list).or_insert_with(|| json!([]));
        let items = items.as_array_mut().expect("is a list");
        items.push(item);
        items.len() - 1
    }

    /// Adds a node to the scene; returns its index.
    pub fn push_root(&mut self, node: Value) -> usize {
        let index = self.push("nodes", node);
        let nodes = self.json["scenes"][0]["nodes"]
            .as_array_mut()
            .expect("the scene lists nodes");
        nodes.push(json!(index));
        index
    }

    /// Adds bytes as a new buffer view.
    pub fn push_view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.binary.len();
        self.binary.extend(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.push(
            "bufferViews",
            json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }),
        )
    }

    /// Adds an accessor of floats with `width` components per element.
    pub fn push_floats(&mut self, values: &[f32], width: usize) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.push_view(&bytes);
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][width - 1];
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": 5126, "count": values.len() / width, "type": kind }),
        )
    }

    /// Adds an accessor of 32-bit indices.
    pub fn push_indices(&mut self, values: &[u32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.push_view(&bytes);
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": 5125, "count": values.len(), "type": "SCALAR" }),
        )
    }

    /// Adds an accessor of vectors.
    pub fn push_vectors(&mut self, vectors: &[DVec3]) -> usize {
        let floats: Vec<f32> = vectors.iter().flat_map(|vector| vector.as_vec3().to_array()).collect();
        self.push_floats(&floats, 3)
    }

    /// Adds a mesh with one primitive.
    pub fn push_mesh(&mut self, primitive: Value) -> usize {
        self.push("meshes", json!({ "primitives": [primitive] }))
    }

    /// The triangle (0 0 0), (1 0 0), (0 1 0) without normals, on the node `tri`.
    pub fn triangle() -> Self {
        let mut file = Self::empty();
        let positions = file.push_floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0], 3);
        let mesh = file.push_mesh(json!({ "attributes": { "POSITION": positions } }));
        file.push_root(json!({ "name": "tri", "mesh": mesh }));
        file
    }

    /// A closed tetrahedron with smooth normals, on the node `solid`.
    pub fn tetrahedron() -> Self {
        let mut file = Self::empty();
        let corners = [1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, 1.0, -1.0, -1.0, -1.0, 1.0];
        let positions = file.push_floats(&corners, 3);
        let normals = file.push_floats(&corners.map(|x: f32| x / 3.0_f32.sqrt()), 3);
        let indices = file.push_indices(&[0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2]);
        let attributes = json!({ "POSITION": positions, "NORMAL": normals });
        let mesh = file.push_mesh(json!({ "attributes": attributes, "indices": indices }));
        file.push_root(json!({ "name": "solid", "mesh": mesh }));
        file
    }

    /// Adds a material and assigns it to the first mesh.
    pub fn with_material(mut self, material: Value) -> Self {
        let material = self.push("materials", material);
        self.json["meshes"][0]["primitives"][0]["material"] = json!(material);
        self
    }

    /// Adds a light on a node of the same name.
    pub fn with_light(mut self, name: &str, light: Value) -> Self {
        let lights = &mut self.json["extensions"]["KHR_lights_punctual"]["lights"];
        if lights.is_null() {
            *lights = json!([]);
        }
        let lights = lights.as_array_mut().expect("is a list");
        lights.push(light);
        let index = lights.len() - 1;
        self.push_root(json!({ "name": name, "extensions": { "KHR_lights_punctual": { "light": index } } }));
        self
    }

    /// The same light at a place.
    pub fn with_light_at(self, name: &str, light: Value, place: [f64; 3]) -> Self {
        let mut file = self.with_light(name, light);
        let nodes = file.json["nodes"].as_array_mut().expect("a list");
        nodes.last_mut().expect("the light's")["translation"] = json!(place);
        file
    }

    /// Adds an image of these bytes, a texture of it, and a material with that texture, for the first mesh.
    pub fn with_texture(mut self, bytes: &[u8], mut image: Value, texture: Value) -> Self {
        image["bufferView"] = json!(self.push_view(bytes));
        self.push("images", image);
        self.push("textures", texture);
        self.with_material(json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }))
    }

    /// The bytes of the `.glb` file.
    pub fn bytes(&self) -> Vec<u8> {
        let mut file = self.clone();
        if !self.binary.is_empty() {
            file.json["buffers"] = json!([{ "byteLength": self.binary.len() }]);
        }
        file.bytes_as_stated()
    }

    /// The same with `buffers` as in the JSON.
    pub fn bytes_as_stated(&self) -> Vec<u8> {
        assembled(self.json.to_string().into_bytes(), self.binary.clone())
    }

    /// Loads the file.
    pub fn load(&self) -> Result<Scene> {
        self.load_with(&LoadOptions::default())
    }

    /// Loads the file with options.
    pub fn load_with(&self, options: &LoadOptions) -> Result<Scene> {
        load_bytes(&self.bytes(), options)
    }

    /// Loads the file; panics if that fails.
    #[track_caller]
    pub fn scene(&self) -> Scene {
        self.load().unwrap_or_else(|error| panic!("{error}"))
    }

    /// Asserts that the file is refused with a message that contains these words.
    #[track_caller]
    pub fn assert_refused(&self, words: &str) {
        let refusal = self.refusal();
        assert!(refusal.contains(words), "{refusal}");
    }

    /// The message with which the file is refused.
    #[track_caller]
    pub fn refusal(&self) -> String {
        self.load().expect_err("has to be refused").to_string()
    }
}

/// A `.glb` file of a JSON text and a binary part, with lengths that fit.
pub fn assembled(mut text: Vec<u8>, mut binary: Vec<u8>) -> Vec<u8> {
    text.resize(text.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let length = |bytes: &[u8]| (bytes.len() as u32).to_le_bytes();
    let json = [&length(&text)[..], b"JSON", &text].concat();
    let data = [&length(&binary)[..], b"BIN\0", &binary].concat();
    let whole = 12 + json.len() as u32 + data.len() as u32;
    [b"glTF\x02\0\0\0", &whole.to_le_bytes()[..], &json, &data].concat()
}

/// The JSON text of a `.glb` file, and its binary part.
pub fn parts_of(file: &[u8]) -> Option<(&[u8], &[u8])> {
    let word = |at: usize| Some(u32::from_le_bytes(file.get(at..at + 4)?.try_into().ok()?) as usize);
    let json_end = 20 + word(12)?;
    Some((file.get(20..json_end)?, file.get(json_end + 8..).unwrap_or_default()))
}

/// A file of the folder of files that others packed.
pub fn golden(name: &str) -> Vec<u8> {
    std::fs::read(project_file(&format!("tests/goldens/gltf/{name}"))).expect("the file is part of the project")
}

/// Loads bytes as a `.glb` file.
pub fn load_bytes(bytes: &[u8], options: &LoadOptions) -> Result<Scene> {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("test.glb");
    std::fs::write(&path, bytes).expect("file can be written");
    load_path(&path, options)
}

/// Loads a file.
pub fn load_path(path: &Path, options: &LoadOptions) -> Result<Scene> {
    Scene::load(path.to_str().expect("path is UTF-8"), options)
}

/// Asserts that one of the scene's warnings contains all parts.
#[track_caller]
pub fn assert_warned(scene: &Scene, parts: &[&str]) {
    let all: Vec<String> = scene.warnings.iter().map(ToString::to_string).collect();
    let found = all
        .iter()
        .any(|warning| parts.iter().all(|part| warning.contains(part)));
    assert!(found, "no warning has {parts:?} among {all:#?}");
}
