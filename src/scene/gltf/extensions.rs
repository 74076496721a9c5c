//! Which glTF extensions are read, which are ignored, and which stop the loading.

use super::report::Report;
use super::{draco, glossiness, instancing, meshopt, nodes};
use crate::error::{Error, Result};

/// Name of an extension that gives a scene several sets of materials.
pub const VARIANTS: &str = "KHR_materials_variants";

/// Read in full, or in the parts that say so in a warning.
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

/// Passed over with a warning even where the file requires them: what is left is still the same scene.
const LEFT_OUT: [&str; 5] = [
    "KHR_animation_pointer",
    "KHR_materials_anisotropy",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_xmp_json_ld",
];

/// Refuses a file that requires what is not supported, and names what it uses and is left out.
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

/// Materials say themselves what they leave out.
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
