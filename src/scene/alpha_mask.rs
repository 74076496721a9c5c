//! Where a surface is cut out: glTF's alpha mode MASK.

use glam::DVec2;

use super::Texture;

/// A surface is there where its alpha, `factor` times that of its base colour texture, is at least `cutoff`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlphaMask {
    /// Alpha from which on it is there.
    pub cutoff: f64,
    /// Alpha of the base colour, [0, 1].
    pub factor: f64,
}

impl AlphaMask {
    /// Whether the surface is there at a texture coordinate; without a texture it is everywhere or nowhere.
    pub fn is_there(&self, texture: Option<(&Texture, DVec2)>) -> bool {
        let alpha = texture.map_or(1.0, |(texture, uv)| texture.alpha(uv));
        self.factor * alpha >= self.cutoff
    }
}
