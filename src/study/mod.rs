//! Accuracy against cost: references by brute force, agreement of maps, and how errors fall with rays and seconds.

pub mod agreement;
pub mod brute_force;
