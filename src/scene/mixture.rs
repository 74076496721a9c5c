//! Materials that vary over a surface: the mixture of surface kinds at a point.

use super::material::{METAL_ROUGHNESS_LIMIT, Material, SPECULAR_ROUGHNESS_LIMIT, SurfaceKind};
use super::texture::TextureRef;
use crate::optics::LinearSrgb;

/// Variation of a material over a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Variation {
    /// Red, green and blue, in linear light, multiply transmission, roughness and metallic.
    pub image: TextureRef,
    /// Class of the surface: [`SurfaceKind::Varied`] unless all points are of one class.
    pub surface: SurfaceKind,
}

/// Composition of a surface at a point; `metal`, `clear`, `body` and `hole` are shares that sum to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mixture {
    /// Roughness, common to all parts.
    pub roughness: f64,
    /// Specular metal.
    pub metal: f64,
    /// Transmissive, as an interface or a pane.
    pub clear: f64,
    /// Diffuse.
    pub body: f64,
    /// Absent (alpha).
    pub hole: f64,
    /// Share of the body that is coated.
    pub polish: f64,
}

impl Material {
    /// Composition where a texture multiplies the factors by `factors`, in the order of [`Variation::image`], and the
    /// base colour texture has this alpha.
    pub fn mixture(&self, factors: LinearSrgb, alpha: f64) -> Mixture {
        let there = self.coverage.map_or(1.0, |factor| factor * alpha);
        let roughness = self.roughness * factors.g;
        let metallic = self.metallic * factors.b;
        let is_shiny = roughness <= METAL_ROUGHNESS_LIMIT;
        let metal = if is_shiny { there * metallic } else { 0.0 };
        let clear = there * (1.0 - metallic) * self.transmission * factors.r;
        Mixture {
            roughness,
            metal,
            clear,
            body: (there - metal - clear).max(0.0),
            hole: 1.0 - there,
            polish: if roughness <= SPECULAR_ROUGHNESS_LIMIT {
                self.polish
            } else {
                0.0
            },
        }
    }
}
