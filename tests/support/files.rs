//! Scene files made in memory.

use std::f64::consts::FRAC_1_SQRT_2;

use base64::encode;
use serde_json::{Value, json};

/// A horizontal triangle with legs of 1 m, without lights.
pub fn dark_triangle() -> String {
    triangle().to_string()
}

/// The same triangle under a sun of 683 lx = 1 W/m²; nothing is specular.
pub fn lit_matte_triangle() -> String {
    let mut scene = triangle();
    scene["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    scene["extensions"] =
        json!({"KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": 683.0}]}});
    scene["nodes"] = json!([
        {"mesh": 0, "name": "floor"},
        // Rotated so that its −z axis points down.
        {"rotation": [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2],
         "extensions": {"KHR_lights_punctual": {"light": 0}}},
    ]);
    scene["scenes"] = json!([{"nodes": [0, 1]}]);
    scene.to_string()
}

/// A point light of 5 cm radius, a sun of 0.53°, a panel of 0.5 m², and the floor as an emitter; the last two emit 1
/// W/(m² sr).
pub fn lamps_with_extent() -> String {
    let mut scene = triangle();
    scene["materials"] = json!([{"emissiveFactor": [1.0, 1.0, 1.0],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 683.0}}}]);
    scene["meshes"][0]["primitives"][0]["material"] = json!(0);
    scene["extensionsUsed"] = json!([
        "KHR_lights_punctual",
        "EXT_lights_area",
        "KHR_materials_emissive_strength"
    ]);
    scene["extensions"] = json!({
        "KHR_lights_punctual": {"lights": [
            {"type": "point", "extras": {"radius_m": 0.05}},
            {"type": "directional", "extras": {"angular_diameter_deg": 0.53}},
        ]},
        "EXT_lights_area": {"lights": [
            {"type": "rect", "intensity": 683.0, "size": 0.5, "rect": {"aspect": 2.0}},
        ]},
    });
    scene["nodes"] = json!([
        {"mesh": 0, "name": "floor"},
        {"translation": [0.0, 1.0, 0.0], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"extensions": {"KHR_lights_punctual": {"light": 1}}},
        {"translation": [0.0, 2.0, 0.0], "extensions": {"EXT_lights_area": {"light": 0}}},
    ]);
    scene["scenes"] = json!([{"nodes": [0, 1, 2, 3]}]);
    scene.to_string()
}

/// A mirror on the ground below a matte ceiling, with three lamps between them: a white one, a green one, and one of
/// 5 cm radius.
pub fn mirror_under_lamps() -> String {
    let mut scene = triangle();
    scene["materials"] = json!([
        {"name": "mirror", "pbrMetallicRoughness": {"metallicFactor": 1.0, "roughnessFactor": 0.0}},
        {"name": "plaster", "pbrMetallicRoughness": {"metallicFactor": 0.0}},
    ]);
    let mut ceiling = scene["meshes"][0].clone();
    ceiling["primitives"][0]["material"] = json!(1);
    scene["meshes"][0]["primitives"][0]["material"] = json!(0);
    scene["meshes"] = json!([scene["meshes"][0], ceiling]);
    scene["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    scene["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "intensity": 683.0},
        {"type": "point", "intensity": 300.0, "color": [0.2, 1.0, 0.1]},
        {"type": "point", "intensity": 500.0, "extras": {"radius_m": 0.05}},
    ]}});
    scene["nodes"] = json!([
        {"mesh": 0, "name": "ground"},
        {"mesh": 1, "name": "ceiling", "translation": [-1.0, 1.5, -1.0], "scale": [4.0, 4.0, 4.0]},
        {"translation": [0.2, 0.7, 0.2], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"translation": [0.6, 0.6, 0.1], "extensions": {"KHR_lights_punctual": {"light": 1}}},
        {"translation": [0.3, 0.8, 0.4], "extensions": {"KHR_lights_punctual": {"light": 2}}},
    ]);
    scene["scenes"] = json!([{"nodes": [0, 1, 2, 3, 4]}]);
    scene.to_string()
}

/// A triangle of N-SF11 and one of gold, under a lamp with the spectrum of illuminant A and one without a spectrum.
pub fn glasses() -> String {
    let mut scene = triangle();
    scene["materials"] = json!([
        {"name": "flint", "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.0},
         "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1.0},
                        "KHR_materials_volume": {"thicknessFactor": 0.1}},
         "extras": {"glass": "N-SF11"}},
        {"name": "leaf", "pbrMetallicRoughness": {"roughnessFactor": 0.0}, "extras": {"metal": "gold"}},
    ]);
    let mut leaf = scene["meshes"][0].clone();
    leaf["primitives"][0]["material"] = json!(1);
    scene["meshes"][0]["primitives"][0]["material"] = json!(0);
    scene["meshes"] = json!([scene["meshes"][0], leaf]);
    scene["extensionsUsed"] = json!([
        "KHR_lights_punctual",
        "KHR_materials_transmission",
        "KHR_materials_volume"
    ]);
    scene["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "extras": {"spectrum": "A"}},
        {"type": "point"},
    ]}});
    scene["nodes"] = json!([
        {"mesh": 0, "name": "pane"},
        {"mesh": 1, "name": "leaf", "translation": [0.0, 0.5, 0.0]},
        {"translation": [0.0, 1.0, 0.0], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"translation": [0.0, 2.0, 0.0], "extensions": {"KHR_lights_punctual": {"light": 1}}},
    ]);
    scene["scenes"] = json!([{"nodes": [0, 1, 2, 3]}]);
    scene.to_string()
}

/// A Radiance image of 2 × 1 pixels of 1 W/(m² sr): 128 · 2^(129 − 136) in each channel.
pub fn grey_sky() -> Vec<u8> {
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n".to_vec();
    bytes.extend([128, 128, 128, 129].repeat(2));
    bytes
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

/// Base64 (RFC 4648) of whole triples of bytes.
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
