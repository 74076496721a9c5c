//! Glasses: how fast light of each wavelength goes in them, by number, name or formula.

pub mod catalogue;
pub mod dispersion;
pub mod error;
pub mod number;
mod text;

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use super::Nanometres;
use crate::error::Warning;

pub use dispersion::Dispersion;
pub use error::GlassError;

/// A transparent material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Glass {
    /// Its name in the catalogue, or what it was asked for by.
    pub name: String,
    /// Refractive index by wavelength.
    pub dispersion: Dispersion,
    /// Wavelengths that the formula was fitted to; outside of them it is continued. `None` where nobody said.
    pub range: Option<RangeInclusive<Nanometres>>,
    /// Who measured it; empty where the user did.
    pub source: String,
}

impl Glass {
    /// A glass by its index at 587.56 nm and its Abbe number; none that disperses where that is infinite.
    pub fn with_abbe_number(n_d: f64, v_d: f64) -> Self {
        Self {
            name: format!("abbe:{n_d:.4},{v_d:.2}"),
            dispersion: Dispersion::from_gltf(n_d, 20.0 / v_d),
            range: None,
            source: String::new(),
        }
    }

    /// Whether the formula was fitted to a wavelength; any wavelength will do where nobody said.
    pub fn is_within(&self, wavelength: Nanometres) -> bool {
        self.range
            .as_ref()
            .is_none_or(|range| range.contains(&wavelength))
    }

    /// What to tell the user before light of a range of wavelengths is traced through it: that the formula is used
    /// beyond the range it was fitted to, or that it falls below 1, where 1 is taken.
    pub fn warnings(&self, light: &RangeInclusive<Nanometres>, location: &str) -> Vec<Warning> {
        let (Nanometres(first), Nanometres(last)) = (*light.start(), *light.end());
        let beyond = self
            .range
            .as_ref()
            .filter(|range| range.start().0 > first || range.end().0 < last);
        let beyond = beyond.map(|range| {
            let (Nanometres(from), Nanometres(to)) = (*range.start(), *range.end());
            Warning::new(
                location,
                format!(
                    "the index of {} was measured from {from:.0} to {to:.0} nm and is used from {first:.0} to \
                     {last:.0} nm",
                    self.name
                ),
                "choose a lamp or a glass of other wavelengths if its ends matter",
            )
        });
        let below = self.dispersion.falls_below_one(light).then(|| {
            Warning::new(
                location,
                format!("the index of {} falls below 1, and 1 is taken there", self.name),
                "check the constants of its formula",
            )
        });
        beyond.into_iter().chain(below).collect()
    }
}
