//! The window: its parts without a display, and the whole under Xvfb.
#![cfg(feature = "viewer")]

#[path = "viewer/navigation.rs"]
mod navigation;
#[path = "viewer/worker.rs"]
mod worker;
