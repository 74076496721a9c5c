//! Spectra: their power by wavelength, their colour, and the wavelengths to trace.
//!
//! ```text
//!  CSV, name, colour ─► Spectrum ─► Xyz ─► LinearSrgb ─► display
//!                          └─► WavelengthSampler ─► wavelengths to trace
//! ```

pub mod csv;
pub mod hue;
pub mod illuminants;
pub mod luminous;
pub mod table;
pub mod temperature;
pub mod upsample;
pub mod xyz;

pub use hue::{Hue, dominant};
pub use illuminants::illuminant;
pub use luminous::{WavelengthBand, WavelengthSampler};
pub use table::Spectrum;
pub use upsample::{Emission, SmoothSpectrum};
pub use xyz::Xyz;
pub use xyz::xyz_bar;

use crate::error::Error;

fn refused(what: impl Into<String>, remedy: &str) -> Error {
    Error::usage("spectrum", what, remedy)
}
