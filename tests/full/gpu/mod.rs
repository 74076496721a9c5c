//! The graphics device against the CPU, and what it uploads, keeps and makes on demand.
//!
//! An adapter is required, a software one will do: with CI=true its absence is a failure, else a skip that says so.

mod against_cpu;
mod chains;
mod display;
mod flights;
mod judge;
mod lights;
mod maps;
mod on_demand;
mod parted;
mod rays;
mod refinement;
#[path = "../../quick/gpu/rig.rs"]
#[allow(dead_code, reason = "quick tests use the rest")]
mod rig;
mod uploads;
mod views;
