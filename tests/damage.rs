//! Damaged, edited and hostile input: whatever comes of it, there is a result or one clear sentence, in time and in
//! little memory. Never a panic.
//!
//! All damage is seeded: the same in every run. `NEPHROID_MUTATIONS=50` makes 50 times as much of it. What a test fails
//! over is left in the build folder.

#![allow(clippy::print_stdout, reason = "figures, for those who ask by --nocapture")]

#[path = "damage/baked.rs"]
mod baked;
#[path = "scene/glb.rs"]
#[allow(dead_code)]
mod glb;
#[path = "damage/helpers.rs"]
mod helpers;
#[path = "damage/images.rs"]
mod images;
#[path = "damage/maps.rs"]
mod maps;
#[path = "damage/mutate.rs"]
mod mutate;
#[path = "cli/program.rs"]
#[allow(dead_code)]
mod program;
#[path = "damage/races.rs"]
mod races;
#[path = "damage/scenes.rs"]
mod scenes;
#[path = "damage/shards.rs"]
mod shards;
#[path = "support/mod.rs"]
mod support;
#[path = "damage/tables.rs"]
mod tables;
#[path = "bake/tools.rs"]
#[allow(dead_code)]
mod tools;
#[path = "damage/values.rs"]
mod values;
#[path = "damage/watch.rs"]
mod watch;

/// Tells how much memory a test takes.
#[global_allocator]
static MEMORY: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;
