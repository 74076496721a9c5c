//! Spectra: their power by wavelength, their colour, and the wavelengths to trace.
//!
//! ```text
//!  CSV, name, colour ─► Spectrum ─► Xyz ─► LinearSrgb ─► display
//!                          └─► WavelengthSampler ─► wavelengths to trace
//! ```

pub mod csv;
pub mod error;
pub mod hue;
pub mod illuminants;
pub mod luminous;
pub mod table;
pub mod temperature;
pub mod upsample;
pub mod xyz;

pub use error::SpectrumError;
pub use hue::{Hue, dominant};
pub use illuminants::illuminant;
pub use luminous::{WavelengthBand, WavelengthSampler};
pub use table::Spectrum;
pub use upsample::{Emission, SmoothSpectrum};
pub use xyz::Xyz;
pub use xyz::xyz_bar;
