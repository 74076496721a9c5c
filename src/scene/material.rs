//! Materials, as glTF's metallic-roughness model and its extensions state them, the class that transport treats each as,
//! and the mixture of classes at a point of one that varies.

use super::{NormalMap, Texture, TextureRef, Waves};
use crate::optics::spectrum::Spectrum;
use crate::optics::wavelength::D_LINE;
use crate::optics::{Glass, LinearSrgb, Metal, Nanometres};
use glam::DVec2;
use std::sync::Arc;

/// Largest roughness (glTF's, α = roughness²) at which light reflects off the coat over a diffuse body; rougher surfaces
/// are pure Lambert to the light pass: at 4 %, their wide lobes cast no caustics.
pub const SPECULAR_ROUGHNESS_LIMIT: f64 = 0.3;

/// Largest roughness at which pictures show the reflection of a coat. Rougher ones hardly differ from a lighter body.
pub const GLOSSY_ROUGHNESS_LIMIT: f64 = 0.6;

/// Largest roughness at which metals reflect in a lobe; rougher ones are pure Lambert. Transmissive surfaces have a
/// lobe at any roughness. At this limit the lobe is as wide as Lambert's: of light incident at 0, 30, 60 and 75°, 15,
/// 29, 44 and 46 % goes elsewhere than by Lambert, and at no roughness less than 11, 23, 31 and 32 %. The map of a metal
/// that counts as matte shows the caustics on it, which its lobe would miss.
pub const METAL_ROUGHNESS_LIMIT: f64 = 0.6;

/// Largest roughness treated as smooth: the lobe is some hundredths of a degree wide.
pub const SMOOTH_ROUGHNESS: f64 = 0.01;

/// Smallest difference of a factor that counts: two steps of an 8-bit image.
pub const EVEN: f64 = 2.0 / 255.0;

/// Interior of a solid dielectric (KHR_materials_volume).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Distance after which white light has `attenuation_colour` [m]; infinite without absorption.
    pub attenuation_distance_m: f64,
    /// Colour after one attenuation distance, (0, 1] per channel.
    pub attenuation_colour: LinearSrgb,
}

/// How transport treats a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SurfaceKind {
    /// Lambert: the full flux goes into its illumination map.
    Diffuse,
    /// Metal: reflects [`Material::base_colour`] and absorbs the rest.
    Mirror,
    /// Interface of a solid: reflects and refracts by Fresnel's equations.
    Dielectric,
    /// Pane without thickness: reflects, and transmits without deflection.
    ThinWall,
    /// Coat over a diffuse body: the map receives (1 − F)Φ and the ray carries FΦ on.
    Coated,
    /// Any of the others or a blend of them, varying over the surface: see [`Mixture`](super::Mixture).
    Varied,
}

impl SurfaceKind {
    /// Whether light leaves it in a direction or a lobe.
    pub fn is_specular(self) -> bool {
        self != Self::Diffuse
    }

    /// Whether it transmits no light.
    pub fn is_opaque(self) -> bool {
        !self.is_clear() && self != Self::Varied
    }

    /// Whether it is transparent, with neither a diffuse nor a metallic part.
    pub fn is_clear(self) -> bool {
        matches!(self, Self::Dielectric | Self::ThinWall)
    }

    /// Whether it has an illumination map.
    pub fn is_receiver(self) -> bool {
        matches!(self, Self::Diffuse | Self::Coated | Self::Varied)
    }
}

