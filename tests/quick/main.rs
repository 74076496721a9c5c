//! What every change has to pass, in minutes.

#![allow(clippy::print_stdout, reason = "figures, for those who ask by --nocapture")]

mod bake;
mod cli;
mod export;
mod eye;
#[cfg(feature = "gpu")]
mod gpu;
mod laws;
mod physics;
mod prelude;
mod scene;
#[cfg(feature = "viewer")]
mod viewer;
