//! The window: its parts without a display, and the whole under Xvfb.
#![cfg(feature = "viewer")]

#[path = "viewer/debounce.rs"]
mod debounce;
#[cfg(target_os = "linux")]
#[path = "viewer/desktop.rs"]
mod desktop;
#[path = "viewer/difference_view.rs"]
mod difference_view;
#[path = "viewer/effects.rs"]
mod effects;
#[path = "viewer/error_view.rs"]
mod error_view;
#[path = "viewer/frame_times.rs"]
mod frame_times;
#[path = "viewer/headless.rs"]
mod headless;
#[path = "viewer/model.rs"]
mod model;
#[path = "viewer/navigation.rs"]
mod navigation;
#[path = "viewer/pace.rs"]
mod pace;
#[path = "viewer/panel.rs"]
mod panel;
#[path = "viewer/screenshot.rs"]
mod screenshot;
#[cfg(target_os = "linux")]
#[path = "support/mod.rs"]
mod support;
#[path = "viewer/walking.rs"]
mod walking;
#[cfg(target_os = "linux")]
#[path = "viewer/window.rs"]
mod window;
#[path = "viewer/worker.rs"]
mod worker;
#[path = "viewer/worth.rs"]
mod worth;
