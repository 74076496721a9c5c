//! Materials, as glTF's metallic-roughness model and its extensions state them, and the class that transport treats
//! each as.

use std::sync::Arc;

use glam::DVec2;

use super::{NormalMap, Texture, TextureRef, Variation, Waves};
use crate::optics::spectrum::Spectrum;
use crate::optics::wavelength::D_LINE;
use crate::optics::{Glass, LinearSrgb, Metal, Nanometres};

/// Roughness (glTF's, α = roughness²) up to which polish over a diffuse body sends light on; above it the surface is
/// pure Lambert.
pub const SPECULAR_ROUGHNESS_LIMIT: f64 = 0.3;

/// Roughness up to which metals send light on in a lobe; above it they are pure Lambert. What lets light through does so
/// at any roughness. The lobe is as wide as Lambert's there: of light from 0, 30, 60 and 75° to the normal, 15, 29, 44
/// and 46 % goes another way than by Lambert's, and for no roughness less than 11, 23, 31 and 32 %. Pictures would err
/// more, since the eye looks at metals as at mirrors.
pub const METAL_ROUGHNESS_LIMIT: f64 = 0.6;

/// Up to this roughness a surface is as good as smooth: its lobe is some hundredths of a degree wide.
pub const SMOOTH_ROUGHNESS: f64 = 0.01;

/// Inside of a solid dielectric, KHR_materials_volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Distance [m] after which white light has `attenuation_colour`; infinite when nothing is absorbed.
    pub attenuation_distance_m: f64,
    /// Colour after one attenuation distance, (0, 1] per channel.
    pub attenuation_colour: LinearSrgb,
}

/// How transport treats a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SurfaceKind {
    /// Lambert: takes the full flux into its illumination map.
    Diffuse,
    /// Metal: reflects by [`Material::base_colour`], absorbs the rest.
    Mirror,
    /// Interface of a solid: reflects and refracts by Fresnel's equations.
    Dielectric,
    /// A pane without thickness: reflects and transmits straight on.
    ThinWall,
    /// Polish over a diffuse body: the map gets (1 − F)Φ and the ray carries FΦ on.
    Mixed,
    /// Any of the others, or shares of several, from place to place: see [`Mixture`](super::Mixture).
    Varied,
}

impl SurfaceKind {
    /// Whether light goes on from it in a direction or a lobe.
    pub fn is_specular(self) -> bool {
        self != Self::Diffuse
    }

    /// Whether no light goes through it.
    pub fn is_opaque(self) -> bool {
        !self.is_clear() && self != Self::Varied
    }

    /// Whether it only shows what is behind it and what it reflects.
    pub fn is_clear(self) -> bool {
        matches!(self, Self::Dielectric | Self::ThinWall)
    }

    /// Whether it takes light into an illumination map.
    pub fn is_receiver(self) -> bool {
        matches!(self, Self::Diffuse | Self::Mixed | Self::Varied)
    }
}

/// A material with its factors; textures multiply them.
#[derive(Clone, Debug)]
pub struct Material {
    /// The file's name for it; `materialN` when it has none.
    pub name: String,
    /// How transport treats it.
    pub surface: SurfaceKind,
    /// Albedo of a diffuse surface, reflectance at normal incidence of a metal, tint per crossing of a dielectric; [0, 1].
    pub base_colour: LinearSrgb,
    /// sRGB-encoded image that multiplies `base_colour`.
    pub base_colour_texture: Option<TextureRef>,
    /// Where it is cut out.
    pub alpha_mask: Option<AlphaMask>,
    /// The share of it that is there, [0, 1], where it is not all: multiplied by the alpha of its base colour's image.
    pub coverage: Option<f64>,
    /// How it changes from place to place.
    pub variation: Option<Variation>,
    /// [0, 1].
    pub metallic: f64,
    /// [0, 1]; GGX α is its square.
    pub roughness: f64,
    /// Share of the light under the interface that is transmitted and not scattered diffusely, [0, 1].
    pub transmission: f64,
    /// Refractive index at 587.56 nm, at least 1.
    pub ior: f64,
    /// Its index by wavelength, which is `ior` at 587.56 nm; `None` where it is `ior` at all of them.
    pub glass: Option<Arc<Glass>>,
    /// Its reflectance by wavelength, of which `base_colour` is the colour; `None` where that is all that is known.
    pub metal: Option<&'static Metal>,
    /// Set where the surface bounds a solid body.
    pub volume: Option<Volume>,
    /// Whether it has one because its mesh encloses space, and not because the file says so.
    pub is_solid_by_shape: bool,
    /// Emitted radiance [W/(m² sr)], luminous-equivalent: glTF's cd/m² divided by 683 lm/W.
    pub emitted_radiance: LinearSrgb,
    /// sRGB-encoded image that multiplies `emitted_radiance`.
    pub emission_texture: Option<TextureRef>,
    /// That light by wavelength, scaled to one luminous-equivalent watt, of which `emitted_radiance` has the colour;
    /// `None` where that is all that is known.
    pub emission_spectrum: Option<Arc<Spectrum>>,
    /// What part of the surface its polish covers, [0, 1]: multiplies what a mixed surface reflects.
    pub polish: f64,
    /// What bends its normals where it is specular; light that a diffuse surface takes is that of the surface itself.
    pub waves: Option<Waves>,
    /// The same by an image.
    pub normal_map: Option<NormalMap>,
    /// Whether its back is drawn; transport always treats both sides.
    pub double_sided: bool,
}

