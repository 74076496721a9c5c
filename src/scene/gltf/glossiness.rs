//! KHR_materials_pbrSpecularGlossiness, converted to metallic-roughness.

use gltf::json::Value;
use serde::Deserialize;
use serde_json::{Map, json};

use super::context::LoadContext;

pub const NAME: &str = "KHR_materials_pbrSpecularGlossiness";

/// Reflectance of dielectrics at normal incidence.
const F0: f64 = 0.04;

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct SpecularGlossiness {
    diffuse_factor: [f64; 4],
    diffuse_texture: Value,
    specular_factor: [f64; 3],
    glossiness_factor: f64,
    specular_glossiness_texture: Value,
}

impl Default for SpecularGlossiness {
    fn default() -> Self {
        Self {
            diffuse_factor: [1.0; 4],
            diffuse_texture: Value::Null,
            specular_factor: [1.0; 3],
            glossiness_factor: 1.0,
            specular_glossiness_texture: Value::Null,
        }
    }
}

/// Converts a material that is stated in this way only to metallic-roughness.
pub fn convert(material: &mut Map<String, Value>, owner: &str, load: &mut LoadContext) {
    // A material that states metallic-roughness as well is read by that.
    let own = material.get("pbrMetallicRoughness").and_then(Value::as_object);
    if own.is_some_and(|own| !own.is_empty()) {
        return;
    }
    let extensions = material.get_mut("extensions").and_then(Value::as_object_mut);
    let Some(stated) = extensions.and_then(|extensions| extensions.remove(NAME)) else {
        return;
    };
    let Ok(stated) = SpecularGlossiness::deserialize(stated) else {
        load.warn_damaged(owner, "its specular-glossiness cannot be read");
        return;
    };
    let [red, green, blue, alpha] = stated.diffuse_factor;
    let diffuse = [red, green, blue];
    let specular = stated.specular_factor;
    // With a specular-glossiness texture the factors do not reveal metals; most such materials are dielectrics.
    let has_only_factors = stated.specular_glossiness_texture.is_null();
    let metallic = if has_only_factors {
        metallic(diffuse, specular)
    } else {
        0.0
    };

    // Dielectrics have the diffuse colour, metals the specular one; the square of metallic blends both, as in the
    // reference converter of the extension.
    let base = |channel: usize| {
        let left = (1.0 - F0) * (1.0 - metallic).max(1e-3);
        let of_diffuse = diffuse[channel] * (1.0 - strongest(specular)) / left;
        let of_specular = (specular[channel] - F0 * (1.0 - metallic)) / metallic.max(1e-3);
        let share = metallic * metallic;
        (of_diffuse * (1.0 - share) + of_specular * share).clamp(0.0, 1.0)
    };

    // A diffuse texture is the base colour of a dielectric already, and its factor stays with it.
    let colour = match stated.diffuse_texture.is_null() && has_only_factors {
        true => [base(0), base(1), base(2)],
        false => diffuse,
    };
    let roughness = (1.0 - stated.glossiness_factor).clamp(0.0, 1.0);
    let mut converted = json!({
        "baseColorFactor": [colour[0], colour[1], colour[2], alpha],
        "metallicFactor": metallic,
        "roughnessFactor": roughness,
    });
    if !stated.diffuse_texture.is_null() {
        converted["baseColorTexture"] = stated.diffuse_texture;
    }
    material.insert("pbrMetallicRoughness".into(), converted);
    if !has_only_factors {
        load.warn(
            owner,
            "its specular-glossiness was read without its texture, with the same roughness everywhere",
            "convert it with `gltf-transform metalrough`",
        );
    }
}

fn strongest(colour: [f64; 3]) -> f64 {
    colour.into_iter().fold(0.0, f64::max)
}

/// Metallic factor for given diffuse and specular colours: root of a quadratic equation derived in the extension's
/// specification.
fn metallic(diffuse: [f64; 3], specular: [f64; 3]) -> f64 {
    let brightness = |[r, g, b]: [f64; 3]| (0.299 * r * r + 0.587 * g * g + 0.114 * b * b).sqrt();
    let (diffuse, mirrored) = (brightness(diffuse), brightness(specular));
    if mirrored <= F0 {
        return 0.0;
    }
    let b = diffuse * (1.0 - strongest(specular)) / (1.0 - F0) + mirrored - 2.0 * F0;
    let discriminant = (b * b - 4.0 * F0 * (F0 - mirrored)).max(0.0);
    ((discriminant.sqrt() - b) / (2.0 * F0)).clamp(0.0, 1.0)
}
