//! Photons: paths sampled from a light, one branch an event, each hit counted into its texel.
//!
//! Where patches of a wavefront shatter (cut glass, rough glass, many inner reflections) or would have to be averaged
//! over a lamp, photons cost what a path costs. Lamp, micro-normals and wavelength are dimensions of the path.

mod cells;
pub mod filter;
pub mod launch;
pub mod pass;
pub mod spectrum;
pub mod spheres;
pub mod walk;
