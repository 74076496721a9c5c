//! Dispersion formulas: the refractive index by wavelength.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use super::{FINITE, refused};
use crate::error::Result;
use crate::optics::Nanometres;
use crate::optics::wavelength::{C_LINE, D_LINE, F_LINE, VISIBLE};

/// λ0 of Herzberger's formula [µm], as its author chose it.
const HERZBERGER_UM: f64 = 0.168;
/// Far above the index of any transparent material.
const MAX_INDEX: f64 = 10.0;

/// Refractive index n against vacuum or air [1] by wavelength λ [µm], as one of the formulas in common use.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Dispersion {
    Constant(f64),
    /// n = A + B/λ² with the given `n_d` and Abbe number V_d = (n_d − 1)/(n_F − n_C): the curve of glTF's
    /// KHR_materials_dispersion. The extension rounds two constants that are exact here, which changes n by less than
    /// 1e-6.
    Abbe {
        /// Index at 587.56 nm.
        n_d: f64,
        /// Abbe number, above 0; a larger one disperses less.
        v_d: f64,
    },
    /// n = a + b/λ² + c/λ⁴ + d λ²; Cauchy's formula where `d` is 0.
    Cauchy {
        /// [1].
        a: f64,
        /// [µm²].
        b: f64,
        /// [µm⁴].
        c: f64,
        /// [1/µm²].
        d: f64,
    },
    /// n² = 1 + constant + Σ b λ²/(λ² − c); Sellmeier's formula where `constant` is 0. Unused terms have b = 0.
    Sellmeier {
        /// Contribution of distant resonances [1].
        constant: f64,
        /// Strengths [1].
        b: [f64; 4],
        /// Squared wavelengths of the resonances [µm²].
        c_um2: [f64; 4],
    },
    /// n = a + b λ² + c L + d L², L = 1/(λ² − 0.168²) (M. Herzberger, Opt. Acta 6, 197, 1959).
    Herzberger {
        /// [1].
        a: f64,
        /// [1/µm²].
        b: f64,
        /// [µm²].
        c: f64,
        /// [µm⁴].
        d: f64,
    },
}

impl Dispersion {
    /// From glTF's `ior` and KHR_materials_dispersion's `dispersion` = 20/V_d, both finite; 0 means no dispersion.
    pub fn from_gltf(ior: f64, dispersion: f64) -> Self {
        if dispersion > 0.0 {
            Self::Abbe {
                n_d: ior,
                v_d: 20.0 / dispersion,
            }
        } else {
            Self::Constant(ior)
        }
    }

    /// The same formula, if its constants are plausible for a transparent material.
    ///
    /// # Errors
    /// A constant that is not finite; an Abbe number that is not above 0; an infinite index at a visible wavelength;
    /// n_d not from 1 to 10.
    pub fn checked(self) -> Result<Self> {
        let (formula, constants) = self.constants();
        let wrong = |value: f64| refused(format!("{value} cannot be a constant of {formula}"), FINITE);
        if let Some(value) = constants.iter().copied().find(|value| !value.is_finite()) {
            return Err(wrong(value));
        }
        match self {
            Self::Abbe { v_d, .. } if v_d <= 0.0 => return Err(wrong(v_d)),
            Self::Sellmeier { b, c_um2, .. } => {
                let resonances = b.iter().zip(c_um2).filter(|(b, c)| **b != 0.0 && *c >= 0.0);
                let mut places = resonances.map(|(_, c)| Nanometres(1e3 * c.sqrt()));
                if let Some(Nanometres(nm)) = places.find(|place| VISIBLE.contains(place)) {
                    let remedy = "give resonances (C, in µm²) outside of 360 to 830 nm";
                    return Err(refused(format!("the index is infinite at {nm:.1} nm"), remedy));
                }
            }
            _ => {}
        }
        let n_d = self.formula(D_LINE.micrometres().powi(2));
        if (1.0..=MAX_INDEX).contains(&n_d) {
            Ok(self)
        } else {
            let remedy = "give constants for wavelengths in µm whose index is from 1 to 10";
            Err(refused(format!("the index at 587.56 nm is {n_d}"), remedy))
        }
    }

    /// Refractive index, finite and at least 1: clamped to 1 where the formula gives less, and 1 where it gives no
    /// number (see [`falls_below_one`](Self::falls_below_one)).
    pub fn index(&self, wavelength: Nanometres) -> f64 {
        let n = self.formula(wavelength.micrometres().powi(2));
        if n.is_finite() { n.max(1.0) } else { 1.0 }
    }

