//! Accuracy against cost: references by brute force, agreement of maps, and how errors fall with rays and seconds.

pub mod agreement;
pub mod brute_force;
pub mod convergence;
pub mod cost;
pub mod plot;
pub mod references;
