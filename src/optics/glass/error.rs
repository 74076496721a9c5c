//! Errors in the description of a glass.

use crate::error::Error;

/// An invalid specification of a glass; [`remedy`](Self::remedy) says what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GlassError {
    /// The catalogue has no such name.
    #[error("no glass is named `{name}`; the nearest names are {nearest}")]
    UnknownName {
        /// The name asked for.
        name: String,
        /// The most similar names.
        nearest: String,
    },
    /// Digits that are not a glass number.
    #[error("`{number}` is not a glass number of six digits")]
    NotANumber {
        /// The text given.
        number: String,
    },
    /// No formula has this name.
    #[error("no formula is named `{formula}`")]
    UnknownFormula {
        /// The name asked for.
        formula: String,
    },
    /// Too few or too many constants, or not numbers.
    #[error("`{constants}` are not constants for {formula}, which takes {takes}")]
    Constants {
        formula: &'static str,
        /// The text given.
        constants: String,
        /// The constants that the formula takes.
        takes: &'static str,
    },
    /// A constant that is not finite, or an Abbe number that is not above 0.
    #[error("{value} cannot be a constant of {formula}")]
    Value {
        /// Name of the formula.
        formula: &'static str,
        value: f64,
    },
    /// A resonance at a visible wavelength, where the index would be infinite.
    #[error("the index is infinite at {wavelength_nm:.1} nm")]
    Resonance {
        /// Its wavelength [nm].
        wavelength_nm: f64,
    },
    /// An index that no transparent material has.
    #[error("the index at 587.56 nm is {n_d}")]
    Index {
        /// The index.
        n_d: f64,
    },
}

impl GlassError {
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::UnknownName { .. } => "choose one of them, a six-digit glass number or a formula",
            Self::NotANumber { .. } => "write n_d - 1 and V_d in three digits each, as 517642 for N-BK7",
            Self::UnknownFormula { .. } => "choose abbe, cauchy, sellmeier or herzberger",
            Self::Constants { .. } | Self::Value { .. } => "give finite numbers between commas",
            Self::Resonance { .. } => "give resonances (C, in µm²) outside of 360 to 830 nm",
            Self::Index { .. } => "give constants for wavelengths in µm whose index is from 1 to 10",
        }
    }

    /// As a usage error of the command, with the location of the fault.
    pub fn at(self, location: impl Into<String>) -> Error {
        Error::usage(location, self.to_string(), self.remedy())
    }
}
