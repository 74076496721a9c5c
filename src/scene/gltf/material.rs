//! Materials: glTF's factors and extensions, checked, and the class that transport treats each as.

use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use glam::{DMat3, DVec2};
use gltf::json::extensions::material as extension;
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::material::{AlphaMode, Material as Source};
use gltf::json::texture::Info;
use gltf::json::validation::Checked;
use gltf::json::{Index, Value};
use serde::Deserialize;

use super::document::Document;
use super::factors::{FactorImage, Factors};
use super::images::Images;
use super::numbers::widen;
use super::report::{Budget, Report};
use super::substance::{self, Substance};
use super::{extras, names, spectrum, waves};
use crate::error::Result;
use crate::optics::LinearSrgb;
use crate::scene::material::SPECULAR_ROUGHNESS_LIMIT;
use crate::scene::{AlphaMask, Material, NormalMap, SurfaceKind, TextureRef, Variation, Volume};
use crate::units::LUMENS_PER_WATT;

/// What a primitive without a material has: glTF's default material is a rough metal, which is taken for matte.
pub fn default() -> Material {
    Material {
        name: "default".into(),
        base_colour: LinearSrgb::WHITE,
        double_sided: false,
        ..Material::default()
    }
}

/// Whether it lets light through without being the surface of a body.
pub fn is_thin(material: &Material) -> bool {
    material.transmits() && material.volume.is_none()
}

/// Makes a thin wall clear solid glass.
pub fn make_solid(thin: &mut Material) {
    thin.volume = Some(CLEAR);
    thin.surface = thin.classified();
    thin.is_solid_by_shape = true;
}

/// A thin wall as clear solid glass.
pub fn solid_twin(thin: &Material) -> Material {
    let mut solid = thin.clone();
    solid.name += " (solid)";
    make_solid(&mut solid);
    solid
}

/// The thin wall of which clear solid glass was made.
pub fn thin_twin(solid: &Material) -> Material {
    let mut thin = Material {
        name: format!("{} (thin)", solid.name),
        volume: None,
        is_solid_by_shape: false,
        ..solid.clone()
    };
    thin.surface = thin.classified();
    thin
}

const CLEAR: Volume = Volume {
    attenuation_distance_m: f64::INFINITY,
    attenuation_colour: LinearSrgb::WHITE,
};

/// glTF's refractive index where a material states none.
const DEFAULT_IOR: f64 = 1.5;

/// The least that an attenuation colour lets through: black would need an infinite absorption.
const DARKEST_ATTENUATION: f64 = 1e-6;

/// Alphas that are neither there nor not [codes].
const BETWEEN: RangeInclusive<u8> = 26..=229;

/// A texture whose alpha is between in no more than this part of it cuts out.
const MAX_BETWEEN: f64 = 0.02;

/// Alpha from which on nothing is seen through a surface [codes].
const OPAQUE: u8 = 254;

/// All materials, in file order.
///
/// # Errors
/// Images that do not fit the memory budget.
pub fn read_all(
    document: &Document,
    folder: &Path,
    images: &mut Images,
    budget: &mut Budget,
    report: &mut Report,
) -> Result<Vec<Material>> {
    let sources = document.root.materials.iter().enumerate();
    sources
        .map(|(index, source)| {
            let name = names::name(source.name.as_ref(), "material", index);
            let stated = |key: &str| extras::stated(&document.extras.materials, index, key);
            let mut reading = Reading {
                owner: format!("material `{name}`"),
                source,
                waves: stated(waves::KEY),
                glass: stated(substance::GLASS_KEY),
                metal: stated(substance::METAL_KEY),
                spectrum: stated(spectrum::KEY),
                folder,
                images: &mut *images,
                budget: &mut *budget,
                report: &mut *report,
            };
            reading.read(name)
        })
        .collect()
}

