//! Scenes: the built-in ones and those from files.

mod bodies;
mod builtins;
mod camera_paths;
mod collections;
mod compressed;
mod edits;
mod files;
mod lights;
mod materials;
mod meshes;
mod motion;
mod refusals;
mod spectral;
