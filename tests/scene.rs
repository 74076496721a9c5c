//! Scenes: the built-in ones and those from files.

mod support;

#[path = "scene/builtins.rs"]
mod builtins;
#[path = "scene/collections.rs"]
mod collections;
#[path = "scene/files.rs"]
mod files;