impl Material {
    /// The waves that bend its normals, if it is specular and has any.
    pub fn bending_waves(&self) -> Option<&Waves> {
        self.waves.as_ref().filter(|_| self.surface.is_specular())
    }

    /// The image that bends its normals, if it is specular and has one.
    pub fn bending_map(&self) -> Option<&NormalMap> {
        self.normal_map.as_ref().filter(|_| self.surface.is_specular())
    }

    /// Its images: of base colour, of factors, of what it emits, and of normals where those are bent.
    pub fn images(&self) -> [Option<&TextureRef>; 4] {
        [
            self.base_colour_texture.as_ref(),
            self.variation.as_ref().map(|variation| &variation.image),
            self.emission_texture.as_ref(),
            self.bending_map().map(|map| &map.image),
        ]
    }

    /// Whether anything bends its normals.
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

    /// Whether it is the surface of a solid in which light goes another way at another wavelength.
    pub fn is_dispersive(&self) -> bool {
        let glass = self.glass.as_ref();
        self.is_solid() && glass.is_some_and(|glass| glass.dispersion.is_dispersive())
    }

    /// Makes it of a glass, with that one's index at 587.56 nm; what else it has stays.
    pub fn set_glass(&mut self, glass: Arc<Glass>) {
        self.ior = glass.dispersion.index(D_LINE);
        self.glass = Some(glass);
    }

    /// Makes it of a metal: nothing goes through, and `base_colour` is that of the metal seen head on under D65, as
    /// bright as a reflectance of at most 1 per channel can have it. Gives the factor that this took where it is
    /// not 1, as for gold, which is redder than sRGB's reddest white.
    pub fn set_metal(&mut self, metal: &'static Metal) -> Option<f64> {
        let colour = metal.reflectance_srgb(1.0);
        let most = colour.max_channel();
        self.base_colour = if most > 1.0 { colour / most } else { colour };
        self.metallic = 1.0;
        self.transmission = 0.0;
        self.metal = Some(metal);
        (most > 1.0).then(|| 1.0 / most)
    }

    /// The class that its factors make it: how a file's material is read unless the file says otherwise (unlit).
    pub fn classified(&self) -> SurfaceKind {
        let surface = match &self.variation {
            _ if self.coverage.is_some() => SurfaceKind::Varied,
            Some(variation) => variation.surface,
            None => Self::class_of(self.metallic, self.roughness, self.transmission),
        };
        match (surface.is_clear(), self.volume) {
            (true, Some(_)) => SurfaceKind::Dielectric,
            (true, None) => SurfaceKind::ThinWall,
            (false, _) => surface,
        }
    }

    /// The class of a surface that is the same everywhere; what is clear is taken for thin.
    pub fn class_of(metallic: f64, roughness: f64, transmission: f64) -> SurfaceKind {
        if metallic >= 0.5 && roughness <= METAL_ROUGHNESS_LIMIT {
            SurfaceKind::Mirror
        } else if metallic >= 0.5 {
            SurfaceKind::Diffuse
        } else if transmission >= 0.5 {
            SurfaceKind::ThinWall
        } else if roughness <= SPECULAR_ROUGHNESS_LIMIT {
            SurfaceKind::Mixed
        } else {
            SurfaceKind::Diffuse
        }
    }

    /// Whether any light goes through it by transmission.
    pub fn transmits(&self) -> bool {
        self.surface.is_clear() || (self.surface == SurfaceKind::Varied && self.transmission > 0.0)
    }

    /// Whether it bounds a body that light goes through.
    pub fn is_solid(&self) -> bool {
        match self.surface {
            SurfaceKind::Dielectric => true,
            SurfaceKind::Varied => self.transmission > 0.0 && self.volume.is_some(),
            _ => false,
        }
    }

    /// Whether its back is there for the eye.
    pub fn has_back(&self) -> bool {
        self.double_sided || self.transmits()
    }

    /// Whether no light goes through it anywhere.
    pub fn is_opaque(&self) -> bool {
        self.surface.is_opaque() && self.alpha_mask.is_none()
    }

    /// Whether its specular part has a lobe, or may have one somewhere.
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
            polish: 1.0,
            waves: None,
            normal_map: None,
            double_sided: true,
        }
    }
}

/// A surface is there where its alpha, `factor` times that of its base colour texture, is at least `cutoff`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlphaMask {
    /// Alpha from which on it is there.
    pub cutoff: f64,
    /// Alpha of the base colour, [0, 1].
    pub factor: f64,
}

impl AlphaMask {
    /// Takes all of a surface away.
    pub const NOWHERE: Self = Self {
        cutoff: f64::INFINITY,
        factor: 0.0,
    };

    /// Whether the surface is there at a texture coordinate; without a texture it is everywhere or nowhere.
    pub fn is_there(&self, texture: Option<(&Texture, DVec2)>) -> bool {
        let alpha = texture.map_or(1.0, |(texture, uv)| texture.alpha(uv));
        self.factor * alpha >= self.cutoff
    }
}
