//! glTF files made in memory, with what exporters would not write.

use std::path::Path;

use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::files;
use crate::scene::{LoadOptions, Scene, load};

/// JSON and binary data of a file to be.
#[derive(Clone)]
pub struct File {
    /// The document; anything may be changed in it.
    pub json: Value,
    binary: Vec<u8>,
}

impl File {
    /// A floor of 1 × 1 m at the origin (material 0), an upright mirror at x = 0.6 m (material 1), and a point light of
    /// 683 cd, 1 W/sr, between them: the nodes `floor`, `mirror` and `lamp`.
    pub fn upright_mirror() -> Self {
        let mut file = Self {
            json: json!({
                "asset": { "version": "2.0" },
                "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_ior", "KHR_materials_transmission",
                    "KHR_materials_volume"],
                "scene": 0,
                "scenes": [{ "nodes": [0, 1, 2] }],
                "nodes": [
                    { "name": "floor", "mesh": 0 },
                    { "name": "mirror", "mesh": 1 },
                    { "name": "lamp", "translation": [-0.1, 1.0, 0.05],
                      "extensions": { "KHR_lights_punctual": { "light": 0 } } }],
                "materials": [
                    { "name": "matte", "doubleSided": true,
                      "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 1.0 } },
                    { "name": "silver", "doubleSided": true,
                      "pbrMetallicRoughness": { "metallicFactor": 1.0, "roughnessFactor": 0.0 } }],
                "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 683.0 }] } },
                "meshes": [], "accessors": [], "bufferViews": [],
            }),
            binary: Vec::new(),
        };
        let (low, high) = (-0.5, 0.5);
        let floor = [
            [low, 0.0, low],
            [low, 0.0, high],
            [high, 0.0, high],
            [high, 0.0, low],
        ];
        file.add_rectangle(floor, [0.0, 1.0, 0.0], 0);
        let mirror = [
            [0.6, 0.0, -1.0],
            [0.6, 0.0, 1.0],
            [0.6, 1.5, 1.0],
            [0.6, 1.5, -1.0],
        ];
        file.add_rectangle(mirror, [-1.0, 0.0, 0.0], 1);
        file
    }

    /// Adds a mesh of two triangles.
    pub fn add_rectangle(&mut self, corners: [[f32; 3]; 4], normal: [f32; 3], material: usize) -> usize {
        let positions = self.add_vectors(&corners);
        let normals = self.add_vectors(&[normal; 4]);
        let indices = self.add_indices(&[0, 1, 2, 0, 2, 3]);
        self.push(
            "meshes",
            json!({ "primitives": [{ "attributes": { "POSITION": positions, "NORMAL": normals },
                "indices": indices, "material": material }] }),
        )
    }

    /// Adds an accessor of vectors and returns its index.
    pub fn add_vectors(&mut self, vectors: &[[f32; 3]]) -> usize {
        let bytes: Vec<u8> = vectors
            .iter()
            .flatten()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        self.add_accessor(&bytes, 5126, vectors.len(), "VEC3")
    }

    /// Adds an accessor of indices and returns its index.
    pub fn add_indices(&mut self, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.add_accessor(&bytes, 5125, indices.len(), "SCALAR")
    }

    fn add_accessor(&mut self, bytes: &[u8], component: u32, count: usize, kind: &str) -> usize {
        let view = json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len() });
        self.binary.extend(bytes);
        let view = self.push("bufferViews", view);
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": component, "count": count, "type": kind }),
        )
    }

    /// Appends to a list of the document and returns the index.
    pub fn push(&mut self, list: &str, item: Value) -> usize {
        let Some(items) = self.json[list].as_array_mut() else {
            self.json[list] = json!([item]);
            return 0;
        };
        items.push(item);
        items.len() - 1
    }

    /// Lists a node in the scene.
    pub fn push_root(&mut self, node: usize) {
        if let Some(nodes) = self.json["scenes"][0]["nodes"].as_array_mut() {
            nodes.push(json!(node));
        }
    }

    /// Puts all of the scene's nodes below one with that transform.
    #[must_use]
    pub fn below(mut self, mut parent: Value) -> Self {
        parent["children"] = self.json["scenes"][0]["nodes"].clone();
        let parent = self.push("nodes", parent);
        self.json["scenes"][0]["nodes"] = json!([parent]);
        self
    }

    /// Reads it, as a file that was given.
    ///
    /// # Errors
    /// As [`load`]; no place for a file that is there only for a moment.
    pub fn load(&self) -> Result<Scene> {
        let no_place = |error: std::io::Error| {
            Error::failure(
                "study stability",
                error.to_string(),
                "make room for temporary files",
            )
        };
        let folder = tempfile::tempdir().map_err(no_place)?;
        let path = folder.path().join("case.glb");
        files::write_atomically(&path, |writer| writer.write_all(&self.bytes()))?;
        load(&Path::new(&path).to_string_lossy(), &LoadOptions::default())
    }

    fn bytes(&self) -> Vec<u8> {
        let mut document = self.json.clone();
        document["buffers"] = json!([{ "byteLength": self.binary.len() }]);
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut body = Vec::new();
        for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &self.binary)] {
            body.extend((chunk.len() as u32).to_le_bytes());
            body.extend(kind);
            body.extend(chunk);
        }
        let mut bytes = b"glTF\x02\0\0\0".to_vec();
        bytes.extend((body.len() as u32 + 12).to_le_bytes());
        bytes.extend(body);
        bytes
    }
}
