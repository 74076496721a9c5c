//! Materials: glTF's factors and extensions, validated, and the surface kind of each.

use std::path::Path;
use std::sync::Arc;

use gltf::json::extensions::material as extension;
use gltf::json::material::Material as Source;
use gltf::json::texture::{Info, Texture};
use gltf::json::validation::Checked;
use gltf::json::{Index, Value};

use super::context::LoadContext;
use super::document::Document;
use super::extras::widen;
use super::images::Images;
use super::substance::{self, Composition};
use super::{coat, extensions, extras, spectrum, waves};
use crate::error::Result;
use crate::optics::LinearSrgb;
use crate::scene::material::{METAL_ROUGHNESS_LIMIT, SPECULAR_ROUGHNESS_LIMIT};
use crate::scene::{Material, SurfaceKind, Volume};
use crate::units::LUMENS_PER_WATT;

/// Material of a primitive without one: glTF's default is a rough metal, which is read as diffuse.
pub fn default() -> Material {
    Material {
        name: "default".into(),
        base_colour: LinearSrgb::WHITE,
        double_sided: false,
        ..Material::default()
    }
}

/// Makes a transmissive material solid, by its mesh or by the file, or thin.
pub fn set_interior(material: &mut Material, interior: Option<Volume>, is_by_shape: bool) {
    material.volume = interior;
    material.is_solid_by_shape = interior.is_some() && is_by_shape;
    material.surface = material.classified();
}

/// Interior of glass of which the file states none.
pub const CLEAR: Volume = Volume {
    attenuation_distance_m: f64::INFINITY,
    attenuation_colour: LinearSrgb::WHITE,
};

/// glTF's refractive index where a material states none.
const DEFAULT_IOR: f64 = 1.5;

/// Smallest attenuation colour: black would need infinite absorption.
const DARKEST_ATTENUATION: f64 = 1e-6;

/// All materials, in file order.
///
/// # Errors
/// Images that do not fit the memory budget.
pub fn read_all(
    document: &Document,
    folder: &Path,
    images: &mut Images,
    load: &mut LoadContext,
) -> Result<Vec<Material>> {
    let sources = &document.root.materials;
    images.decode_ahead(sources.iter().flat_map(textures), load)?;
    let mut materials = Vec::with_capacity(sources.len());
    for (index, source) in sources.iter().enumerate() {
        let name = extras::name(source.name.as_deref(), "material", index);
        let mut reading = MaterialReader::new((document, index), folder, images, load);
        materials.push(reading.read(name)?);
    }
    Ok(materials)
}

/// Whether a stated thickness is one; without it, the mesh decides what is solid.
fn is_thick(thickness: f32) -> bool {
    thickness > 0.0 && thickness.is_finite()
}

/// Textures that a material is read with, whatever it is made of.
fn textures(source: &Source) -> impl Iterator<Item = Index<Texture>> {
    let pbr = &source.pbr_metallic_roughness;
    let glows = source.emissive_factor.0 != [0.0; 3];
    let emission = source.emissive_texture.as_ref().filter(|_| glows);
    let infos = [&pbr.base_color_texture, &pbr.metallic_roughness_texture];
    let infos = infos.into_iter().flatten().chain(emission);
    let normals = source.normal_texture.as_ref().map(|normals| normals.index);
    infos.map(|info| info.index).chain(normals)
}

/// The colour of a texel, in linear light.
pub(super) fn linear([r, g, b, _]: [u8; 4]) -> LinearSrgb {
    [r, g, b].map(LinearSrgb::decode_channel).into()
}

/// A material while it is read.
pub struct MaterialReader<'a, 'b> {
    pub owner: String,
    pub source: &'a Source,
    extras: Option<&'a Value>,
    /// Folder of the file.
    pub folder: &'a Path,
    pub images: &'a mut Images<'b>,
    pub load: &'a mut LoadContext,
}

