//! What light does at an interface, and what colour it has.

pub mod colour;
pub mod colour_basis;
pub mod colour_matrix;
pub mod conductor;
pub mod fresnel;
pub mod glass;
pub mod metal;
mod names;
pub mod refraction;
pub mod spectrum;
pub mod wavelength;

pub use colour::LinearSrgb;
pub use colour_basis::ColourBasis;
pub use colour_matrix::ColourMatrix;
pub use glass::Glass;
pub use metal::Metal;
pub use wavelength::Nanometres;
