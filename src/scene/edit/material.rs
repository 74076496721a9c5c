//! Edits of materials.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::out_of_range;
use crate::error::Result;
use crate::optics::glass::{Dispersion, Glass};
use crate::optics::{LinearSrgb, Metal};
use crate::scene::{Material, Waves};

/// One property of a material; the surface class is derived from it as on loading.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum MaterialEdit {
    /// Refractive index, at least 1; a glass keeps its Abbe number.
    Ior(f64),
    /// The substance: glass, or metal.
    Substance {
        /// At least 1: that of the glass at 587.56 nm.
        ior: f64,
        /// `None` for the same index at all wavelengths.
        glass: Option<Arc<Glass>>,
        /// Each channel in [0, 1].
        base_colour: LinearSrgb,
        /// `None` unless it is a tabulated metal.
        #[serde(serialize_with = "Metal::write_name", deserialize_with = "Metal::read_name")]
        metal: Option<&'static Metal>,
    },
    /// Tint of glass or albedo of a diffuse surface, each channel in [0, 1]; replaces a tabulated metal.
    BaseColour(LinearSrgb),
    /// [0, 1].
    Roughness(f64),
    /// Waves that perturb its normals, if any.
    Waves(Option<Waves>),
}

impl MaterialEdit {
    /// Names for the log and for people.
    pub(super) fn names(&self) -> [&'static str; 2] {
        match self {
            Self::Ior(_) => ["MaterialIor", "refractive index"],
            Self::Substance { .. } => ["MaterialSubstance", "substance"],
            Self::BaseColour(_) => ["MaterialTint", "base colour"],
            Self::Roughness(_) => ["MaterialRoughness", "roughness"],
            Self::Waves(_) => ["MaterialWaves", "waves"],
        }
    }

    /// Edits a material and updates its class, if that was derived from the factors.
    pub(super) fn apply(&self, material: &mut Material) -> Result<()> {
        let owner = format!("material `{}`", material.name);
        // A class that the file sets by other means (unlit) is left alone.
        let follows = material.surface == material.classified();

        // Every value is checked before it is set, so that a refused edit changes nothing.
        match self {
            Self::Ior(ior) => {
                check_index(*ior, &owner)?;
                let glass = material
                    .glass
                    .as_deref()
                    .map(|glass| Arc::new(of_index(glass, *ior)));
                (material.ior, material.glass) = (*ior, glass);
            }
            Self::BaseColour(base_colour) => {
                check_colour(*base_colour, &owner)?;
                (material.base_colour, material.metal) = (*base_colour, None);
            }
            Self::Substance {
                ior,
                glass,
                base_colour,
                metal,
            } => {
                check_index(*ior, &owner)?;
                check_colour(*base_colour, &owner)?;
                (material.ior, material.glass) = (*ior, glass.clone());
                (material.base_colour, material.metal) = (*base_colour, *metal);
            }
            Self::Roughness(roughness) => {
                if !(0.0..=1.0).contains(roughness) {
                    return Err(out_of_range(&owner, "roughness", roughness, "0 to 1"));
                }
                material.roughness = *roughness;
            }
            Self::Waves(waves) => material.waves.clone_from(waves),
        }
        if follows {
            material.surface = material.classified();
        }
        Ok(())
    }

    /// Edits that turn `was` into `is`.
    pub(in crate::scene) fn diff(was: &Material, is: &Material) -> Vec<Self> {
        let mut edits = Vec::new();
        let is_same_substance = was.ior == is.ior
            && was.glass.as_deref() == is.glass.as_deref()
            && was.base_colour == is.base_colour
            && was.metal == is.metal;
        if !is_same_substance {
            edits.push(Self::Substance {
                ior: is.ior,
                glass: is.glass.clone(),
                base_colour: is.base_colour,
                metal: is.metal,
            });
        }
        if was.roughness != is.roughness {
            edits.push(Self::Roughness(is.roughness));
        }
        if was.waves != is.waves {
            edits.push(Self::Waves(is.waves.clone()));
        }
        edits
    }
}

/// A glass with another index at 587.56 nm and the same Abbe number.
fn of_index(glass: &Glass, n_d: f64) -> Glass {
    let v_d = match glass.dispersion {
        // The formula of the Abbe number is undefined where n_d is 1.
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
