//! Errors in the description of a spectrum.

use crate::error::Error;

/// An invalid spectrum; [`remedy`](Self::remedy) says what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpectrumError {
    /// A row of a file that is not a pair of numbers.
    #[error("line {line}: `{text}` is not a wavelength and a value")]
    NotARow {
        /// Line of the file, from 1.
        line: usize,
        /// Text of the line.
        text: String,
    },
    /// A wavelength or value that is not finite.
    #[error("line {line}: {value} is not a finite number")]
    NotFinite {
        /// Line of the file, or row of the table, from 1.
        line: usize,
        value: f64,
    },
    /// A negative wavelength or value.
    #[error("line {line}: {value} is negative")]
    Negative {
        /// Line of the file, or row of the table, from 1.
        line: usize,
        value: f64,
    },
    /// A wavelength that is not above the previous one.
    #[error("line {line}: {wavelength_nm} nm does not come after {before_nm} nm")]
    NotIncreasing {
        /// Line of the file, or row of the table, from 1.
        line: usize,
        /// Wavelength of this row [nm].
        wavelength_nm: f64,
        /// Wavelength of the previous row [nm].
        before_nm: f64,
    },
    /// A table of fewer than two rows.
    #[error("a spectrum of {rows} rows says nothing between wavelengths")]
    TooFewRows {
        /// Number of rows.
        rows: usize,
    },
    /// All wavelengths are outside the visible range.
    #[error("its wavelengths {first_nm} to {last_nm} nm lie outside of the visible 360 to 830 nm")]
    Invisible {
        /// The shortest [nm].
        first_nm: f64,
        /// The longest [nm].
        last_nm: f64,
    },
    /// No light at any visible wavelength.
    #[error("it has no light between 360 and 830 nm")]
    Dark,
    /// No spectrum has this name.
    #[error("no spectrum is named `{name}`; the nearest names are {nearest}")]
    UnknownName {
        /// The name asked for.
        name: String,
        /// The most similar names.
        nearest: String,
    },
    /// A temperature or wavelength in a name that is not a number or out of range.
    #[error("`{text}` is not a number from {least} to {most} {unit}")]
    OutOfRange {
        /// The text given.
        text: String,
        least: f64,
        most: f64,
        /// Unit of the number.
        unit: &'static str,
    },
    /// A colour with a negative or non-finite channel, which has no spectrum.
    #[error("the colour {r}, {g}, {b} {fault}")]
    NoSuchColour {
        /// Red, linear.
        r: f64,
        /// Green, linear.
        g: f64,
        /// Blue, linear.
        b: f64,
        /// What is wrong with it.
        fault: &'static str,
    },
}

impl SpectrumError {
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NotARow { .. } => "write two columns, wavelength in nm and value, between commas",
            Self::NotFinite { .. } | Self::Negative { .. } => "give a finite value of 0 or more",
            Self::NotIncreasing { .. } => "sort the rows by wavelength and name each once",
            Self::TooFewRows { .. } => "give two rows or more",
            Self::Invisible { .. } => "give wavelengths in nanometres, 360 to 830",
            Self::Dark => "give at least one visible wavelength a value above 0",
            Self::UnknownName { .. } => "choose one of them, blackbody:KELVIN, line:NM or a CSV file",
            Self::OutOfRange { .. } => "choose a number in that range",
            Self::NoSuchColour { .. } => "give finite channels that no light could contradict",
        }
    }

    /// As a usage error of the command, with the location of the fault.
    pub fn at(self, location: impl Into<String>) -> Error {
        Error::usage(location, self.to_string(), self.remedy())
    }
}
