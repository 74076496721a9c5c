//! The caustic layer by the paper's method: each ray lights a footprint, and spreads its flux with a kernel.

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
mod surface;
mod window;
