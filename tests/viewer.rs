//! The window: its parts without a display, and the whole under Xvfb.
#![cfg(feature = "viewer")]
#![allow(clippy::print_stdout, reason = "figures, for those who ask by --nocapture")]

#[path = "viewer/config.rs"]
mod config;
#[path = "viewer/course_plot.rs"]
mod course_plot;
#[path = "viewer/debounce.rs"]
mod debounce;
#[cfg(target_os = "linux")]
#[path = "viewer/desktop.rs"]
mod desktop;
#[path = "viewer/difference_view.rs"]
mod difference_view;
#[cfg(target_os = "linux")]
#[path = "viewer/drop.rs"]
mod drop;
#[path = "viewer/effects.rs"]
mod effects;
#[path = "viewer/error_view.rs"]
mod error_view;
#[path = "viewer/exporting.rs"]
mod exporting;
#[path = "viewer/files.rs"]
mod files;
#[cfg(target_os = "linux")]
#[path = "viewer/filming.rs"]
mod filming;
#[path = "viewer/flat_map.rs"]
mod flat_map;
#[path = "viewer/frame_times.rs"]
mod frame_times;
#[path = "viewer/gizmo.rs"]
mod gizmo;
#[path = "viewer/headless.rs"]
mod headless;
#[path = "viewer/history.rs"]
mod history;
#[path = "viewer/latency.rs"]
mod latency;
#[path = "viewer/lights.rs"]
mod lights;
#[path = "viewer/model.rs"]
mod model;
#[path = "viewer/navigation.rs"]
mod navigation;
#[path = "viewer/pace.rs"]
mod pace;
#[path = "viewer/panel.rs"]
mod panel;
#[path = "viewer/panel_sections.rs"]
mod panel_sections;
#[cfg(target_os = "linux")]
#[path = "viewer/random_input.rs"]
mod random_input;
#[path = "viewer/save_scene.rs"]
mod save_scene;
#[path = "viewer/scene_file.rs"]
mod scene_file;
#[path = "viewer/screenshot.rs"]
mod screenshot;
#[path = "viewer/sketching.rs"]
mod sketching;
#[cfg(target_os = "linux")]
#[path = "support/mod.rs"]
mod support;
#[path = "viewer/time_left.rs"]
mod time_left;
#[path = "viewer/views.rs"]
mod views;
#[path = "viewer/walking.rs"]
mod walking;
#[path = "viewer/wavelength_view.rs"]
mod wavelength_view;
#[cfg(target_os = "linux")]
#[path = "viewer/window.rs"]
mod window;
#[cfg(target_os = "linux")]
#[path = "viewer/window_edit.rs"]
mod window_edit;
#[cfg(target_os = "linux")]
#[path = "viewer/window_files.rs"]
mod window_files;
#[cfg(target_os = "linux")]
#[path = "viewer/window_film.rs"]
mod window_film;
#[path = "viewer/worker.rs"]
mod worker;
#[path = "viewer/worth.rs"]
mod worth;
