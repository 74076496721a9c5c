//! Procedural scenes. All but `gallery`, `showroom`, `pool-bump`, `water-room`, `spectrum` and `bowl` have a reference
//! solution and are meshes of exactly the surfaces for which it was computed: in `assets/reference/`, or for `prism` by
//! wavelength in closed form.

mod ball;
mod basin;
mod bowl;
mod cut_glass;
mod gallery;
mod mirror;
mod paraboloid;
pub mod parts;
pub mod pool;
pub mod prism;
mod ring;
pub mod shapes;
mod showroom;
mod slab;
mod spectrum;
mod water_room;

use super::Scene;

/// Names of all built-in scenes, the program's default first.
pub const NAMES: [&str; 14] = [
    "gallery",
    "showroom",
    "ring",
    "ball",
    "pool",
    "pool-bump",
    "water-room",
    "mirror",
    "slab",
    "paraboloid",
    "nephroid",
    "prism",
    "spectrum",
    "bowl",
];

/// Builds a scene by name; `None` for an unknown one.
pub fn build(name: &str) -> Option<Scene> {
    let mut scene = match name {
        "gallery" => gallery::build(),
        "showroom" => showroom::build(),
        "ring" => ring::ring(),
        "ball" => ball::build(),
        "pool" => pool::build(),
        "pool-bump" => pool::bumped(pool::AMPLITUDE_M),
        "water-room" => water_room::build(),
        "mirror" => mirror::build(),
        "slab" => slab::build(),
        "paraboloid" => paraboloid::build(),
        "nephroid" => ring::nephroid(),
        "prism" => prism::build(),
        "spectrum" => spectrum::build(),
        "bowl" => bowl::build(),
        _ => return None,
    };
    scene.name = name.into();
    scene.source = format!("builtin:{name}");
    Some(scene)
}
