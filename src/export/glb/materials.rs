//! Materials that carry a map.

use serde_json::{Value, json};

use super::{Carrier, GlbOptions, SceneLights};
use crate::scene::Glb;

const LIGHT_MAP: &str = "MOZ_lightmap";
const STRENGTH: &str = "KHR_materials_emissive_strength";
const UNLIT: &str = "KHR_materials_unlit";

/// What a material is given.
pub struct Carried {
    /// Reference to the texture of the light.
    pub texture: Value,
    /// The value of its white, in the export's unit.
    pub intensity: f64,
    /// How it is carried.
    pub options: GlbOptions,
}

/// Gives a primitive a material of its own that carries a map. Colours and textures of the one that it had stay.
pub fn give(glb: &mut Glb, place: (usize, usize), carried: &Carried) {
    let index = glb.primitive(place)["material"].as_u64();
    let mut material = index.map_or(json!({}), |index| glb.json["materials"][index as usize].clone());
    if let Some(name) = material["name"].as_str() {
        material["name"] = json!(format!("{name}, lit"));
    }
    match carried.options.carrier {
        Carrier::LightMap => {
            let mut light = carried.texture.clone();
            light["intensity"] = json!(carried.intensity);
            material["extensions"][LIGHT_MAP] = light;
            glb.use_extension(LIGHT_MAP);
        }
        Carrier::Emissive => {
            material["emissiveTexture"] = carried.texture.clone();
            material["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
            material["extensions"][STRENGTH] = json!({ "emissiveStrength": carried.intensity });
            glb.use_extension(STRENGTH);
            if carried.options.lights == SceneLights::Remove {
                // Any light that a program adds would be light twice.
                material["pbrMetallicRoughness"] = json!({ "baseColorFactor": [0.0, 0.0, 0.0, 1.0],
                    "metallicFactor": 0.0, "roughnessFactor": 1.0 });
            }
        }
        Carrier::Unlit => {
            material["pbrMetallicRoughness"] = json!({ "baseColorTexture": carried.texture,
                "metallicFactor": 0.0, "roughnessFactor": 1.0 });
            material["extensions"] = json!({ UNLIT: {} });
            glb.use_extension(UNLIT);
        }
    }
    let material = glb.push("materials", material);
    glb.primitive(place)["material"] = json!(material);
}
