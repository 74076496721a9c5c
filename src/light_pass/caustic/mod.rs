//! The caustic layer: light that met at least one specular surface (LS+D), by the paper's method.

pub mod arrival_cache;
mod bivariate_normal;
mod blocks;
pub mod deposit;
pub mod footprint;
mod gaussian;
pub mod kernel;
pub mod lattice;
mod neighbourhood;
mod numeric;
pub mod pass;
pub mod path;
pub mod setup;
pub mod splat;
pub mod statistics;
mod surface;
