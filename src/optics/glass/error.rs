//! Errors in the description of a glass.

use crate::error::Error;

/// A fault in how a glass was asked for; [`remedy`](Self::remedy) says what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GlassError {
    /// A name that the catalogue does not have.
    #[error("no glass is named `{name}`; the nearest names are {nearest}")]
    UnknownName {
        /// What was asked for.
        name: String,
        /// Names most like it.
        nearest: String,
    },
    /// Digits that are no glass number.
    #[error("`{number}` is not a glass number of six digits")]
    NotANumber {
        /// What was asked for.
        number: String,
    },
    /// A formula's name that is none.
    #[error("no formula is named `{formula}`")]
    UnknownFormula {
        /// What was asked for.
        formula: String,
    },
    /// Too few, too many, or something that is no number.
    #[error("`{constants}` are not constants for {formula}, which takes {takes}")]
    Constants {
        /// The formula.
        formula: &'static str,
        /// What was given.
        constants: String,
        /// What it takes.
        takes: &'static str,
    },
    /// A constant that is infinite or not a number, or an Abbe number that is not above 0.
    #[error("{value} cannot be a constant of {formula}")]
    Value {
        /// The formula.
        formula: &'static str,
        /// The constant.
        value: f64,
    },
    /// A resonance where it can be seen: the index would be infinite.
    #[error("the index is infinite at {wavelength_nm:.1} nm")]
    Resonance {
        /// Where [nm].
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
    /// What the user can do about it.
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

    /// The same fault as an error of the command: where it was met, what it is, what to do.
    pub fn at(self, location: impl Into<String>) -> Error {
        Error::usage(location, self.to_string(), self.remedy())
    }
}
