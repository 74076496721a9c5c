//! A glass as people type it: a number, a name or a formula with its constants.

use super::{Dispersion, Glass, GlassError, catalogue, number};

/// What each formula takes.
const ABBE: &str = "n_d and V_d";
const CAUCHY: &str = "A, B and perhaps C, in µm";
const SELLMEIER: &str = "B1, B2, B3, C1, C2 and C3, in µm²";
const HERZBERGER: &str = "A, B, C and D, in µm";

impl Glass {
    /// A glass by its number of six digits, its name in the [`catalogue`], or a formula for wavelengths in µm:
    /// `abbe:1.523,58.8`, `cauchy:A,B[,C]`, `sellmeier:B1,B2,B3,C1,C2,C3`, `herzberger:A,B,C,D`.
    ///
    /// # Errors
    /// [`GlassError`], with the nearest names for one that is unknown.
    pub fn parse(text: &str) -> Result<Self, GlassError> {
        let text = text.trim();
        if let Some((formula, constants)) = text.split_once(':') {
            return Ok(Self::of_user(text, by_formula(formula.trim(), constants.trim())?));
        }
        if !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit()) {
            return Ok(Self::of_user(text, number::parse(text)?));
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

fn by_formula(formula: &str, text: &str) -> Result<Dispersion, GlassError> {
    let constants: Option<Vec<f64>> = text.split(',').map(|field| field.trim().parse().ok()).collect();
    let constants = constants.unwrap_or_default();
    let wrong = |formula, takes| GlassError::Constants {
        formula,
        constants: text.into(),
        takes,
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
            return Err(GlassError::UnknownFormula {
                formula: formula.into(),
            });
        }
    };
    dispersion.checked()
}
