//! Writes materials as glTF.

use glam::DVec3;
use gltf::json::Value;
use serde_json::json;

use super::super::{substance, waves};
use crate::error::Warning;
use crate::scene::{Material, TextureRef};
use crate::units::LUMENS_PER_WATT;

/// glTF of a material. `shift` leads from scene to world coordinates [m].
pub fn written(material: &Material, shift: DVec3, warnings: &mut Vec<Warning>) -> Value {
    // The alpha of the base colour is the factor of the cut-out.
    let [red, green, blue] = material.base_colour.to_array();
    let alpha = material.alpha_mask.as_ref().map_or(1.0, |mask| mask.factor);
    let mut metallic_roughness = json!({
        "baseColorFactor": [red, green, blue, alpha],
        "metallicFactor": material.metallic,
        "roughnessFactor": material.roughness,
    });
    if let Some(texture) = &material.base_colour_texture {
        metallic_roughness["baseColorTexture"] = reference(texture);
    }
    let mut written = json!({
        "name": material.name,
        "doubleSided": material.double_sided,
        "pbrMetallicRoughness": metallic_roughness,
    });
    if let Some(mask) = &material.alpha_mask {
        written["alphaMode"] = json!("MASK");
        written["alphaCutoff"] = json!(mask.cutoff);
    }
    if let Some(map) = &material.normal_map {
        written["normalTexture"] = reference(&map.image);
        written["normalTexture"]["scale"] = json!(map.scale);
    }

    // The rest may need extensions, or `extras` where glTF has none.
    write_glow(material, &mut written);
    write_dielectric(material, &mut written);
    write_substance(material, &mut written, warnings);
    if let Some(waves) = &material.waves {
        written["extras"][waves::KEY] = waves::written(waves, shift);
    }
    written
}

fn reference(texture: &TextureRef) -> Value {
    let mut reference = json!({ "index": texture.texture, "texCoord": texture.uv_set });
    let [x, y, z] = texture.uv_transform.to_cols_array_2d();
    if texture.uv_transform != glam::DMat3::IDENTITY {
        // Rotation and scale, composed in the order of the extension.
        let (scale_u, scale_v) = (x[0].hypot(x[1]), y[0].hypot(y[1]));
        let transform = json!({ "offset": [z[0], z[1]], "rotation": -x[1].atan2(x[0]),
            "scale": [scale_u, scale_v] });
        reference["extensions"]["KHR_texture_transform"] = transform;
    }
    reference
}

fn write_glow(material: &Material, written: &mut Value) {
    let cd_per_m2 = material.emitted_radiance * LUMENS_PER_WATT;
    let most = cd_per_m2.max_channel();
    if most <= 0.0 {
        return;
    }
    written["emissiveFactor"] = json!((cd_per_m2 / most).to_array());
    written["extensions"]["KHR_materials_emissive_strength"] = json!({ "emissiveStrength": most });
}

fn write_dielectric(material: &Material, written: &mut Value) {
    let mut extend = |name: &str, value| written["extensions"][name] = value;
    extend("KHR_materials_ior", json!({ "ior": material.ior }));
    if material.transmission > 0.0 {
        extend(
            "KHR_materials_transmission",
            json!({ "transmissionFactor": material.transmission }),
        );
    }
    if let Some(volume) = &material.volume {
        let mut stated = json!({ "thicknessFactor": 1.0,
            "attenuationColor": volume.attenuation_colour.to_array() });
        if volume.attenuation_distance_m.is_finite() {
            stated["attenuationDistance"] = json!(volume.attenuation_distance_m);
        }
        extend("KHR_materials_volume", stated);
    }
    if material.coat != 1.0 && material.metallic < 0.5 {
        extend(
            "KHR_materials_specular",
            json!({ "specularFactor": material.coat }),
        );
    }
}

fn write_substance(material: &Material, written: &mut Value, warnings: &mut Vec<Warning>) {
    if let Some(metal) = material.metal {
        written["extras"][substance::METAL_KEY] = json!(metal.name());
    }
    let Some(glass) = material.glass.as_deref() else {
        return;
    };
    match substance::stated(glass) {
        Some(substance::GlassStatement::Name(name)) => written["extras"][substance::GLASS_KEY] = json!(name),
        Some(substance::GlassStatement::Dispersion(dispersion)) => {
            written["extensions"][substance::NAME] = json!({ "dispersion": dispersion });
        }
        Some(substance::GlassStatement::Nothing) => {}
        None => warnings.push(Warning::new(
            format!("material `{}`", material.name),
            format!(
                "is of glass `{}`, whose dispersion a file cannot state",
                glass.name
            ),
            "choose a glass by its name",
        )),
    }
}
