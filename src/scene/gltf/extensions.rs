//! Which glTF extensions are read, which are ignored, and which stop the loading.

use super::report::Report;
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

/// Extensions that are ignored with a warning even if the file requires them: the scene is the same without them.
const LEFT_OUT: [&str; 5] = [
    "KHR_animation_pointer",
    "KHR_materials_anisotropy",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_xmp_json_ld",
];

/// Refuses a file that requires an unsupported extension, and warns of used ones that are ignored.
///
/// # Errors
/// A required extension without which the scene cannot be read.
pub fn check(required: &[String], used: &[String], report: &mut Report) -> Result<()> {
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
            report.warn(
                "extensionsRequired",
                format!("{} is required but not among the used ones", printable(extension)),
                "export the file again",
            );
        }
    }
    for (index, extension) in used.iter().enumerate() {
        if used[..index].contains(extension) {
            report.warn(
                "extensionsUsed",
                format!("{} is listed twice", printable(extension)),
                "export the file again",
            );
        } else if !READ.contains(&extension.as_str()) && !is_named_by_materials(extension) {
            report.warn(
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
    super::names::name(Some(&name.to_owned()), "extension", 0)
}
