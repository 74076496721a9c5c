//! The window under Xvfb, and what takes longer of its parts without a display.

mod filming;
#[path = "../../quick/viewer/fixtures.rs"]
#[allow(dead_code, reason = "quick tests use the rest")]
mod fixtures;
#[path = "../../quick/viewer/headless.rs"]
#[allow(dead_code, reason = "quick tests use the rest")]
mod headless;
mod new_lights;
mod panel;
#[cfg(target_os = "linux")]
mod random_input;
mod real_files;
#[path = "../../quick/viewer/scene_file.rs"]
#[allow(dead_code, reason = "quick tests use the rest")]
mod scene_file;
#[cfg(target_os = "linux")]
mod time_left;
mod watched;
#[cfg(target_os = "linux")]
mod window;
#[cfg(target_os = "linux")]
mod window_edit;
#[cfg(target_os = "linux")]
mod window_files;
