//! Accuracy against cost: references by brute force, agreement of maps, and studies, which are sweeps: bakes of several
//! variants, a row for each.

mod accuracy;
pub mod agreement;
pub mod brute_force;
pub mod cost;
pub mod one_scene;
mod paper;
pub mod picture;
pub mod plot;
pub mod references;
pub mod studies;
pub mod sweep;
pub mod table;
