//! What light does at an interface, and what colour it has.

pub mod colour;
pub mod fresnel;
mod names;
pub mod refraction;
pub mod spectrum;
pub mod wavelength;

pub use colour::LinearSrgb;
pub use wavelength::Nanometres;
