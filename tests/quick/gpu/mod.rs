//! The graphics device: shaders, struct layouts, limits, and one picture against the CPU's.
//!
//! An adapter is required, a software one will do: with CI=true its absence is a failure, else a skip that says so.

mod device;
mod picture;
#[allow(dead_code, reason = "full tests use the rest")]
mod rig;
mod shaders;
