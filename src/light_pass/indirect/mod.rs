//! Indirect light between diffuse surfaces (LD+D, LS+D+D), with any number of bounces.
//!
//! Each receiver has a grid of elements, coarser than its map, since this light is smooth. Rays leave every element by the
//! cosine, are followed through glass and off mirrors as radiance is, and end on elements of diffuse surfaces. What
//! they weigh (tints, absorption, polish, n², and the albedo where they end) makes a sparse matrix K, and
//!
//! E = K (S + E), S = caustic + direct
//!
//! is iterated until it stands. The rays are traced once: lamps that become dimmer or brighter need none. Emission is no
//! part of it: what glows lights by the direct and caustic layers.
//!
//! Half of the rays against the other half tell the error of each element.

mod element;
mod error;
mod facets;
mod grid;
mod network;
mod path;
mod resample;
mod solve;
mod trace;

pub use element::{Element, Elements};
pub use grid::Grid;
pub use network::{MAX_PASSES, MIN_PASSES, Network};
pub use resample::Resampling;
pub use solve::{MAX_BOUNCES, Solution};
pub use trace::TraceCounts;
