//! KHR_materials_clearcoat: a lacquer of n = 1.5 over a surface, read as what transport knows.
//!
//! Over what is matte it is a polish of that index. Over smooth metal both reflect in the same direction: the metal's
//! reflectance grows to that of both. Over polish of about the same index it has no interface of its own.

use serde::Deserialize;

use crate::optics::LinearSrgb;
use crate::scene::material::SPECULAR_ROUGHNESS_LIMIT;
use crate::scene::{Material, SurfaceKind};

/// Name of the extension.
pub const NAME: &str = "KHR_materials_clearcoat";

/// n of the lacquer, as the extension fixes it.
const IOR: f64 = 1.5;

/// Reflectance of the lacquer at normal incidence: ((n − 1)/(n + 1))².
const F0: f64 = 0.04;

/// The lacquer as the file states it; textures are named and not read.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct Coat {
    /// Part of the surface that it covers.
    pub clearcoat_factor: f32,
    /// Of its surface.
    pub clearcoat_roughness_factor: f32,
    clearcoat_texture: Option<serde_json::Value>,
    clearcoat_roughness_texture: Option<serde_json::Value>,
    clearcoat_normal_texture: Option<serde_json::Value>,
}

impl Coat {
    /// Whether an image changes it from place to place.
    pub fn has_texture(&self) -> bool {
        let textures = [
            &self.clearcoat_texture,
            &self.clearcoat_roughness_texture,
            &self.clearcoat_normal_texture,
        ];
        textures.iter().any(|texture| texture.is_some())
    }
}

/// Puts a lacquer of a factor and a roughness, both in [0, 1], over a material whose class is known.
///
/// # Errors
/// Why it has to be left out, to go after the name of the material.
pub fn put_on(material: &mut Material, factor: f64, roughness: f64) -> Result<(), String> {
    match material.surface {
        SurfaceKind::Diffuse if roughness > SPECULAR_ROUGHNESS_LIMIT => Err(format!(
            "its clearcoat of roughness {roughness:.2} was left out, as it hardly shines"
        )),
        SurfaceKind::Diffuse => {
            // What is below is matte, whatever it was.
            (material.metallic, material.transmission, material.volume) = (0.0, 0.0, None);
            (material.roughness, material.ior, material.polish) = (roughness, IOR, factor);
            material.surface = SurfaceKind::Mixed;
            Ok(())
        }
        SurfaceKind::Mirror => {
            // 1 − R = (1 − coat)(1 − metal) at normal incidence; towards grazing angles both tend to 1.
            let left = 1.0 - factor * F0;
            material.base_colour = LinearSrgb::WHITE - (LinearSrgb::WHITE - material.base_colour) * left;
            Ok(())
        }
        SurfaceKind::Mixed => {
            material.polish = factor + (1.0 - factor) * material.polish;
            Ok(())
        }
        SurfaceKind::Dielectric | SurfaceKind::ThinWall => {
            Err("its clearcoat was left out, as light goes through it".into())
        }
    }
}
