//! Glasses: refractive index by wavelength, from a catalogue name, a glass number or a formula.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use super::Nanometres;
use crate::error::{Error, Result, Warning};

pub mod catalogue;
pub mod dispersion;

pub use dispersion::Dispersion;

/// A transparent material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Glass {
    /// Name in the catalogue, or the text that specified it.
    pub name: String,
    /// Refractive index by wavelength.
    pub dispersion: Dispersion,
    /// Wavelengths that the formula was fitted to; it is extrapolated outside of them. `None` if unknown.
    pub range: Option<RangeInclusive<Nanometres>>,
    /// Source of the measurement; empty for formulas of the user.
    pub source: String,
}

impl Glass {
    /// A glass by its index at 587.56 nm and its Abbe number; an infinite one means no dispersion.
    pub fn with_abbe_number(n_d: f64, v_d: f64) -> Self {
        Self {
            name: format!("abbe:{n_d:.4},{v_d:.2}"),
            dispersion: Dispersion::from_gltf(n_d, 20.0 / v_d),
            range: None,
            source: String::new(),
        }
    }

    /// Whether the formula was fitted to a wavelength; true where the range is unknown.
    pub fn is_within(&self, wavelength: Nanometres) -> bool {
        self.range
            .as_ref()
            .is_none_or(|range| range.contains(&wavelength))
    }

    /// Warnings for the user before light of a range of wavelengths is traced through it: the formula is used beyond
    /// its fitted range, or falls below 1, where 1 is used.
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
                "choose another lamp or glass if the ends of the spectrum matter",
            )
        });
        let below = self.dispersion.falls_below_one(light).then(|| {
            Warning::new(
                location,
                format!(
                    "the index of {} falls below 1 and was raised to 1 there",
                    self.name
                ),
                "check the constants of its formula",
            )
        });
        beyond.into_iter().chain(below).collect()
    }
}

/// Remedy for constants that are no numbers.
const FINITE: &str = "give finite numbers between commas";

fn refused(what: String, remedy: &str) -> Error {
    Error::usage("glass", what, remedy)
}

/// Constants of each formula, for messages.
const ABBE: &str = "n_d and V_d";
const CAUCHY: &str = "A, B and perhaps C, in µm";
const SELLMEIER: &str = "B1, B2, B3, C1, C2 and C3, in µm²";
const HERZBERGER: &str = "A, B, C and D, in µm";

impl Glass {
    /// Parses a glass number of six digits, a name of the [`catalogue`], or a formula for wavelengths in µm:
    /// `abbe:1.523,58.8`, `cauchy:A,B[,C]`, `sellmeier:B1,B2,B3,C1,C2,C3`, `herzberger:A,B,C,D`.
    ///
    /// # Errors
    /// What is wrong, with the most similar names for an unknown one.
    pub fn parse(text: &str) -> Result<Self> {
        let text = text.trim();
        if let Some((formula, constants)) = text.split_once(':') {
            return Ok(Self::of_user(text, by_formula(formula.trim(), constants.trim())?));
        }
        if !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit()) {
            return Ok(Self::of_user(text, parse(text)?));
        }
        catalogue::find(text)
    }

    fn of_user(text: &str, dispersion: Dispersion) -> Self {
        Self {
            name: text.into(),
            dispersion,
            range: None,
            source: String::new(),
        }
    }
}

fn by_formula(formula: &str, text: &str) -> Result<Dispersion> {
    let constants: Option<Vec<f64>> = text.split(',').map(|field| field.trim().parse().ok()).collect();
    let constants = constants.unwrap_or_default();
    let wrong = |formula: &str, takes: &str| {
        let what = format!("`{text}` are not constants for {formula}, which takes {takes}");
        refused(what, FINITE)
    };
    let dispersion = match (formula.to_ascii_lowercase().as_str(), constants.as_slice()) {
        ("abbe", &[n_d, v_d]) => Dispersion::Abbe { n_d, v_d },
        ("abbe", _) => return Err(wrong("abbe", ABBE)),
        ("cauchy", &[a, b]) => Dispersion::Cauchy { a, b, c: 0.0, d: 0.0 },
        ("cauchy", &[a, b, c]) => Dispersion::Cauchy { a, b, c, d: 0.0 },
        ("cauchy", _) => return Err(wrong("cauchy", CAUCHY)),
        ("sellmeier", &[b1, b2, b3, c1, c2, c3]) => Dispersion::Sellmeier {
            constant: 0.0,
            b: [b1, b2, b3, 0.0],
            c_um2: [c1, c2, c3, 0.0],
        },
        ("sellmeier", _) => return Err(wrong("sellmeier", SELLMEIER)),
        ("herzberger", &[a, b, c, d]) => Dispersion::Herzberger { a, b, c, d },
        ("herzberger", _) => return Err(wrong("herzberger", HERZBERGER)),
        _ => {
            let what = format!("no formula is named `{formula}`");
            return Err(refused(what, "choose abbe, cauchy, sellmeier or herzberger"));
        }
    };
    dispersion.checked()
}

/// Dispersion of a glass number: 523588 means n_d = 1.523 and V_d = 58.8.
///
/// # Errors
/// Anything but six digits; an Abbe number of 000.
pub fn parse(text: &str) -> Result<Dispersion> {
    let wrong = || {
        let what = format!("`{text}` is not a glass number of six digits");
        refused(
            what,
            "write n_d - 1 and V_d in three digits each, as 517642 for N-BK7",
        )
    };
    if text.len() != 6 || !text.bytes().all(|byte| byte.is_ascii_digit()) {
        return Err(wrong());
    }
    let three = |digits: &str| digits.parse::<u16>().map(f64::from).map_err(|_| wrong());
    let (n_d, v_d) = ((1000.0 + three(&text[..3])?) / 1000.0, three(&text[3..])? / 10.0);
    Dispersion::Abbe { n_d, v_d }.checked().map_err(|_| wrong())
}
