//! Textures of materials: their coordinates, and what they vary.

use std::ops::RangeInclusive;

use glam::{DMat3, DVec2};
use gltf::json::Index;
use gltf::json::extensions::material as extension;
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::material::AlphaMode;
use gltf::json::texture::{Info, Texture};
use gltf::json::validation::Checked;
use serde::Deserialize;

use super::extras::widen;
use super::factors::{FactorImage, Factors};
use super::material::{MaterialReader, linear};
use super::spectrum;
use crate::error::Result;
use crate::optics::LinearSrgb;
use crate::scene::{AlphaMask, Material, NormalMap, SurfaceKind, TextureRef, Variation};

/// Alphas that are neither transparent nor opaque, from 10 to 90 % [codes].
const BETWEEN: RangeInclusive<u8> = 26..=229;

/// Largest share of texels with alphas [`BETWEEN`] in an image that is read as a cut-out.
const MAX_BETWEEN: f64 = 0.02;

/// Alpha at and above which a surface is opaque [codes].
const OPAQUE: u8 = 254;

impl MaterialReader<'_, '_> {
    /// Emission texture, or its mean if the emission has a spectrum.
    pub(super) fn glow(&mut self, material: &mut Material) -> Result<()> {
        let source = self.source;
        let Some(info) = source.emissive_texture.as_ref() else {
            return Ok(());
        };
        if material.emitted_radiance == LinearSrgb::BLACK {
            return Ok(());
        }
        let place = self.place_of("emissive texture", info);
        if let Some(place) = place.filter(|_| self.stated(spectrum::KEY).is_none()) {
            material.emission_texture = self.texture_at(info.index, place)?;
            return Ok(());
        }
        material.emitted_radiance = material.emitted_radiance * self.mean_of(Some(info), linear)?;
        self.warn(
            "its emissive texture was read as its mean, since it has a spectrum or coordinates that are not read",
            "use TEXCOORD_0 or TEXCOORD_1, and no spectrum",
        );
        Ok(())
    }

    /// Image of a factor texture.
    fn factor_image(&mut self, what: &str, stated: Option<&Info>) -> Result<Option<FactorImage>> {
        let Some(info) = stated else {
            return Ok(None);
        };
        let found = self.images.pixels(info.index, &self.owner, self.load)?;
        let Some((pixels, wrap, is_nearest)) = found else {
            return Ok(None);
        };
        Ok(Some(FactorImage {
            pixels,
            wrap,
            is_nearest,
            place: self.place_of(what, info),
        }))
    }

    /// Applies factor textures: as an image if they change the surface class or vary the roughness, else by their
    /// means.
    pub(super) fn vary(
        &mut self,
        material: &mut Material,
        transmission: Option<&extension::Transmission>,
    ) -> Result<()> {
        let source = self.source;
        let stated = source.pbr_metallic_roughness.metallic_roughness_texture.as_ref();
        // Factors of 0 drop what they multiply.
        let stated = stated.filter(|_| material.metallic > 0.0 || material.roughness > 0.0);
        let metallic_roughness = self.factor_image("metallic-roughness texture", stated)?;
        let stated = transmission.and_then(|transmission| transmission.transmission_texture.as_ref());
        let stated = stated.filter(|_| material.transmission > 0.0);
        let transmission = self.factor_image("transmission texture", stated)?;
        let factors = Factors {
            transmission: transmission.as_ref(),
            metallic_roughness: metallic_roughness.as_ref(),
        };
        if transmission.is_none() && metallic_roughness.is_none() {
            return Ok(());
        }

        // An image is kept where its texels matter: they change the class, or the width of the lobe.
        let mean = factors.mean();
        let class = factors.class(material);
        if let (Some(surface), Some((uv_set, uv_transform))) = (class, factors.place())
            && surface != SurfaceKind::Diffuse
        {
            let texture = factors.texture(format!("factors of {}", self.owner));
            let texture = self.images.add(texture, self.load)?;
            let image = TextureRef {
                texture,
                uv_set,
                uv_transform,
            };
            material.variation = Some(Variation { image, surface });

            // Within one class, transmission and metallic act by their means.
            if surface != SurfaceKind::Varied {
                (material.transmission, material.metallic) =
                    (material.transmission * mean.r, material.metallic * mean.b);
            }
            return Ok(());
        }

        // Elsewhere the means stand for all texels.
        (material.transmission, material.roughness, material.metallic) = (
            material.transmission * mean.r,
            material.roughness * mean.g,
            material.metallic * mean.b,
        );
        if class == Some(SurfaceKind::Diffuse) && material.classified() != SurfaceKind::Diffuse {
            // The means of diffuse metal and diffuse dielectric may fall into a specular class.
            material.roughness = 1.0;
        } else if class.is_some_and(|class| class != SurfaceKind::Diffuse) {
            self.warn(
                "its textures of transmission and of roughness follow different coordinates and were read as their means",
                "give both the same set and transform",
            );
        }
        Ok(())
    }

