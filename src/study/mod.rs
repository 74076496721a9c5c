//! Accuracy against cost: brute-force references, comparison of maps, and studies, which bake several variants and
//! tabulate them.

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
