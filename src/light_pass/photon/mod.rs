//! Photons: paths sampled from a light, one branch at each event, each hit counted in its texel.
//!
//! Where patches of a wavefront shatter (cut glass, rough glass, many internal reflections) or would have to be
//! averaged over an extended light, a photon still costs one path. Point of the lamp, micro-normals and wavelength are
//! dimensions of the path. Bundles carry coherent light, photons the difference.

mod bundles;
mod cells;
pub mod filter;
pub mod launch;
pub mod pass;
pub mod spectrum;
pub mod spheres;
mod survey;
pub mod walk;
