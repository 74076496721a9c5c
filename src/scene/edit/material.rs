//! Edits of materials.

use std::mem::replace;
use std::sync::Arc;

use super::Edit;
use super::ranges::out_of_range;
use crate::error::{Error, Result};
use crate::optics::LinearSrgb;
use crate::optics::glass::{Dispersion, Glass};
use crate::scene::Material;

/// Edits a material, and gives the edit that undoes this one.
pub(super) fn apply(edit: &Edit, index: usize, material: &mut Material) -> Result<Edit> {
    let owner = format!("material `{}`", material.name);
    // A class that a file sets otherwise (unlit) is not ours to change.
    let follows = material.surface == material.classified();
    let inverse = match edit {
        Edit::MaterialIor { ior, .. } => {
            check_index(*ior, &owner)?;
            let glass = material
                .glass
                .as_deref()
                .map(|glass| Arc::new(of_index(glass, *ior)));
            let inverse = match glass {
                Some(_) => substance(index, material),
                None => Edit::MaterialIor {
                    material: index,
                    ior: material.ior,
                },
            };
            (material.ior, material.glass) = (*ior, glass);
            inverse
        }
        Edit::MaterialTint { base_colour, .. } => {
            check_colour(*base_colour, &owner)?;
            let inverse = match material.metal {
                Some(_) => substance(index, material),
                None => Edit::MaterialTint {
                    material: index,
                    base_colour: material.base_colour,
                },
            };
            (material.base_colour, material.metal) = (*base_colour, None);
            inverse
        }
        Edit::MaterialSubstance {
            ior,
            glass,
            base_colour,
            metal,
            ..
        } => {
            check_index(*ior, &owner)?;
            check_colour(*base_colour, &owner)?;
            let inverse = substance(index, material);
            (material.ior, material.glass) = (*ior, glass.clone());
            (material.base_colour, material.metal) = (*base_colour, *metal);
            inverse
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

/// What a material is made of, as the edit that makes it so.
fn substance(index: usize, material: &Material) -> Edit {
    Edit::MaterialSubstance {
        material: index,
        ior: material.ior,
        glass: material.glass.clone(),
        base_colour: material.base_colour,
        metal: material.metal,
    }
}

/// A glass of another index at 587.56 nm and the same Abbe number.
fn of_index(glass: &Glass, n_d: f64) -> Glass {
    let v_d = match glass.dispersion {
        // What the formula gives says nothing where n_d is 1.
        Dispersion::Abbe { v_d, .. } => v_d,
        other => other.abbe_number(),
    };
    Glass::with_abbe_number(n_d, v_d)
}

fn check_index(ior: f64, owner: &str) -> Result<()> {
    if ior >= 1.0 && ior.is_finite() {
        return Ok(());
    }
    Err(out_of_range(owner, "refractive index", ior, "1 up"))
}

fn check_colour(colour: LinearSrgb, owner: &str) -> Result<()> {
    let channels = colour.to_array();
    if channels.iter().all(|channel| (0.0..=1.0).contains(channel)) {
        return Ok(());
    }
    Err(out_of_range(
        owner,
        "base colour",
        format!("{channels:?}"),
        "0 to 1",
    ))
}
