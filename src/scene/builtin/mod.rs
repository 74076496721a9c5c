//! Procedural scenes. All but `gallery`, `showroom`, `pool-bump`, `water-room`, `spectrum` and `bowl` have a reference
//! solution and are meshes of exactly the surfaces for which it was computed: in `assets/reference/`, or for `prism` by
//! wavelength in closed form.

mod cut_glass;
mod gallery;
pub mod parts;
pub mod pool;
pub mod prism;
mod reference;
pub mod shapes;
mod showroom;
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
        "ring" => reference::ring(),
        "ball" => reference::ball(),
        "pool" => pool::build(),
        "pool-bump" => pool::bumped(pool::AMPLITUDE_M),
        "water-room" => water_room::build(),
        "mirror" => reference::mirror(),
        "slab" => reference::slab(),
        "paraboloid" => reference::paraboloid(),
        "nephroid" => reference::nephroid(),
        "prism" => prism::build(),
        "spectrum" => prism::spectrum(),
        "bowl" => cut_glass::bowl(),
        _ => return None,
    };
    scene.name = name.into();
    scene.source = format!("builtin:{name}");
    Some(scene)
}
