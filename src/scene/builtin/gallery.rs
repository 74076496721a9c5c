//! `gallery`: a bath house by the sea in low sun, as `assets/gallery/gallery.py` writes it.

use std::sync::Arc;

use crate::scene::{Environment, Scene, gltf};

/// Radiance around the sun [W/(m² sr)]. The painted sky has an opening there, which lets the sun in.
const GLOW: [f32; 3] = [1.9, 1.6, 1.15];

/// A room of 3.7 m × 7 m with a table, a pool and an open arch; one sun, and one lamp that lights the painted sky.
pub fn build() -> Scene {
    let file = include_bytes!("../../../assets/gallery/gallery.glb");
    let mut scene = gltf::embedded(file);
    // That the colour of gold lies outside of sRGB is nothing that the user could mend.
    scene
        .warnings
        .retain(|warning| !warning.what.contains("Gold lies outside of sRGB"));
    scene.environment = Environment::new(1, 1, vec![GLOW]).map(Arc::new);
    scene
}
