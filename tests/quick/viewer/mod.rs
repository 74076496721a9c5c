//! The window: its parts without a display.

mod config;
mod course_plot;
mod debounce;
mod effects;
mod exporting;
mod false_colours;
mod files;
mod filming;
mod fixtures;
mod flat_map;
mod frame_times;
mod gizmo;
mod headless;
mod history;
mod latency;
mod lights;
mod model;
mod navigation;
mod pace;
mod panel;
mod save_scene;
mod scene_edits;
#[allow(dead_code, reason = "full tests use the rest")]
mod scene_file;
mod screenshot;
mod sketching;
mod views;
#[cfg(target_os = "linux")]
mod window;
mod worker;
mod worth;