struct Reading<'a, 'b> {
    owner: String,
    source: &'a Source,
    /// As its extras state them.
    waves: Option<&'a Value>,
    glass: Option<&'a Value>,
    metal: Option<&'a Value>,
    spectrum: Option<&'a Value>,
    /// Where the file is.
    folder: &'a Path,
    images: &'a mut Images<'b>,
    budget: &'a mut Budget,
    report: &'a mut Report,
}

impl Reading<'_, '_> {
    fn read(&mut self, name: String) -> Result<Material> {
        let none = extension::Material::default();
        let extensions = self.source.extensions.as_ref().unwrap_or(&none);
        let pbr = &self.source.pbr_metallic_roughness;
        let [red, green, blue, _] = pbr.base_color_factor.0;
        let transmission = extensions.transmission.as_ref();
        let mut material = Material {
            name,
            surface: SurfaceKind::Diffuse,
            base_colour: self.colour([red, green, blue], "base colour"),
            base_colour_texture: self.base_colour_texture()?,
            alpha_mask: self.alpha_mask(),
            coverage: None,
            variation: None,
            metallic: self.share(pbr.metallic_factor.0, "metallic factor"),
            roughness: self.share(pbr.roughness_factor.0, "roughness factor"),
            transmission: self.share(
                transmission.map_or(0.0, |transmission| transmission.transmission_factor.0),
                "transmission factor",
            ),
            ior: self.ior(extensions),
            glass: None,
            metal: None,
            volume: self.volume(extensions),
            is_solid_by_shape: false,
            emitted_radiance: self.emission(extensions),
            emission_texture: None,
            emission_spectrum: None,
            polish: 1.0,
            normal_map: None,
            waves: self
                .waves
                .and_then(|waves| waves::read(waves, &self.owner, self.report)),
            double_sided: self.source.double_sided,
        };
        self.vary(&mut material, transmission)?;
        self.blend(&mut material);
        self.glow(&mut material)?;
        self.emission_spectrum(&mut material)?;
        self.substance(&mut material, extensions)?;
        material.surface = if extensions.unlit.is_none() {
            self.classify(&material)
        } else if material.coverage.is_some() {
            (material.metallic, material.roughness, material.transmission) = (0.0, 1.0, 0.0);
            material.variation = None;
            SurfaceKind::Varied
        } else {
            SurfaceKind::Diffuse
        };
        if !material.transmits() {
            material.volume = None;
        }
        let is_polish = matches!(material.surface, SurfaceKind::Mixed | SurfaceKind::Varied);
        if let (true, Some(specular)) = (is_polish, &extensions.specular) {
            material.polish = self.share(specular.specular_factor.0, "specular factor");
        }
        self.coat(&mut material, extensions);
        material.normal_map = self.normal_map(&material)?;
        self.name_what_is_ignored(extensions, &material, is_polish);
        Ok(material)
    }

    fn warn(&mut self, what: impl Into<String>, remedy: &str) {
        self.report.warn(self.owner.clone(), what, remedy);
    }

    /// A factor brought into [0, 1]; what is no number counts as 0.
    fn share(&mut self, value: f32, what: &str) -> f64 {
        let read = if value.is_nan() {
            0.0
        } else {
            widen(value.clamp(0.0, 1.0))
        };
        if read != widen(value) {
            self.warn(
                format!("its {what} of {value} was read as {read}"),
                "use a value from 0 to 1",
            );
        }
        read
    }

    fn colour(&mut self, channels: [f32; 3], what: &str) -> LinearSrgb {
        channels.map(|channel| self.share(channel, what)).into()
    }

    fn ior(&mut self, extensions: &extension::Material) -> f64 {
        let Some(stated) = extensions.ior.as_ref().map(|ior| widen(ior.ior.0)) else {
            return DEFAULT_IOR;
        };
        if stated >= 1.0 && stated.is_finite() {
            return stated;
        }
        let why = if stated == 0.0 {
            " (which only stands for full reflection)"
        } else {
            ""
        };
        self.warn(
            format!("its refractive index of {stated}{why} was read as {DEFAULT_IOR}"),
            "use a value of at least 1",
        );
        DEFAULT_IOR
    }