impl<'a, 'b> MaterialReader<'a, 'b> {
    fn new(
        (document, index): (&'a Document, usize),
        folder: &'a Path,
        images: &'a mut Images<'b>,
        load: &'a mut LoadContext,
    ) -> Self {
        let source = &document.root.materials[index];
        let name = extras::name(source.name.as_deref(), "material", index);
        Self {
            owner: format!("material `{name}`"),
            source,
            extras: document.extras.materials.get(index),
            folder,
            images,
            load,
        }
    }
}

impl<'a> MaterialReader<'a, '_> {
    /// Value in the extras.
    pub(super) fn stated(&self, key: &str) -> Option<&'a Value> {
        self.extras?.get(key)
    }

    fn read(&mut self, name: String) -> Result<Material> {
        // Factors come first; textures, alpha and substances multiply or replace them.
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
            // Without a thickness, the mesh decides.
            is_solid_by_shape: extensions
                .volume
                .as_ref()
                .is_some_and(|volume| !is_thick(volume.thickness_factor.0)),
            emitted_radiance: self.emission(extensions),
            emission_texture: None,
            emission_spectrum: None,
            coat: 1.0,
            coat_roughness_limit: SPECULAR_ROUGHNESS_LIMIT,
            normal_map: self.normal_map()?,
            waves: self
                .stated(waves::KEY)
                .and_then(|waves| waves::read(waves, &self.owner, self.load)),
            double_sided: self.source.double_sided,
        };

        // The order counts: blending needs the transmission after its texture, a spectrum the emission after its own.
        self.vary(&mut material, transmission)?;
        self.blend(&mut material);
        self.glow(&mut material)?;
        self.emission_spectrum(&mut material)?;
        self.substance(&mut material, extensions)?;

        // Unlit materials have no reflections: they are diffuse, or matte with holes where their alpha blends.
        material.surface = if extensions.unlit.is_none() {
            self.classify(&material)
        } else if material.coverage.is_some() {
            (material.metallic, material.roughness, material.transmission) = (0.0, 1.0, 0.0);
            material.variation = None;
            SurfaceKind::Varied
        } else {
            material.coat = 0.0;
            SurfaceKind::Diffuse
        };

        // Only what transmits light has an interior.
        if !material.transmits() {
            material.volume = None;
        }
        material.is_solid_by_shape &= material.volume.is_some();

        // What covers a surface depends on its class.
        let is_coat = matches!(material.seen_surface(), SurfaceKind::Coated | SurfaceKind::Varied);
        if let (true, Some(specular)) = (is_coat, &extensions.specular) {
            material.coat = self.specular_weight(specular)?;
        }
        self.coat(&mut material, extensions)?;
        self.warn_of_ignored(extensions, &material);
        Ok(material)
    }

    pub(super) fn warn(&mut self, what: impl Into<String>, remedy: &str) {
        self.load.warn(&self.owner, what, remedy);
    }

    pub(super) fn warn_damaged(&mut self, what: impl Into<String>) {
        self.load.warn_damaged(&self.owner, what);
    }

    /// Clamps a factor to [0, 1]; NaN becomes 0.
    pub(super) fn share(&mut self, value: f32, what: &str) -> f64 {
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

    /// Factor on the reflection of a coat, by KHR_materials_specular.
    fn specular_weight(&mut self, stated: &extension::Specular) -> Result<f64> {
        let factor = self.share(stated.specular_factor.0, "specular factor");
        let colour = LinearSrgb::from(stated.specular_color_factor.0.map(widen));
        let alpha = |[.., alpha]: [u8; 4]| LinearSrgb::grey(f64::from(alpha) / 255.0);
        let mean = self.mean_of(stated.specular_texture.as_ref(), alpha)?.r;
        let tint = colour * self.mean_of(stated.specular_color_texture.as_ref(), linear)?;
        let is_grey = tint.r == tint.g && tint.g == tint.b;
        if !is_grey || stated.specular_texture.is_some() || stated.specular_color_texture.is_some() {
            self.warn(
                "its specular colour was read as its brightness, and specular textures as their means",
                "expect highlights of the light's own colour, the same everywhere",
            );
        }
        let brightness = if is_grey { tint.r } else { tint.luminance() };
        let brightness = if brightness.is_nan() { 1.0 } else { brightness };
        Ok((factor * mean * brightness).clamp(0.0, 1.0))
    }

    /// Mean of `value` over the texels of a texture; white without one.
    pub(super) fn mean_of(
        &mut self,
        texture: Option<&Info>,
        value: impl Fn([u8; 4]) -> LinearSrgb,
    ) -> Result<LinearSrgb> {
        let Some(info) = texture else {
            return Ok(LinearSrgb::WHITE);
        };
        let mean = self.images.mean(info.index, value, &self.owner, self.load)?;
        Ok(mean.unwrap_or(LinearSrgb::WHITE))
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
        if thickness != 0.0 && !is_thick(thickness) {
            self.warn(
                format!("its thickness of {thickness} was read as 0"),
                "use a positive thickness",
            );
        }

        // Absorption is −ln(colour) / distance: a distance of 0 or a black colour would make it infinite.
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

    /// Replaces the colour of the emission by the stated spectrum, if any.
    fn emission_spectrum(&mut self, material: &mut Material) -> Result<()> {
        let Some(stated) = self.stated(spectrum::KEY) else {
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

    /// Sets glass or metal, from the extras or else from KHR_materials_dispersion.
    fn substance(&mut self, material: &mut Material, extensions: &extension::Material) -> Result<()> {
        let [glass, metal] = [substance::GLASS_KEY, substance::METAL_KEY].map(|key| self.stated(key));
        match substance::read(glass, metal, &self.owner)? {
            Some(Composition::Glass(glass)) => material.set_glass(Arc::new(glass)),
            Some(Composition::Metal(metal)) => {
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

    /// Surface class of a material; warns where it departs from the file.
    fn classify(&mut self, material: &Material) -> SurfaceKind {
        let surface = material.classified();
        let roughness = material.roughness;
        let is_metal = material.metallic >= 0.5;
        match surface {
            // Metallic 1 with roughness 1 is glTF's default, which needs no warning.
            SurfaceKind::Diffuse if is_metal && (roughness < 1.0 || material.metal.is_some()) => self.warn(
                format!(
                    "is a metal rougher than {METAL_ROUGHNESS_LIMIT} and was read as matte, in its own colour"
                ),
                "expect no reflections; lower its roughness for them",
            ),
            SurfaceKind::Mirror | SurfaceKind::Diffuse | SurfaceKind::Coated if material.glass.is_some() => {
                self.warn(
                    "names a glass but transmits no light, so nothing is dispersed",
                    "give it transmission and a volume",
                )
            }
            _ => {}
        }
        surface
    }

    fn warn_of_ignored(&mut self, extensions: &extension::Material, material: &Material) {
        match self.source.alpha_mode {
            Checked::Valid(_) => {}
            Checked::Invalid => self.warn_damaged("its alpha mode is unknown and was read as opaque"),
        }
        let mut ignored = Vec::new();
        // What is matte has no highlights, and those of metals are of their colour.
        let changed_specular = extensions.specular.as_ref().is_some_and(|specular| {
            specular.specular_factor.0 != 1.0
                || specular.specular_color_factor.0 != [1.0; 3]
                || specular.specular_texture.is_some()
                || specular.specular_color_texture.is_some()
        });
        if changed_specular && material.surface.is_clear() {
            ignored.push((
                "KHR_materials_specular".to_owned(),
                "expect reflections of full strength",
            ));
        }
        for (key, stated) in &extensions.others {
            if ![coat::NAME, substance::NAME].contains(&key.as_str())
                && let Some(loss) = extensions::loss(key, stated)
            {
                ignored.push((extras::name(Some(key), "extension", 0), loss));
            }
        }
        for (what, loss) in ignored {
            self.warn(format!("its {what} was ignored"), loss);
        }
    }
}
