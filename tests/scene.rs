//! Scenes: the built-in ones and those from files.

mod support;

#[path = "scene/builtins.rs"]
mod builtins;
#[path = "scene/camera_paths.rs"]
mod camera_paths;
#[path = "scene/collections.rs"]
mod collections;
#[path = "scene/edits.rs"]
mod edits;
#[path = "scene/files.rs"]
mod files;
#[path = "scene/glb.rs"]
mod glb;
#[path = "scene/lights.rs"]
mod lights;
#[path = "scene/materials.rs"]
mod materials;
#[path = "scene/meshes.rs"]
mod meshes;
#[path = "scene/oracle.rs"]
mod oracle;
#[path = "scene/refusals.rs"]
mod refusals;
#[path = "scene/spectral.rs"]
mod spectral;
