//! Edits of materials.

use std::sync::Arc;

use super::Edit;
use super::out_of_range;
use crate::error::{Error, Result};
use crate::optics::LinearSrgb;
use crate::optics::glass::{Dispersion, Glass};
use crate::scene::Material;

/// Edits a material; its class follows where it did before.
pub(super) fn apply(edit: &Edit, material: &mut Material) -> Result<()> {
    let owner = format!("material `{}`", material.name);
    // A class that a file sets otherwise (unlit) is not ours to change.
    let follows = material.surface == material.classified();
    match edit {
        Edit::MaterialIor { ior, .. } => {
            check_index(*ior, &owner)?;
            let glass = material
                .glass
                .as_deref()
                .map(|glass| Arc::new(of_index(glass, *ior)));
            (material.ior, material.glass) = (*ior, glass);
        }
        Edit::MaterialTint { base_colour, .. } => {
            check_colour(*base_colour, &owner)?;
            (material.base_colour, material.metal) = (*base_colour, None);
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
            (material.ior, material.glass) = (*ior, glass.clone());
            (material.base_colour, material.metal) = (*base_colour, *metal);
        }
        Edit::MaterialRoughness { roughness, .. } => {
            if !(0.0..=1.0).contains(roughness) {
                return Err(out_of_range(&owner, "roughness", roughness, "0 to 1"));
            }
            material.roughness = *roughness;
        }
        Edit::MaterialWaves { waves, .. } => material.waves.clone_from(waves),
        _ => {
            return Err(Error::usage(owner, "has no such property", "edit what it has"));
        }
    }
    if follows {
        material.surface = material.classified();
    }
    Ok(())
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