    fn volume(&mut self, extensions: &extension::Material) -> Option<Volume> {
        let stated = extensions.volume.as_ref()?;
        let thickness = stated.thickness_factor.0;
        if thickness < 0.0 || !thickness.is_finite() {
            self.warn(
                format!("its thickness of {thickness} was read as 0"),
                "use a positive thickness",
            );
            return None;
        }
        if thickness == 0.0 {
            return None;
        }
        let mut distance = widen(stated.attenuation_distance.0);
        if distance.is_nan() || distance <= 0.0 {
            self.warn(
                format!("its attenuation distance of {distance} was read as infinite"),
                "use a positive distance",
            );
            distance = f64::INFINITY;
        }
        let colour = self.colour(stated.attenuation_color.0, "attenuation colour");
        if distance.is_finite()
            && colour
                .to_array()
                .iter()
                .any(|channel| *channel < DARKEST_ATTENUATION)
        {
            self.warn(
                format!("its attenuation colour was raised to at least {DARKEST_ATTENUATION:e}"),
                "use a shorter attenuation distance for darker glass",
            );
        }
        Some(Volume {
            attenuation_distance_m: distance,
            attenuation_colour: colour.map(|channel| channel.max(DARKEST_ATTENUATION)),
        })
    }

    /// glTF's cd/m² as luminous-equivalent W/(m² sr).
    fn emission(&mut self, extensions: &extension::Material) -> LinearSrgb {
        let mut strength = extensions
            .emissive_strength
            .as_ref()
            .map_or(1.0, |emission| widen(emission.emissive_strength.0));
        if !(strength >= 0.0 && strength.is_finite()) {
            self.warn(
                format!("its emissive strength of {strength} was read as 0"),
                "use a positive strength",
            );
            strength = 0.0;
        }
        let factor = self.colour(self.source.emissive_factor.0, "emissive factor");
        factor * (strength / LUMENS_PER_WATT)
    }

    /// The image of what it emits, or its mean where the graphics card could not place it.
    fn glow(&mut self, material: &mut Material) -> Result<()> {
        let source = self.source;
        let Some(info) = source.emissive_texture.as_ref() else {
            return Ok(());
        };
        if material.emitted_radiance == LinearSrgb::BLACK {
            return Ok(());
        }
        let transform = info
            .extensions
            .as_ref()
            .and_then(|extensions| extensions.texture_transform.as_ref());
        let place = self.placed("emissive texture", info.tex_coord, transform);
        let others = material.coordinates();
        let is_coloured = self.spectrum.is_none();
        let fits =
            is_coloured && others.is_none_or(|other| place == Some((other.uv_set, other.uv_transform)));
        if let Some((uv_set, uv_transform)) = place.filter(|_| fits) {
            let found = self
                .images
                .texture(info.index, &self.owner, self.budget, self.report)?;
            material.emission_texture = found.map(|texture| TextureRef {
                texture,
                uv_set,
                uv_transform,
            });
            return Ok(());
        }
        let linear = |[r, g, b, _]: [u8; 4]| [r, g, b].map(LinearSrgb::decode_channel).into();
        let mean = self
            .images
            .mean(info.index, linear, &self.owner, self.budget, self.report)?;
        material.emitted_radiance = material.emitted_radiance * mean.unwrap_or(LinearSrgb::WHITE);
        self.warn(
            "its emissive texture was read as its mean, since it has other coordinates than its others or a spectrum",
            "give all of its textures the same set and transform",
        );
        Ok(())
    }

    /// Gives what it emits the spectrum that is stated for it, if any, in place of its colour.
    fn emission_spectrum(&mut self, material: &mut Material) -> Result<()> {
        let Some(stated) = self.spectrum else {
            return Ok(());
        };
        let spectrum = spectrum::read(stated, self.folder, &self.owner)?;
        let LinearSrgb { r, g, b } = material.emitted_radiance;
        if material.emitted_radiance == LinearSrgb::BLACK {
            self.warn(
                format!("has a `{}` but sends no light", spectrum::KEY),
                "give it an emissive factor",
            );
        } else if r != g || g != b {
            self.warn(
                format!(
                    "the colour of its light was left out, since it has a `{}`",
                    spectrum::KEY
                ),
                "leave the emissive factor grey",
            );
        }
        let luminance = material.emitted_radiance.luminance();
        material.emitted_radiance = spectrum.xyz().to_linear_srgb() * luminance;
        material.emission_spectrum = Some(spectrum);
        Ok(())
    }

