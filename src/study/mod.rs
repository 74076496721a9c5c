//! Accuracy against cost: references by brute force, agreement of maps, how errors fall with rays and seconds, and what
//! each effect costs and is worth.

pub mod agreement;
pub mod brute_force;
pub mod convergence;
pub mod cost;
pub mod effects;
pub mod plot;
pub mod references;
mod repeats;
