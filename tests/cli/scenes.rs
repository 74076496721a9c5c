//! Scenes as files, written here.

use std::f64::consts::FRAC_1_SQRT_2;

use base64::encode;
use serde_json::{Value, json};

/// One triangle of 1 m legs, lying flat; without lights.
pub fn dark_triangle() -> String {
    triangle().to_string()
}

/// The same under a sun of 683 lx = 1 W/m²: nothing specular in it.
pub fn lit_matte_triangle() -> String {
    let mut scene = triangle();
    scene["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    scene["extensions"] =
        json!({"KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": 683.0}]}});
    scene["nodes"] = json!([
        {"mesh": 0, "name": "floor"},
        // Turned so that its −z points down.
        {"rotation": [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2],
         "extensions": {"KHR_lights_punctual": {"light": 0}}},
    ]);
    scene["scenes"] = json!([{"nodes": [0, 1]}]);
    scene.to_string()
}

fn triangle() -> Value {
    let positions: [f32; 9] = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0];
    let bytes: Vec<u8> = positions.iter().flat_map(|value| value.to_le_bytes()).collect();
    json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "floor"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                       "min": [0.0, 0.0, 0.0], "max": [1.0, 0.0, 1.0]}],
        "bufferViews": [{"buffer": 0, "byteLength": bytes.len()}],
        "buffers": [{"byteLength": bytes.len(),
                     "uri": format!("data:application/octet-stream;base64,{}", encode(&bytes))}],
    })
}

/// RFC 4648 base64, for whole triples of bytes.
mod base64 {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

    pub fn encode(bytes: &[u8]) -> String {
        assert!(bytes.len().is_multiple_of(3), "no padding is written");
        bytes
            .as_chunks::<3>()
            .0
            .iter()
            .flat_map(|&[a, b, c]| {
                let word = u32::from_be_bytes([0, a, b, c]);
                [18, 12, 6, 0].map(|shift| char::from(ALPHABET[(word >> shift) as usize & 63]))
            })
            .collect()
    }
}