    /// The image of a texture of factors.
    fn factor_image(&mut self, what: &str, stated: Option<&Info>) -> Result<Option<FactorImage>> {
        let Some(info) = stated else {
            return Ok(None);
        };
        let found = self
            .images
            .pixels(info.index, &self.owner, self.budget, self.report)?;
        let Some((pixels, wrap)) = found else {
            return Ok(None);
        };
        let extensions = info.extensions.as_ref();
        let transform = extensions.and_then(|extensions| extensions.texture_transform.as_ref());
        Ok(Some(FactorImage {
            pixels,
            wrap,
            place: self.placed(what, info.tex_coord, transform),
        }))
    }

    /// Takes over the textures of factors: as an image where that changes what the surface does, else as their means.
    fn vary(
        &mut self,
        material: &mut Material,
        transmission: Option<&extension::Transmission>,
    ) -> Result<()> {
        let source = self.source;
        let stated = source.pbr_metallic_roughness.metallic_roughness_texture.as_ref();
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
        let mean = factors.mean();
        let class = factors.class(material);
        let colour = material.base_colour_texture.as_ref();
        let place = factors.place(colour.map(|colour| (colour.uv_set, colour.uv_transform)));
        if let (Some(surface), Some((uv_set, uv_transform))) = (class, place)
            && surface != SurfaceKind::Diffuse
        {
            let texture = factors.texture(format!("factors of {}", self.owner));
            let texture = self.images.add(texture, self.budget)?;
            let image = TextureRef {
                texture,
                uv_set,
                uv_transform,
            };
            material.variation = Some(Variation { image, surface });
            if surface != SurfaceKind::Varied {
                (material.transmission, material.metallic) =
                    (material.transmission * mean.r, material.metallic * mean.b);
            }
            return Ok(());
        }
        (material.transmission, material.roughness, material.metallic) = (
            material.transmission * mean.r,
            material.roughness * mean.g,
            material.metallic * mean.b,
        );
        if class == Some(SurfaceKind::Diffuse) && material.classified() != SurfaceKind::Diffuse {
            // Matte metal and matte body may have a shining mean.
            material.roughness = 1.0;
        } else if class.is_some_and(|class| class != SurfaceKind::Diffuse) {
            self.warn(
                format!(
                    "its textures of factors follow different coordinates and were read as their means, metallic {:.2}, \
                     roughness {:.2} and transmission {:.2}",
                    material.metallic, material.roughness, material.transmission
                ),
                "give all of its textures the same set and transform",
            );
        }
        Ok(())
    }

