//! Which glTF extensions are read, which are ignored, and which stop the loading.

use gltf::json::Value;

use super::context::LoadContext;
use super::{draco, glossiness, instancing, meshopt, nodes};
use crate::error::{Error, Result};

/// Extension with alternative sets of materials.
pub const VARIANTS: &str = "KHR_materials_variants";

/// Extensions that are read in full, or in part with a warning.
const READ: [&str; 21] = [
    "EXT_lights_area",
    instancing::NAME,
    meshopt::NAMES[0],
    "EXT_texture_webp",
    draco::NAME,
    "KHR_lights_punctual",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    glossiness::NAME,
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    VARIANTS,
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    meshopt::NAMES[1],
    nodes::VISIBILITY,
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// Extensions that are ignored with a warning even if the file requires them: only what they add is missed.
const LEFT_OUT: [&str; 5] = [
    "KHR_animation_pointer",
    "KHR_materials_anisotropy",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_xmp_json_ld",
];

/// Extensions of materials that are left out: the factor without which they do nothing, and what is missed.
const OF_MATERIALS: [(&str, &str, &str); 3] = [
    (
        "KHR_materials_anisotropy",
        "anisotropyStrength",
        "expect round highlights instead of stretched ones",
    ),
    (
        "KHR_materials_iridescence",
        "iridescenceFactor",
        "expect reflections without the colours of a thin film",
    ),
    (
        "KHR_materials_sheen",
        "sheenColorFactor",
        "expect cloth that does not shine at grazing angles",
    ),
];

/// What a material misses without an extension that is not read; `None` where that does nothing.
pub fn loss(extension: &str, stated: &Value) -> Option<&'static str> {
    let known = OF_MATERIALS.iter().find(|(name, ..)| *name == extension);
    let Some((_, factor, loss)) = known else {
        return Some("expect it to look and bake as if it were not there");
    };
    let factor = stated.get(factor).unwrap_or(&Value::Null);
    let channels = factor
        .as_array()
        .map_or(std::slice::from_ref(factor), Vec::as_slice);
    let is_on = channels
        .iter()
        .any(|channel| channel.as_f64().is_some_and(|channel| channel != 0.0));
    is_on.then_some(loss)
}

/// Refuses a file that requires an unsupported extension, and warns of used ones that are ignored.
///
/// # Errors
/// A required extension without which the scene cannot be read.
pub fn check(required: &[String], used: &[String], load: &mut LoadContext) -> Result<()> {
    // A file is refused if it requires what is neither read nor can be left out.
    for extension in required {
        if !READ.contains(&extension.as_str()) && !LEFT_OUT.contains(&extension.as_str()) {
            return Err(Error::failure(
                "extensionsRequired",
                format!(
                    "the file requires {}, which is not supported",
                    printable(extension)
                ),
                remedy(extension),
            ));
        }
        if !used.contains(extension) {
            load.warn_damaged(
                "extensionsRequired",
                format!("{} is required but not among the used ones", printable(extension)),
            );
        }
    }

    // Extensions of materials are left to these, which know whether they miss anything.
    for (index, extension) in used.iter().enumerate() {
        if used[..index].contains(extension) {
            load.warn_damaged(
                "extensionsUsed",
                format!("{} is listed twice", printable(extension)),
            );
        } else if !READ.contains(&extension.as_str()) && !is_named_by_materials(extension) {
            load.warn(
                "extensionsUsed",
                format!("{} is not supported and was ignored", printable(extension)),
                "expect the scene to look and bake as if it were not there",
            );
        }
    }
    Ok(())
}

/// Materials warn of their own ignored extensions.
fn is_named_by_materials(extension: &str) -> bool {
    extension.starts_with("KHR_materials_")
}

fn remedy(extension: &str) -> &'static str {
    match extension {
        "EXT_texture_avif" => "export it with PNG or JPEG images",
        _ => "export it without this extension",
    }
}

fn printable(name: &str) -> String {
    super::extras::name(Some(name), "extension", 0)
}