/// Factors and textures of a material; textures multiply the factors.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name in the file; `materialN` without one.
    pub name: String,
    /// How transport treats it.
    pub surface: SurfaceKind,
    /// Albedo of a diffuse surface, reflectance of a metal at normal incidence, tint of a dielectric per crossing; [0,
    /// 1].
    pub base_colour: LinearSrgb,
    /// sRGB-encoded image that multiplies `base_colour`.
    pub base_colour_texture: Option<TextureRef>,
    /// Cut-out by alpha.
    pub alpha_mask: Option<AlphaMask>,
    /// Share of the surface that is present (alpha blending), [0, 1], times the alpha of the base colour texture;
    /// `None` if all of it is.
    pub coverage: Option<f64>,
    /// Variation of the factors over the surface.
    pub variation: Option<Variation>,
    /// [0, 1].
    pub metallic: f64,
    /// [0, 1]; GGX α is its square.
    pub roughness: f64,
    /// Share of the light below the interface that is transmitted instead of scattered diffusely, [0, 1].
    pub transmission: f64,
    /// Refractive index at 587.56 nm, at least 1.
    pub ior: f64,
    /// Index by wavelength, equal to `ior` at 587.56 nm; `None` if the index is constant.
    pub glass: Option<Arc<Glass>>,
    /// Spectral reflectance, whose colour is `base_colour`; `None` if only the colour is known.
    pub metal: Option<&'static Metal>,
    /// Set if the surface bounds a solid body.
    pub volume: Option<Volume>,
    /// Whether `volume` is set because the mesh is closed, and not by the file.
    pub is_solid_by_shape: bool,
    /// Emitted radiance [W/(m² sr)], luminous-equivalent: glTF's cd/m² divided by 683 lm/W.
    pub emitted_radiance: LinearSrgb,
    /// sRGB-encoded image that multiplies `emitted_radiance`.
    pub emission_texture: Option<TextureRef>,
    /// Spectrum of the emission, scaled to one luminous-equivalent watt; `emitted_radiance` has its colour. `None` if
    /// only the colour is known.
    pub emission_spectrum: Option<Arc<Spectrum>>,
    /// Share of the surface that the coat covers, [0, 1]; multiplies the reflection of a coated one.
    pub coat: f64,
    /// Largest roughness at which the coat reflects: [`SPECULAR_ROUGHNESS_LIMIT`] for light, [`GLOSSY_ROUGHNESS_LIMIT`]
    /// as the eye sees it.
    pub coat_roughness_limit: f64,
    /// Waves that perturb the normals of specular surfaces; irradiance is always that of the surface itself.
    pub waves: Option<Waves>,
    /// Normal map, to the same effect. On diffuse surfaces it shades pictures: see [`Self::relief`].
    pub normal_map: Option<NormalMap>,
    /// Whether its back is drawn; transport always treats both sides.
    pub double_sided: bool,
}

impl Material {
    /// Waves that perturb its normals; `None` unless it is specular.
    pub fn bending_waves(&self) -> Option<&Waves> {
        self.waves.as_ref().filter(|_| self.surface.is_specular())
    }

    /// Normal map that perturbs its normals; `None` unless it is specular.
    pub fn bending_map(&self) -> Option<&NormalMap> {
        self.normal_map.as_ref().filter(|_| self.surface.is_specular())
    }

    /// Normal map that shades the diffuse light of pictures; `None` without a diffuse part.
    pub fn relief(&self) -> Option<&NormalMap> {
        self.normal_map.as_ref().filter(|_| self.surface.is_receiver())
    }

    /// Images of the base colour, the factors, the emission, and the normals.
    pub fn images(&self) -> [Option<&TextureRef>; 4] {
        [
            self.base_colour_texture.as_ref(),
            self.variation.as_ref().map(|variation| &variation.image),
            self.emission_texture.as_ref(),
            self.normal_map.as_ref().map(|map| &map.image),
        ]
    }

    /// Whether waves or a normal map perturb its normals.
    pub fn has_bumps(&self) -> bool {
        self.bending_waves().is_some() || self.bending_map().is_some()
    }

    /// Refractive index at a wavelength, at least 1.
    pub fn index_at(&self, wavelength: Nanometres) -> f64 {
        match &self.glass {
            Some(glass) => glass.dispersion.index(wavelength),
            None => self.ior,
        }
    }

    /// Whether it bounds a solid whose index varies with wavelength.
    #[inline]
    pub fn is_dispersive(&self) -> bool {
        let glass = self.glass.as_ref();
        self.is_solid() && glass.is_some_and(|glass| glass.dispersion.is_dispersive())
    }

    /// Sets the glass, and `ior` to that of the glass at 587.56 nm.
    pub fn set_glass(&mut self, glass: Arc<Glass>) {
        self.ior = glass.dispersion.index(D_LINE);
        self.glass = Some(glass);
    }

    /// Makes it an opaque metal. `base_colour` becomes the colour of the metal at normal incidence under D65, scaled
    /// down if a channel exceeds 1; returns the factor in that case, as for gold, which is outside the gamut of sRGB.
    pub fn set_metal(&mut self, metal: &'static Metal) -> Option<f64> {
        let colour = metal.reflectance_srgb(1.0);
        let most = colour.max_channel();
        self.base_colour = if most > 1.0 { colour / most } else { colour };
        self.metallic = 1.0;
        self.transmission = 0.0;
        self.metal = Some(metal);
        (most > 1.0).then(|| 1.0 / most)
    }

    /// Surface class that follows from the factors. A file's material has it unless the file says otherwise (unlit).
    pub fn classified(&self) -> SurfaceKind {
        let surface = match &self.variation {
            _ if self.coverage.is_some() => SurfaceKind::Varied,
            None if self.is_partly_clear() => SurfaceKind::Varied,
            Some(variation) => variation.surface,
            None => Self::class_of(self.metallic, self.roughness, self.transmission),
        };
        match (surface.is_clear(), self.volume) {
            (true, Some(_)) => SurfaceKind::Dielectric,
            (true, None) => SurfaceKind::ThinWall,
            (false, _) => surface,
        }
    }