    /// Alpha that blends: what part of the surface is there.
    fn blend(&mut self, material: &mut Material) {
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

    /// What it is made of: as its extras say, else by KHR_materials_dispersion.
    fn substance(&mut self, material: &mut Material, extensions: &extension::Material) -> Result<()> {
        match substance::read(self.glass, self.metal, &self.owner)? {
            Some(Substance::Glass(glass)) => material.set_glass(Arc::new(glass)),
            Some(Substance::Metal(metal)) => {
                if let Some(factor) = material.set_metal(metal) {
                    self.warn(
                        format!(
                            "{} lies outside of sRGB, and its colour was multiplied by {factor:.3}",
                            metal.name()
                        ),
                        "nothing needs to be done",
                    );
                }
            }
            None => {
                let stated = extensions.others.get(substance::NAME);
                match stated.map_or(Ok(None), |stated| substance::dispersion(material.ior, stated)) {
                    Ok(glass) => material.glass = glass.map(Arc::new),
                    Err(why) => self.warn(why, "state 20 by the Abbe number, or 0"),
                }
            }
        }
        Ok(())
    }

    /// The material's class, with a word on what is not as the file has it.
    fn classify(&mut self, material: &Material) -> SurfaceKind {
        let surface = material.classified();
        let roughness = material.roughness;
        let is_metal = material.metallic >= 0.5;
        match surface {
            // Metallic 1 with roughness 1 is what glTF assumes where a file says nothing.
            SurfaceKind::Diffuse if is_metal && (roughness < 1.0 || material.metal.is_some()) => self.warn(
                format!("is a metal of roughness {roughness:.2}, treated as matte"),
                "make it smoother to have it reflect light",
            ),
            SurfaceKind::Mirror | SurfaceKind::Diffuse | SurfaceKind::Mixed if material.glass.is_some() => {
                self.warn(
                    "is of a glass but lets no light through, so that none is dispersed",
                    "give it transmission and a volume",
                )
            }
            SurfaceKind::Varied if material.glass.is_some() => self.warn(
                "changes from place to place, so that its glass disperses nothing",
                "split the mesh where the material changes",
            ),
            _ => {}
        }
        surface
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
        self.warn(
            "its texture transform is not finite and was ignored",
            "export the file again",
        );
        Some((uv_set, DMat3::IDENTITY))
    }

    /// A lacquer over the surface, where the file has one.
    fn coat(&mut self, material: &mut Material, extensions: &extension::Material) {
        let Some(stated) = extensions.others.get(CLEARCOAT) else {
            return;
        };
        let Ok(stated) = Coat::deserialize(stated) else {
            return self.warn(
                "its clearcoat cannot be read and was left out",
                "export the file again",
            );
        };
        let factor = self.share(stated.clearcoat_factor, "clearcoat factor");
        let roughness = self.share(stated.clearcoat_roughness_factor, "clearcoat roughness");
        if factor == 0.0 || extensions.unlit.is_some() {
            return;
        }
        if stated.has_texture() {
            self.warn(
                "its clearcoat is read by its factors alone, without textures",
                "split the mesh where the lacquer changes",
            );
        }
        if let Err(why) = put_on(material, factor, roughness) {
            self.warn(why, "expect it to look and bake as if it were not there");
        }
    }

    /// What bends the normals of a specular surface.
    fn normal_map(&mut self, material: &Material) -> Result<Option<NormalMap>> {
        let source = self.source;
        let Some(stated) = source
            .normal_texture
            .as_ref()
            .filter(|_| material.surface.is_specular())
        else {
            return Ok(None);
        };
        let others = stated.extensions.as_ref().map(|extensions| &extensions.others);
        let transform = others
            .and_then(|others| others.get("KHR_texture_transform"))
            .and_then(|transform| TextureTransform::deserialize(transform).ok());
        let Some((uv_set, uv_transform)) =
            self.placed("normal texture", stated.tex_coord, transform.as_ref())
        else {
            return Ok(None);
        };
        let scale = widen(stated.scale);
        let colour = material.coordinates();
        // The graphics card has one set of coordinates for each surface.
        if colour.is_some_and(|colour| (colour.uv_set, colour.uv_transform) != (uv_set, uv_transform)) {
            self.warn(
                "its normal texture follows other coordinates than its base colour and was left out",
                "give both the same set and transform",
            );
            return Ok(None);
        }
        if !scale.is_finite() {
            self.warn(
                "its normal texture has a scale that is not finite and was left out",
                "export the file again",
            );
            return Ok(None);
        }
        let index = Index::new(stated.index.value() as u32);
        let texture = self
            .images
            .texture(index, &self.owner, self.budget, self.report)?;
        let Some(texture) = texture else {
            return Ok(None);
        };
        let image = TextureRef {
            texture,
            uv_set,
            uv_transform,
        };
        let map = NormalMap::new(image, scale, self.images.get(texture));
        // Also what stands in for an image that could not be read.
        if map.detail_texels == f64::INFINITY {
            self.warn(
                "its normal texture is the same everywhere and was left out",
                "give it some relief, or none",
            );
            return Ok(None);
        }
        Ok(Some(map))
    }

    fn base_colour_texture(&mut self) -> Result<Option<TextureRef>> {
        let source = self.source;
        let Some(info) = &source.pbr_metallic_roughness.base_color_texture else {
            return Ok(None);
        };
        let transform = info
            .extensions
            .as_ref()
            .and_then(|extensions| extensions.texture_transform.as_ref());
        let Some((uv_set, uv_transform)) = self.placed("base colour texture", info.tex_coord, transform)
        else {
            return Ok(None);
        };
        let texture = Index::new(info.index.value() as u32);
        let texture = self
            .images
            .texture(texture, &self.owner, self.budget, self.report)?;
        Ok(texture.map(|texture| TextureRef {
            texture,
            uv_set,
            uv_transform,
        }))
    }

    /// Where the surface is cut out, if it is.
    fn alpha_mask(&mut self) -> Option<AlphaMask> {
        let is_mask = matches!(self.source.alpha_mode, Checked::Valid(AlphaMode::Mask));
        is_mask.then(|| AlphaMask {
            cutoff: self.source.alpha_cutoff.map_or(0.5, |cutoff| f64::from(cutoff.0)),
            factor: self.share(self.source.pbr_metallic_roughness.base_color_factor.0[3], "alpha"),
        })
    }

    fn name_what_is_ignored(
        &mut self,
        extensions: &extension::Material,
        material: &Material,
        is_polish: bool,
    ) {
        let is_matte = !material.surface.is_specular();
        match self.source.alpha_mode {
            Checked::Valid(_) => {}
            Checked::Invalid => self.warn(
                "its alpha mode is unknown and was read as opaque",
                "export the file again",
            ),
        }
        let changed_specular = extensions.specular.as_ref().is_some_and(|specular| {
            (specular.specular_factor.0 != 1.0 && !is_polish)
                || specular.specular_color_factor.0 != [1.0; 3]
                || specular.specular_texture.is_some()
                || specular.specular_color_texture.is_some()
        });
        let mut ignored = Vec::new();
        if changed_specular {
            ignored.push("KHR_materials_specular".to_owned());
        }
        if is_matte && self.source.normal_texture.is_some() {
            ignored.push("normal texture, as it is matte,".to_owned());
        }
        ignored.extend(
            extensions
                .others
                .keys()
                .filter(|key| ![CLEARCOAT, substance::NAME].contains(&key.as_str()))
                .map(|key| names::name(Some(key), "extension", 0)),
        );
        if !ignored.is_empty() {
            self.warn(
                format!("its {} was ignored", ignored.join(", ")),
                "expect it to look and bake as if it were not there",
            );
        }
    }
}

/// Set and transform of a texture's coordinates.
fn coordinates(tex_coord: u32, transform: Option<&TextureTransform>) -> (usize, DMat3) {
    let Some(transform) = transform else {
        return (tex_coord as usize, DMat3::IDENTITY);
    };
    let vector = |[x, y]: [f32; 2]| DVec2::new(widen(x), widen(y));
    // v runs downwards, so that the extension's counter-clockwise turn is a negative one in (u, v).
    let matrix = DMat3::from_scale_angle_translation(
        vector(transform.scale.0),
        -widen(transform.rotation.0),
        vector(transform.offset.0),
    );
    (transform.tex_coord.unwrap_or(tex_coord) as usize, matrix)
}

/// Name of the extension.
const CLEARCOAT: &str = "KHR_materials_clearcoat";

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
    clearcoat_texture: Option<Value>,
    clearcoat_roughness_texture: Option<Value>,
    clearcoat_normal_texture: Option<Value>,
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
pub fn put_on(material: &mut Material, factor: f64, roughness: f64) -> std::result::Result<(), String> {
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
        SurfaceKind::Varied => Err("its clearcoat was left out, as what it covers varies".into()),
    }
}