    /// Slope of [`index`](Self::index) [1/nm]: negative for normal dispersion, 0 where the index is clamped to 1.
    pub fn slope_per_nm(&self, wavelength: Nanometres) -> f64 {
        let um = wavelength.micrometres();
        let square = um * um;
        let n = self.formula(square);
        if !n.is_finite() || n < 1.0 {
            return 0.0;
        }
        // Derivative of each formula with respect to λ².
        let by_square = match *self {
            Self::Constant(_) => 0.0,
            Self::Abbe { n_d, v_d } => -abbe_b(n_d, v_d) / (square * square),
            Self::Cauchy { b, c, d, .. } => d - (b + 2.0 * c / square) / (square * square),
            Self::Sellmeier { b, c_um2, .. } => {
                let terms = b.iter().zip(c_um2);
                terms.map(|(b, c)| -b * c / (square - c).powi(2)).sum::<f64>() / (2.0 * n)
            }
            Self::Herzberger { b, c, d, .. } => {
                let l = herzberger_l(square);
                b - (c + 2.0 * d * l) * l * l
            }
        };
        by_square * 2.0 * um * 1e-3
    }

    pub fn n_d(&self) -> f64 {
        self.index(D_LINE)
    }

    /// Abbe number V_d = (n_d − 1)/(n_F − n_C); infinite without dispersion.
    pub fn abbe_number(&self) -> f64 {
        let spread = self.index(F_LINE) - self.index(C_LINE);
        if spread == 0.0 {
            f64::INFINITY
        } else {
            (self.n_d() - 1.0) / spread
        }
    }

    /// Whether the index varies between visible wavelengths.
    pub fn is_dispersive(&self) -> bool {
        let ends = [*VISIBLE.start(), F_LINE, C_LINE, *VISIBLE.end()].map(|line| self.index(line));
        ends.iter().any(|n| *n != ends[0])
    }

    /// Whether the formula gives less than 1, or no number, at some whole nanometre of a range.
    pub fn falls_below_one(&self, range: &RangeInclusive<Nanometres>) -> bool {
        let whole = range.start().0.ceil() as u32..=range.end().0.floor() as u32;
        whole
            .map(|nm| self.formula((f64::from(nm) * 1e-3).powi(2)))
            .any(|n| n.is_nan() || n < 1.0)
    }

    /// Unclamped value of the formula, by squared wavelength [µm²].
    fn formula(&self, square: f64) -> f64 {
        match *self {
            Self::Constant(n) => n,
            Self::Abbe { n_d, v_d } => {
                let d_square = D_LINE.micrometres().powi(2);
                n_d + abbe_b(n_d, v_d) * (1.0 / square - 1.0 / d_square)
            }
            Self::Cauchy { a, b, c, d } => a + (b + c / square) / square + d * square,
            Self::Sellmeier { constant, b, c_um2 } => {
                let terms = b.iter().zip(c_um2);
                (1.0 + constant + terms.map(|(b, c)| b * square / (square - c)).sum::<f64>()).sqrt()
            }
            Self::Herzberger { a, b, c, d } => {
                let l = herzberger_l(square);
                a + b * square + (c + d * l) * l
            }
        }
    }

    /// Name and constants of the formula.
    fn constants(&self) -> (&'static str, Vec<f64>) {
        match *self {
            Self::Constant(n) => ("a constant index", vec![n]),
            Self::Abbe { n_d, v_d } => ("abbe", vec![n_d, v_d]),
            Self::Cauchy { a, b, c, d } => ("cauchy", vec![a, b, c, d]),
            Self::Sellmeier { constant, b, c_um2 } => {
                ("sellmeier", [[constant].as_slice(), &b, &c_um2].concat())
            }
            Self::Herzberger { a, b, c, d } => ("herzberger", vec![a, b, c, d]),
        }
    }
}

/// B [µm²] of n = A + B/λ².
fn abbe_b(n_d: f64, v_d: f64) -> f64 {
    let inverse_square = |line: Nanometres| line.micrometres().powi(-2);
    (n_d - 1.0) / (v_d * (inverse_square(F_LINE) - inverse_square(C_LINE)))
}

/// L of Herzberger's formula [1/µm²].
fn herzberger_l(square: f64) -> f64 {
    1.0 / (square - HERZBERGER_UM * HERZBERGER_UM)
}
