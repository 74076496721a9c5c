//! Indirect light between diffuse surfaces (LD+D, LS+D+D), with any number of bounces.
//!
//! Each receiver has a grid of elements, coarser than its map, since indirect light is smooth. Cosine-weighted rays
//! leave every element, are traced through glass and off mirrors as radiance is, and end on elements of diffuse
//! surfaces. Their weights (tints, absorption, coats, n², and the albedo where they end) form a sparse matrix K, and
//!
//! E = K (S + E), S = caustic + direct
//!
//! is iterated until it converges. Rays are traced once and do not depend on the strength of lights. Emission is not
//! part of S: light of glowing surfaces is in the direct and caustic layers.
//!
//! The difference between two halves of its rays estimates the error of each element.

mod element;
mod error;
mod facets;
mod grid;
mod network;
mod path;
mod resample;
mod smoothing;
mod solve;
mod tolerance;
mod trace;

pub use element::{Element, Elements};
pub use grid::Grid;
pub use network::{MAX_PASSES, MIN_PASSES, Network};
pub use resample::Resampling;
pub use smoothing::NoiseSmoothing;
pub use solve::{MAX_BOUNCES, Solution};
pub use tolerance::NoiseTolerance;
pub use trace::TraceCounts;
