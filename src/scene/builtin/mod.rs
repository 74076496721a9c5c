//! Procedural scenes. All but `showroom` and `pool-bump` have a reference solution in `assets/reference/` and are meshes of the exact
//! surfaces that it was computed on.

mod ball;
mod mirror;
mod paraboloid;
pub mod parts;
pub mod pool;
mod ring;
pub mod shapes;
mod showroom;
mod slab;

use super::Scene;

/// Names of all built-in scenes, the program's default first.
pub const NAMES: [&str; 9] = [
    "showroom",
    "ring",
    "ball",
    "pool",
    "pool-bump",
    "mirror",
    "slab",
    "paraboloid",
    "nephroid",
];

/// The scene of that name; `None` where there is none.
pub fn build(name: &str) -> Option<Scene> {
    let mut scene = match name {
        "showroom" => showroom::build(),
        "ring" => ring::ring(),
        "ball" => ball::build(),
        "pool" => pool::build(),
        "pool-bump" => pool::bumped(pool::AMPLITUDE_M),
        "mirror" => mirror::build(),
        "slab" => slab::build(),
        "paraboloid" => paraboloid::build(),
        "nephroid" => ring::nephroid(),
        _ => return None,
    };
    scene.name = name.into();
    scene.source = format!("builtin:{name}");
    Some(scene)
}
