//! Scene files made in memory.

use std::f64::consts::FRAC_1_SQRT_2;

use crate::prelude::*;

/// A horizontal triangle with legs of 1 m, without lights.
pub fn dark_triangle() -> Vec<u8> {
    with_triangle(Glb::empty(), json!({ "name": "floor" }), json!({})).bytes()
}

/// The same triangle under a sun of 683 lx = 1 W/m²; nothing is specular.
pub fn lit_matte_triangle() -> Vec<u8> {
    let file = with_triangle(Glb::empty(), json!({ "name": "floor" }), json!({}));
    let mut file = file.with_light("sun", json!({ "type": "directional", "intensity": 683.0 }));
    // Rotated so that its −z axis points down.
    file.json["nodes"][1]["rotation"] = json!([-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2]);
    file.bytes()
}

/// A point light of 5 cm radius, a sun of 0.53°, a panel of 0.5 m², and the floor as an emitter; the last two emit 1
/// W/(m² sr).
pub fn lamps_with_extent() -> Vec<u8> {
    let glow = json!({ "emissiveFactor": [1.0, 1.0, 1.0],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 683.0 } } });
    let file = with_triangle(Glb::empty(), json!({ "name": "floor" }), glow);
    let ball = json!({ "type": "point", "extras": { "radius_m": 0.05 } });
    let sun = json!({ "type": "directional", "extras": { "angular_diameter_deg": 0.53 } });
    let mut file = file.with_light_at("lamp", ball, [0.0, 1.0, 0.0]).with_light("sun", sun);
    file.json["extensions"]["EXT_lights_area"] = json!({ "lights": [
        { "type": "rect", "intensity": 683.0, "size": 0.5, "rect": { "aspect": 2.0 } },
    ] });
    let panel = json!({ "EXT_lights_area": { "light": 0 } });
    file.push_root(json!({ "translation": [0.0, 2.0, 0.0], "extensions": panel }));
    file.bytes()
}

/// A mirror on the ground below a matte ceiling, with three lamps between them: a white one, a green one, and one of
/// 5 cm radius.
pub fn mirror_under_lamps() -> Vec<u8> {
    let mirror = json!({ "pbrMetallicRoughness": { "metallicFactor": 1.0, "roughnessFactor": 0.0 } });
    let plaster = json!({ "doubleSided": true, "pbrMetallicRoughness": { "metallicFactor": 0.0 } });
    let ceiling = json!({ "name": "ceiling", "translation": [-1.0, 1.5, -1.0], "scale": [4.0, 4.0, 4.0] });
    let file = with_triangle(Glb::empty(), json!({ "name": "ground" }), mirror);
    let file = with_triangle(file, ceiling, plaster);
    let file = file.with_light_at("lamp", json!({ "type": "point", "intensity": 683.0 }), [0.2, 0.7, 0.2]);
    let green = json!({ "type": "point", "intensity": 300.0, "color": [0.2, 1.0, 0.1] });
    let ball = json!({ "type": "point", "intensity": 500.0, "extras": { "radius_m": 0.05 } });
    file.with_light_at("lamp", green, [0.6, 0.6, 0.1])
        .with_light_at("lamp", ball, [0.3, 0.8, 0.4])
        .bytes()
}

/// A triangle of N-SF11 and one of gold, under a lamp with a spectrum and one without.
pub fn glasses(spectrum: &str) -> Vec<u8> {
    let flint = json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.0 },
        "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1.0 },
                        "KHR_materials_volume": { "thicknessFactor": 0.1 } },
        "extras": { "glass": "N-SF11" } });
    let gold = json!({ "pbrMetallicRoughness": { "roughnessFactor": 0.0 }, "extras": { "metal": "gold" } });
    let file = with_triangle(Glb::empty(), json!({ "name": "pane" }), flint);
    let file = with_triangle(file, json!({ "name": "leaf", "translation": [0.0, 0.5, 0.0] }), gold);
    let coloured = json!({ "type": "point", "extras": { "spectrum": spectrum } });
    let file = file.with_light_at("lamp", coloured, [0.0, 1.0, 0.0]);
    file.with_light_at("lamp", json!({ "type": "point" }), [0.0, 2.0, 0.0]).bytes()
}

/// A Radiance image of 2 × 1 pixels of 1 W/(m² sr): 128 · 2^(129 − 136) in each channel.
pub fn grey_sky() -> Vec<u8> {
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n".to_vec();
    bytes.extend([128, 128, 128, 129].repeat(2));
    bytes
}

/// With a horizontal triangle on a node.
fn with_triangle(mut file: Glb, mut node: Value, material: Value) -> Glb {
    let positions = file.push_floats(&[0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0], 3);
    let material = file.push("materials", material);
    let attributes = json!({ "POSITION": positions });
    node["mesh"] = json!(file.push_mesh(json!({ "attributes": attributes, "material": material })));
    file.push_root(node);
    file
}
