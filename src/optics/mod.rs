//! What light does at an interface, and what colour it has.

pub mod colour;
pub mod fresnel;
pub mod refraction;

pub use colour::LinearSrgb;
