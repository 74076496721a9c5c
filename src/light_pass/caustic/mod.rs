//! The caustic layer: light that met at least one specular surface (LS+D), by the paper's method.

pub mod deposit;
pub mod footprint;
pub mod kept;
pub mod kernel;
pub mod lattice;
pub mod pass;
pub mod path;
pub mod setup;
pub mod splat;
pub mod statistics;
