//! Materials that vary over a surface: the mixture of surface kinds at a point.

use super::material::{METAL_ROUGHNESS_LIMIT, Material, SPECULAR_ROUGHNESS_LIMIT, SurfaceKind};
use super::texture::TextureRef;
use crate::optics::LinearSrgb;

/// How a material changes from place to place.
#[derive(Clone, Debug, PartialEq)]
pub struct Variation {
    /// Its red, green and blue, in linear light, multiply transmission, roughness and metallic.
    pub image: TextureRef,
    /// The class of the surface: [`SurfaceKind::Varied`] unless all places are of one.
    pub surface: SurfaceKind,
}

/// What a place of a surface is made of: shares that add up to one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mixture {
    /// Of all of it.
    pub roughness: f64,
    /// Smooth enough to reflect.
    pub metal: f64,
    /// Lets light through, as an interface or a pane.
    pub clear: f64,
    /// Scatters light diffusely.
    pub body: f64,
    /// Is not there.
    pub hole: f64,
    /// Part of the body that is polished.
    pub polish: f64,
}

impl Material {
    /// What it is made of where its factors are multiplied by `factors`, in the order of [`Variation::image`], and where
    /// the image of its base colour has an alpha.
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