    /// Blended alpha: the share of the surface that is present.
    pub(super) fn blend(&mut self, material: &mut Material) {
        if !matches!(self.source.alpha_mode, Checked::Valid(AlphaMode::Blend)) {
            return;
        }
        let factor = self.share(self.source.pbr_metallic_roughness.base_color_factor.0[3], "alpha");
        let image = material.base_colour_texture.as_ref();
        let texels = image.map_or(&[][..], |image| &self.images.get(image.texture).rgba);
        let least = texels.iter().map(|texel| texel[3]).min().unwrap_or(u8::MAX);
        let between = texels.iter().filter(|texel| BETWEEN.contains(&texel[3])).count();
        if factor * f64::from(least) >= f64::from(OPAQUE) {
            return;
        }
        if material.transmission > 0.0 {
            let kept = LinearSrgb::WHITE - material.base_colour;
            material.base_colour = LinearSrgb::WHITE - kept * factor;
            self.warn(
                "its alpha was read as a lighter tint, since light goes through it already",
                "leave its alpha mode OPAQUE",
            );
        } else if factor == 1.0 && (between as f64) < MAX_BETWEEN * texels.len() as f64 {
            material.alpha_mask = Some(AlphaMask { cutoff: 0.5, factor });
        } else {
            material.coverage = Some(factor);
        }
    }

    /// Set and transform of a texture's coordinates, as of [`Self::placed`].
    fn place_of(&mut self, what: &str, info: &Info) -> Option<(usize, DMat3)> {
        let extensions = info.extensions.as_ref();
        let transform = extensions.and_then(|extensions| extensions.texture_transform.as_ref());
        self.placed(what, info.tex_coord, transform)
    }

    /// A texture of the file by these coordinates; `None`, with a warning, where it has no image.
    fn texture_at(
        &mut self,
        index: Index<Texture>,
        (uv_set, uv_transform): (usize, DMat3),
    ) -> Result<Option<TextureRef>> {
        let texture = self.images.texture(index, &self.owner, self.load)?;
        Ok(texture.map(|texture| TextureRef {
            texture,
            uv_set,
            uv_transform,
        }))
    }

    /// Set and transform of a texture's coordinates; `None`, with a warning, for a set that is not read.
    fn placed(
        &mut self,
        what: &str,
        tex_coord: u32,
        transform: Option<&TextureTransform>,
    ) -> Option<(usize, DMat3)> {
        let (uv_set, uv_transform) = coordinates(tex_coord, transform);
        if uv_set > 1 {
            self.warn(
                format!("its {what} follows TEXCOORD_{uv_set} and was left out"),
                "use TEXCOORD_0 or TEXCOORD_1",
            );
            return None;
        }
        if uv_transform.is_finite() {
            return Some((uv_set, uv_transform));
        }
        self.warn_damaged("its texture transform is not finite and was ignored");
        Some((uv_set, DMat3::IDENTITY))
    }

    pub(super) fn normal_map(&mut self) -> Result<Option<NormalMap>> {
        let Some(stated) = &self.source.normal_texture else {
            return Ok(None);
        };
        let others = stated.extensions.as_ref().map(|extensions| &extensions.others);
        let transform = others
            .and_then(|others| others.get("KHR_texture_transform"))
            .and_then(|transform| TextureTransform::deserialize(transform).ok());
        let Some(place) = self.placed("normal texture", stated.tex_coord, transform.as_ref()) else {
            return Ok(None);
        };
        let scale = widen(stated.scale);
        if !scale.is_finite() {
            self.warn_damaged("its normal texture has a scale that is not finite and was left out");
            return Ok(None);
        }
        let Some(image) = self.texture_at(stated.index, place)? else {
            return Ok(None);
        };
        let texture = self.images.get(image.texture);
        // An image that is the same everywhere, as what stands in for one that could not be read, bends nothing.
        Ok(NormalMap::new(image, scale, texture))
    }

    pub(super) fn base_colour_texture(&mut self) -> Result<Option<TextureRef>> {
        let source = self.source;
        let Some(info) = &source.pbr_metallic_roughness.base_color_texture else {
            return Ok(None);
        };
        let Some(place) = self.place_of("base colour texture", info) else {
            return Ok(None);
        };
        self.texture_at(info.index, place)
    }

    /// Cut-out by alpha, if any.
    pub(super) fn alpha_mask(&mut self) -> Option<AlphaMask> {
        let is_mask = matches!(self.source.alpha_mode, Checked::Valid(AlphaMode::Mask));
        is_mask.then(|| AlphaMask {
            cutoff: self.source.alpha_cutoff.map_or(0.5, |cutoff| f64::from(cutoff.0)),
            factor: self.share(self.source.pbr_metallic_roughness.base_color_factor.0[3], "alpha"),
        })
    }
}

/// Set and transform of a texture's coordinates.
fn coordinates(tex_coord: u32, transform: Option<&TextureTransform>) -> (usize, DMat3) {
    let Some(transform) = transform else {
        return (tex_coord as usize, DMat3::IDENTITY);
    };
    let vector = |stated: [f32; 2]| DVec2::from(stated.map(widen));
    // v runs downwards, so that the extension's counter-clockwise rotation is negative in (u, v).
    let matrix = DMat3::from_scale_angle_translation(
        vector(transform.scale.0),
        -widen(transform.rotation.0),
        vector(transform.offset.0),
    );
    (transform.tex_coord.unwrap_or(tex_coord) as usize, matrix)
}
