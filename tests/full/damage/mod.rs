//! Damaged, edited and hostile input: whatever comes of it, there is a result or one clear sentence, in time and in
//! little memory. Never a panic.
//!
//! All damage is seeded: the same in every run. `NEPHROID_MUTATIONS=50` makes 50 times as much of it. What a test fails
//! over is left in the build folder.

mod files;
mod folders;
pub mod mutate;
mod scenes;
mod values;
mod watch;
