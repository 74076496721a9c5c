//! The graphics device: shaders, struct layouts, and pictures of known radiance.
//!
//! An adapter is required, a software one will do: with CI=true its absence is a failure, else a skip that says so.
#![cfg(feature = "gpu")]

mod support;

#[path = "gpu/against_cpu.rs"]
mod against_cpu;
#[path = "gpu/builtins.rs"]
mod builtins;
#[path = "support/bump_scenes.rs"]
#[allow(dead_code)]
mod bump_scenes;
#[path = "gpu/caustic_images.rs"]
mod caustic_images;
#[path = "support/chain_laws.rs"]
mod chain_laws;
#[path = "gpu/chain_pictures.rs"]
mod chain_pictures;
#[path = "gpu/device.rs"]
mod device;
#[path = "gpu/display.rs"]
mod display;
#[path = "gpu/effect_matrix.rs"]
mod effect_matrix;
#[path = "support/effect_scenes.rs"]
mod effect_scenes;
#[path = "gpu/flights.rs"]
mod flights;
#[path = "support/flip.rs"]
mod flip;
#[path = "scene/glb.rs"]
#[allow(dead_code)]
mod glb;
#[path = "gpu/laws.rs"]
mod laws;
#[path = "gpu/lights.rs"]
mod lights;
#[path = "gpu/limits.rs"]
mod limits;
#[path = "gpu/map_levels.rs"]
mod map_levels;
#[path = "gpu/nearby.rs"]
mod nearby;
#[path = "gpu/numbers.rs"]
mod numbers;
#[path = "gpu/on_demand.rs"]
mod on_demand;
#[path = "gpu/parted.rs"]
mod parted;
#[path = "gpu/radiance.rs"]
mod radiance;
#[path = "gpu/rays.rs"]
mod rays;
#[path = "gpu/refinement.rs"]
mod refinement;
#[path = "gpu/reflections.rs"]
mod reflections;
#[path = "gpu/scenes.rs"]
mod scenes;
#[path = "gpu/shaders.rs"]
mod shaders;
#[path = "gpu/skies.rs"]
mod skies;
#[path = "gpu/tiles.rs"]
mod tiles;
#[path = "gpu/uploads.rs"]
mod uploads;
#[path = "gpu/views.rs"]
mod views;
