//! Accuracy against cost: references by brute force, agreement of maps, how errors fall with rays and seconds, what
//! each effect costs and is worth, how long frames take, hard cases with their laws, and the paper's table and figures.

pub mod agreement;
pub mod brute_force;
pub mod convergence;
pub mod cost;
pub mod effects;
#[cfg(feature = "gpu")]
pub mod frame_times;
pub mod page;
pub mod pages;

pub mod plot;
pub mod references;
mod repeats;
pub mod spectrum;
pub mod stability;
