//! The caustic layer: light that met at least one specular surface (LS+D), by the paper's method.

mod bands;
pub mod deposit;
pub mod footprint;
mod gaussian;
mod joint;
pub mod kept;
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
