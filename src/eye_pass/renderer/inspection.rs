//! What a picture shows of surfaces: their light, or something to be looked at in its place.

use crate::illumination::false_colours::ColourScale;

/// What the values of maps stand for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MapStyle {
    /// Irradiance [W/m²]: surfaces send it by their albedo, mirrors reflect it, glass lets it through.
    #[default]
    Lit,
    /// Colours in linear light: shown as they are, and clear bodies left out. Surfaces without a map are black.
    AsItIs,
    /// Irradiance [W/m²] of surfaces that are shown by something else, in display colours: to be shown without exposure
    /// and tone mapping.
    Inspected {
        /// By what.
        what: Inspected,
        /// Of false colours, in the quantity's own unit.
        scale: ColourScale,
    },
}

impl MapStyle {
    /// What shaders take a place on the scale from.
    pub(super) fn colour_scale(self) -> [f64; 2] {
        match self {
            Self::Inspected { scale, .. } => scale.for_shaders(),
            Self::Lit | Self::AsItIs => [0.0; 2],
        }
    }

    pub(super) fn is_logarithmic(self) -> bool {
        matches!(self, Self::Inspected { scale, .. } if scale.is_logarithmic)
    }
}

/// Something that surfaces are shown by in place of their light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Inspected {
    /// Luminance of their maps [W/m²] in false colours; clear bodies are left out.
    Irradiance,
    /// Texels of their maps as a checkerboard; clear bodies are left out.
    Texels,
    /// Texels of their maps per metre in false colours; clear bodies are left out.
    TexelDensity,
    /// The mesh's normals n in the scene's axes: red, green and blue are (n + 1)/2 of x, y and z.
    Normals,
    /// Coordinates of the base colour's image, or of set 0: red is u, green v, without their integer parts.
    Uv,
    /// Coordinates in the illumination map: red is u, green v; clear bodies are left out.
    MapUv,
}

impl Inspected {
    /// Every one.
    pub const ALL: [Self; 6] = [
        Self::Irradiance,
        Self::Texels,
        Self::TexelDensity,
        Self::Normals,
        Self::Uv,
        Self::MapUv,
    ];

    /// `INSPECTED_*` of the shader.
    pub(super) fn code(self) -> u32 {
        match self {
            Self::Irradiance => 0,
            Self::Texels => 1,
            Self::TexelDensity => 2,
            Self::Normals => 3,
            Self::Uv => 4,
            Self::MapUv => 5,
        }
    }

    /// Whether it is something that surfaces without a map have too.
    pub(super) fn is_of_shape(self) -> bool {
        matches!(self, Self::Normals | Self::Uv)
    }
}
