//! Scenes as files: a floor and a mirror under a lamp, with what the program does not know.

use std::fs;
use std::path::{Path, PathBuf};

use support::glb::{assembled, parts_of};
use support::prelude::*;

/// Two squares of four corners: positions, then normals, then two triangles.
fn binary() -> Vec<u8> {
    let floor = [
        [-1.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 0.0, -1.0],
        [-1.0, 0.0, -1.0],
    ];
    let wall = [
        [-0.5, 0.2, 0.0],
        [0.5, 0.2, 0.0],
        [0.5, 0.8, 0.0],
        [-0.5, 0.8, 0.0],
    ];
    let (up, front) = ([[0.0, 1.0, 0.0]; 4], [[0.0, 0.0, 1.0]; 4]);
    let vectors = [floor, up, wall, front].concat().concat();
    let bytes = vectors.into_iter().flat_map(|value: f32| value.to_le_bytes());
    let indices = [0_u16, 1, 2, 0, 2, 3].into_iter().flat_map(u16::to_le_bytes);
    bytes.chain(indices).collect()
}

/// The JSON text, in an order and a way of writing numbers that no serialiser has.
pub fn json_text(candela: &str, uri: Option<&str>) -> String {
    let uri = uri.map_or(String::new(), |uri| format!("\"uri\" : \"{uri}\","));
    let accessor = |view: usize, count: usize, kind: &str, component: usize| {
        format!(r#"{{"bufferView":{view},"componentType":{component},"count":{count},"type":"{kind}"}}"#)
    };
    let vectors: Vec<String> = (0..4).map(|view| accessor(view, 4, "VEC3", 5126)).collect();
    let views: Vec<String> = (0..4)
        .map(|view| format!(r#"{{"buffer":0,"byteOffset":{},"byteLength":48}}"#, 48 * view))
        .collect();
    format!(
        r#"{{ "asset" : {{"version":"2.0", "generator": "Hand \u0026 Co"}},
  "extensionsUsed": ["KHR_lights_punctual", "VENDOR_invented_thing", "KHR_materials_ior"],
  "extensions": {{"KHR_lights_punctual": {{"lights": [{{"type":"point", "intensity": {candela}, "name":"bulb"}}]}},
    "VENDOR_invented_thing": {{ "deep": [1.50, 1e-0, {{"x":"caf\u00e9"}}], "big": 12345678901234567890123 }} }},
  "scene":0, "scenes":[{{"nodes":[0,1,3]}}],
  "nodes": [
    {{"name":"floor","mesh":0,"extras":{{"note":"kept"}}}},
    {{"name":"frame","rotation":[0.0, 0.38268343236508977, 0.0, 0.92387953251128674],"children":[2],"scale":[2.0,2,2]}},
    {{"name":"mirror","mesh":1,"translation":[0.1, 0.0, -0.25]}},
    {{"name":"lamp","translation":[0.5,1.5,0.75],"extensions":{{"KHR_lights_punctual":{{"light":0}},"VENDOR_invented_thing":{{"of":"lamp"}}}}}}
  ],
  "meshes":[
    {{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1}},"indices":4,"material":0}}]}},
    {{"primitives":[{{"attributes":{{"POSITION":2,"NORMAL":3}},"indices":4,"material":1}}]}}
  ],
  "materials":[
    {{"name":"matte","pbrMetallicRoughness":{{"baseColorFactor":[0.80,0.7,0.6,1.0],"metallicFactor":0}}}},
    {{"name":"silver","pbrMetallicRoughness":{{"metallicFactor":1.0,"roughnessFactor":0.0}},"extras":{{"VENDOR":{{"a":1.10}}}},"doubleSided":true}}
  ],
  "accessors":[{},{}],
  "bufferViews":[{},{{"buffer":0,"byteOffset":192,"byteLength":12}}],
  "buffers":[{{{uri}"byteLength":204}}]
}}"#,
        vectors.join(","),
        accessor(4, 6, "SCALAR", 5123),
        views.join(",")
    )
}

/// `NAME.gltf` with `NAME.bin` beside it.
pub fn gltf(folder: &Path, name: &str, candela: &str) -> PathBuf {
    let path = folder.join(format!("{name}.gltf"));
    fs::write(folder.join(format!("{name}.bin")), binary()).expect("it is written");
    fs::write(&path, json_text(candela, Some(&format!("{name}.bin")))).expect("it is written");
    path
}

/// `NAME.glb`.
pub fn glb(folder: &Path, name: &str, candela: &str) -> PathBuf {
    let path = folder.join(format!("{name}.glb"));
    let bytes = assembled(json_text(candela, None).into_bytes(), binary());
    fs::write(&path, bytes).expect("it is written");
    path
}

/// The text of a `.glb`'s JSON chunk.
pub fn text_of(path: &Path) -> String {
    let bytes = fs::read(path).expect("it is there");
    let (text, _) = parts_of(&bytes).expect("it is whole");
    String::from_utf8(text.to_vec()).expect("it is text")
}

/// What somebody's editor leaves while it writes.
pub fn break_off(path: &Path) {
    let bytes = fs::read(path).expect("it is there");
    fs::write(path, &bytes[..bytes.len() / 2]).expect("it is written");
}

/// No scene at all.
pub fn no_scene(folder: &Path) -> PathBuf {
    let path = folder.join("broken.gltf");
    let text: Value = json!({"asset": {"version": "1.0"}});
    fs::write(&path, text.to_string()).expect("it is written");
    path
}
