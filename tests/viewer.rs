//! The window: its parts without a display, and the whole under Xvfb.
#![cfg(feature = "viewer")]

#[path = "viewer/debounce.rs"]
mod debounce;
#[path = "viewer/headless.rs"]
mod headless;
#[path = "viewer/navigation.rs"]
mod navigation;
#[path = "viewer/panel.rs"]
mod panel;
#[path = "viewer/worker.rs"]
mod worker;