    /// Surface class that the eye sees: coated where light finds it matte, but highlights and reflections are visible.
    pub fn seen_surface(&self) -> SurfaceKind {
        let is_body = self.surface == SurfaceKind::Diffuse && self.metallic < 0.5 && self.transmission < 0.5;
        let is_glossy = self.roughness > SPECULAR_ROUGHNESS_LIMIT && self.roughness <= GLOSSY_ROUGHNESS_LIMIT;
        if is_body && is_glossy && self.coat > 0.0 {
            SurfaceKind::Coated
        } else {
            self.surface
        }
    }

    /// Whether the same share of it is clear everywhere, and the rest diffuse.
    fn is_partly_clear(&self) -> bool {
        self.metallic < 0.5 && self.transmission >= EVEN && self.transmission <= 1.0 - EVEN
    }

    /// Whether light may leave it in a direction or a lobe. Light only passes straight through the holes of a matte
    /// surface.
    pub fn is_specular(&self) -> bool {
        let whole = self.mixture(LinearSrgb::WHITE, 1.0);
        let is_matte = self.variation.is_none() && whole.metal + whole.clear + whole.coat == 0.0;
        self.surface.is_specular() && !(self.surface == SurfaceKind::Varied && is_matte)
    }

    /// Surface class for factors that do not vary; transparent surfaces count as thin.
    pub fn class_of(metallic: f64, roughness: f64, transmission: f64) -> SurfaceKind {
        if metallic >= 0.5 && roughness <= METAL_ROUGHNESS_LIMIT {
            SurfaceKind::Mirror
        } else if metallic >= 0.5 {
            SurfaceKind::Diffuse
        } else if transmission >= 0.5 {
            SurfaceKind::ThinWall
        } else if roughness <= SPECULAR_ROUGHNESS_LIMIT {
            SurfaceKind::Coated
        } else {
            SurfaceKind::Diffuse
        }
    }

    /// Whether it transmits light anywhere.
    pub fn transmits(&self) -> bool {
        self.surface.is_clear() || (self.surface == SurfaceKind::Varied && self.transmission > 0.0)
    }

    /// Whether it bounds a transparent body.
    #[inline]
    pub fn is_solid(&self) -> bool {
        match self.surface {
            SurfaceKind::Dielectric => true,
            SurfaceKind::Varied => self.transmission > 0.0 && self.volume.is_some(),
            _ => false,
        }
    }

    /// Whether its back is visible.
    pub fn has_back(&self) -> bool {
        self.double_sided || self.transmits()
    }

    /// Whether no light passes it anywhere.
    pub fn is_opaque(&self) -> bool {
        self.surface.is_opaque() && self.alpha_mask.is_none()
    }

    /// Whether it has a specular lobe, at least in places.
    pub fn is_rough(&self) -> bool {
        self.surface == SurfaceKind::Varied
            || (self.surface.is_specular() && self.roughness > SMOOTH_ROUGHNESS)
    }
}

impl Default for Material {
    /// White Lambert, albedo 0.8.
    fn default() -> Self {
        Self {
            name: "default".into(),
            surface: SurfaceKind::Diffuse,
            base_colour: LinearSrgb::grey(0.8),
            base_colour_texture: None,
            alpha_mask: None,
            coverage: None,
            variation: None,
            metallic: 0.0,
            roughness: 1.0,
            transmission: 0.0,
            ior: 1.5,
            glass: None,
            metal: None,
            volume: None,
            is_solid_by_shape: false,
            emitted_radiance: LinearSrgb::BLACK,
            emission_texture: None,
            emission_spectrum: None,
            coat: 1.0,
            coat_roughness_limit: SPECULAR_ROUGHNESS_LIMIT,
            waves: None,
            normal_map: None,
            double_sided: true,
        }
    }
}

/// Alpha cut-out: the surface exists where `factor` times the alpha of its base colour texture is at least `cutoff`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlphaMask {
    /// Alpha at and above which the surface exists.
    pub cutoff: f64,
    /// Alpha of the base colour, [0, 1].
    pub factor: f64,
}

impl AlphaMask {
    /// Removes the whole surface.
    pub const NOWHERE: Self = Self {
        cutoff: f64::INFINITY,
        factor: 0.0,
    };

    /// Whether the surface exists at a texture coordinate; without a texture, everywhere or nowhere.
    pub fn is_there(&self, texture: Option<(&Texture, DVec2)>) -> bool {
        let alpha = texture.map_or(1.0, |(texture, uv)| texture.alpha(uv));
        self.factor * alpha >= self.cutoff
    }
}

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
    pub coat: f64,
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
            coat: if roughness <= self.coat_roughness_limit {
                self.coat
            } else {
                0.0
            },
        }
    }
}
