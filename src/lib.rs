//! Nephroid bakes light that went through glass, mirrors and water into illumination maps, and lets you walk through
//! the result.
//!
//! ```text
//!  glTF or built-in ─► Scene ─► EffectPlan ─► light pass ──► IlluminationMaps ─► eye pass ─► window, PNG
//!                               what this     CPU, rayon      flux per texel     wgpu raster or
//!                               scene needs   obvhs BVH                          CPU ray tracer
//! ```
//!
//! A module imports only what stands above it in this list.

pub mod effect;
pub mod error;
pub mod settings;
pub mod units;

pub mod files;
#[cfg(feature = "gpu")]
pub mod gpu;

pub mod optics;

pub mod geometry;

pub mod scene;

pub mod plan;

pub mod transport;

pub mod illumination;

pub mod progress;

pub mod light_pass;

pub mod eye_pass;

pub mod session;

pub mod export;

pub mod study;

#[cfg(feature = "viewer")]
pub mod viewer;
