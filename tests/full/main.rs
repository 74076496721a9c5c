//! Everything that takes longer: accuracy against truth, windows driven by hands, damage, faults and signals.

#![allow(clippy::print_stdout, reason = "figures, for those who ask by --nocapture")]

mod bake;
mod cli;
mod damage;
mod eye;
#[cfg(feature = "gpu")]
mod gpu;
#[cfg(feature = "viewer")]
mod viewer;
