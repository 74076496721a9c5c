//! How far bakes of the hard scenes are from brute force (`cargo bench --bench references`, see `print_distances`), and
//! the maps by brute force themselves (`cargo bench --bench references -- write`: some 25 minutes of CPU).
#![allow(
    dead_code,
    unused_imports,
    clippy::print_stdout,
    reason = "parts of a test, used otherwise"
)]

#[path = "../bake/brute_force.rs"]
mod brute_force;
#[path = "../bake/hard_cases.rs"]
mod hard_cases;
#[path = "../support/hard_scenes.rs"]
mod hard_scenes;
#[path = "../support/mod.rs"]
mod support;
#[path = "../bake/tools.rs"]
mod tools;

fn main() {
    if std::env::args().any(|argument| argument == "write") {
        hard_cases::write_references();
    } else {
        hard_cases::print_distances();
    }
}
