//! KHR_materials_clearcoat: a clear coat over a surface.

use gltf::json::Value;
use gltf::json::extensions::material as extension;
use gltf::json::texture::Info;
use serde::Deserialize;

use super::material::MaterialReader;
use crate::error::Result;
use crate::optics::LinearSrgb;
use crate::scene::material::SPECULAR_ROUGHNESS_LIMIT;
use crate::scene::{Material, SurfaceKind};

pub const NAME: &str = "KHR_materials_clearcoat";

/// Refractive index of the coat, fixed by the extension.
const IOR: f64 = 1.5;

/// Reflectance of the coat at normal incidence: ((n − 1)/(n + 1))².
const F0: f64 = 0.04;

impl MaterialReader<'_, '_> {
    /// Adds the clear coat that the file states, if any.
    ///
    /// # Errors
    /// Images that do not fit the memory budget.
    pub(super) fn coat(&mut self, material: &mut Material, extensions: &extension::Material) -> Result<()> {
        let Some(stated) = extensions.others.get(NAME) else {
            return Ok(());
        };
        let Ok(stated) = Coat::deserialize(stated) else {
            self.warn_damaged("its clearcoat cannot be read and was left out");
            return Ok(());
        };

        // A coat of factor 0, and one over an unlit surface, reflects nothing.
        let mut factor = self.share(stated.clearcoat_factor, "clearcoat factor");
        let mut roughness = self.share(stated.clearcoat_roughness_factor, "clearcoat roughness");
        if factor == 0.0 || extensions.unlit.is_some() {
            return Ok(());
        }

        // The factor is in the red channel, roughness in the green one, both linear.
        let of = |code: u8| LinearSrgb::grey(f64::from(code) / 255.0);
        let textures = [&stated.clearcoat_texture, &stated.clearcoat_roughness_texture];
        factor *= self.mean_of(textures[0].as_ref(), |[red, ..]| of(red))?.r;
        roughness *= self.mean_of(textures[1].as_ref(), |[_, green, ..]| of(green))?.r;
        if textures.iter().any(|texture| texture.is_some()) {
            self.warn(
                "its clearcoat's textures were read as their means",
                "split the mesh where the lacquer changes",
            );
        }
        if stated.clearcoat_normal_texture.is_some() {
            self.warn(
                "its clearcoat's normal texture was ignored",
                "expect it to look and bake as if it were not there",
            );
        }

        // A surface has one lobe of reflection, as wide for the coat as for what it covers.
        if let Err(why) = apply_coat(material, factor, roughness) {
            self.warn(why, "expect it to look and bake as if it were not there");
        } else if (material.roughness - roughness).abs() > UNLIKE {
            self.warn(
                "its clearcoat was read as rough as what it covers",
                "give both the same roughness",
            );
        }
        Ok(())
    }
}

/// Smallest difference of roughness that is visible.
const UNLIKE: f64 = 0.1;

/// A clear coat as stated in the file.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Coat {
    /// Share of the surface that is coated.
    clearcoat_factor: f32,
    clearcoat_roughness_factor: f32,
    clearcoat_texture: Option<Info>,
    clearcoat_roughness_texture: Option<Info>,
    clearcoat_normal_texture: Option<Value>,
}

/// Adds a coat to a material whose class is known; factor and roughness in [0, 1].
///
/// # Errors
/// Reason why the coat is left out, to follow the name of the material.
fn apply_coat(material: &mut Material, factor: f64, roughness: f64) -> std::result::Result<(), String> {
    match material.surface {
        SurfaceKind::Diffuse if roughness > SPECULAR_ROUGHNESS_LIMIT => {
            Err("its clearcoat was left out, as it is rough and hardly shines".into())
        }
        SurfaceKind::Diffuse => {
            // The body below the coat is diffuse, whatever it was.
            (material.metallic, material.transmission, material.volume) = (0.0, 0.0, None);
            (material.roughness, material.ior, material.coat) = (roughness, IOR, factor);
            material.surface = SurfaceKind::Coated;
            Ok(())
        }
        SurfaceKind::Mirror => {
            // 1 − R = (1 − coat)(1 − metal) at normal incidence; towards grazing angles both tend to 1.
            let left = 1.0 - factor * F0;
            material.base_colour = LinearSrgb::WHITE - (LinearSrgb::WHITE - material.base_colour) * left;
            Ok(())
        }
        SurfaceKind::Coated => {
            material.coat = factor + (1.0 - factor) * material.coat;
            Ok(())
        }
        SurfaceKind::Dielectric | SurfaceKind::ThinWall => {
            Err("its clearcoat was left out, as light goes through it".into())
        }
        SurfaceKind::Varied => Err("its clearcoat was left out, as what it covers varies".into()),
    }
}
