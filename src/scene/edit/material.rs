//! Edits of materials.

use std::mem::replace;

use super::Edit;
use super::ranges::out_of_range;
use crate::error::{Error, Result};
use crate::scene::Material;

/// Edits a material, and gives the edit that undoes this one.
pub(super) fn apply(edit: &Edit, index: usize, material: &mut Material) -> Result<Edit> {
    let owner = format!("material `{}`", material.name);
    // A class that a file sets otherwise (unlit) is not ours to change.
    let follows = material.surface == material.classified();
    let inverse = match edit {
        Edit::MaterialIor { ior, .. } => {
            if !(*ior >= 1.0 && ior.is_finite()) {
                return Err(out_of_range(&owner, "refractive index", ior, "1 up"));
            }
            Edit::MaterialIor {
                material: index,
                ior: replace(&mut material.ior, *ior),
            }
        }
        Edit::MaterialTint { base_colour, .. } => {
            let channels = base_colour.to_array();
            if !channels.iter().all(|channel| (0.0..=1.0).contains(channel)) {
                let value = format!("{channels:?}");
                return Err(out_of_range(&owner, "base colour", value, "0 to 1"));
            }
            Edit::MaterialTint {
                material: index,
                base_colour: replace(&mut material.base_colour, *base_colour),
            }
        }
        Edit::MaterialRoughness { roughness, .. } => {
            if !(0.0..=1.0).contains(roughness) {
                return Err(out_of_range(&owner, "roughness", roughness, "0 to 1"));
            }
            Edit::MaterialRoughness {
                material: index,
                roughness: replace(&mut material.roughness, *roughness),
            }
        }
        Edit::MaterialWaves { waves, .. } => Edit::MaterialWaves {
            material: index,
            waves: replace(&mut material.waves, waves.clone()),
        },
        _ => {
            return Err(Error::usage(owner, "has no such property", "edit what it has"));
        }
    };
    if follows {
        material.surface = material.classified();
    }
    Ok(inverse)
}
