//! What the picture shows instead of light, and on which scale.

use serde::{Deserialize, Serialize};
use strum::{EnumMessage, IntoStaticStr, VariantArray};

use crate::eye_pass::renderer::{Inspected, MapStyle};
use crate::illumination::IlluminationMap;
use crate::illumination::false_colours::ColourScale;
use crate::optics::luminance;
use crate::units::LUMENS_PER_WATT;

/// Ratio of the lower to the upper end of an automatic logarithmic scale.
const DECADES: f64 = 1e-4;

/// Quantity that the picture shows. The panel shows the comment of each variant as its tooltip.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Serialize,
    Deserialize,
    EnumMessage,
    IntoStaticStr,
    VariantArray,
)]
#[strum(serialize_all = "lowercase")]
pub enum Quantity {
    /// The lit scene.
    #[default]
    Light,
    /// Irradiance of the light shown, in false colours with a legend.
    Irradiance,
    /// How far each texel may be off: its estimated error in false colours, relative to the map's mean irradiance.
    Error,
    /// What an effect adds and takes away, in false colours, relative to the map's mean irradiance.
    Difference,
    /// The maps' texels as a checkerboard.
    Texels,
    /// Texels per metre, in false colours with a legend.
    #[strum(serialize = "texel density")]
    TexelDensity,
    /// Normals of the meshes: red, green, blue for x, y, z.
    Normals,
    /// Where the base colour's image is looked up, else the first set of coordinates: red for u, green for v.
    #[strum(serialize = "texture uv")]
    Uv,
    /// Where the illumination map is looked up: red for u, green for v.
    #[strum(serialize = "map uv")]
    MapUv,
    /// The dominant wavelength [nm] of the light shown, against the white of D65: the single wavelength that, mixed with white, looks like it. White light is grey; purple, which no single wavelength looks like, is dim purple; texels below a thousandth of the brightest are black.
    Wavelength,
}

impl Quantity {
    /// Name in the event log and in the panel.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// How maps are displayed to show this quantity.
    pub fn map_style(self, scale: ColourScale) -> MapStyle {
        let what = match self {
            Self::Light => return MapStyle::Lit,
            Self::Error | Self::Difference | Self::Wavelength => return MapStyle::AsItIs,
            Self::Irradiance => Inspected::Irradiance,
            Self::Texels => Inspected::Texels,
            Self::TexelDensity => Inspected::TexelDensity,
            Self::Normals => Inspected::Normals,
            Self::Uv => Inspected::Uv,
            Self::MapUv => Inspected::MapUv,
        };
        MapStyle::Inspected { what, scale }
    }
}

/// Unit of irradiance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum IrradianceUnit {
    /// W/m², luminous-equivalent.
    #[default]
    WattsPerM2,
    /// 1/683 W/m².
    Lux,
}

impl IrradianceUnit {
    pub fn symbol(self) -> &'static str {
        match self {
            Self::WattsPerM2 => "W/m²",
            Self::Lux => "lx",
        }
    }

    /// The value of 1 W/m² in this unit.
    pub fn per_w_m2(self) -> f64 {
        match self {
            Self::WattsPerM2 => 1.0,
            Self::Lux => LUMENS_PER_WATT,
        }
    }
}

/// The scale of irradiance in false colours.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ScaleChoice {
    /// Unit in the legend.
    pub unit: IrradianceUnit,
    pub is_logarithmic: bool,
    /// Whether the scale adapts to the maps.
    pub is_automatic: bool,
    /// Ends of a fixed scale [W/m²]: 0 < low < high.
    pub typed_w_m2: [f64; 2],
}

impl Default for ScaleChoice {
    fn default() -> Self {
        Self {
            unit: IrradianceUnit::default(),
            is_logarithmic: true,
            is_automatic: true,
            typed_w_m2: [0.01, 10.0],
        }
    }
}

/// Statistics of the maps shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MapSurvey {
    /// Largest luminance of a texel [W/m²]; 0 without light.
    pub peak_w_m2: f64,
    /// Mean texels per metre of the coarsest and of the finest map; `None` without maps.
    pub texels_per_m: Option<[f64; 2]>,
    /// Number of texels with a value that is not finite.
    pub faults: usize,
}

impl MapSurvey {
    /// Scans all texels of the maps.
    pub fn of(maps: &[IlluminationMap]) -> Self {
        let mut survey = Self::default();
        for map in maps {
            for rgb in map.total() {
                if rgb.iter().all(|value| value.is_finite()) {
                    survey.peak_w_m2 = survey.peak_w_m2.max(luminance(&rgb));
                } else {
                    survey.faults += 1;
                }
            }
            let chart = &map.chart;
            let covered = (0..chart.texel_count()).filter(|texel| chart.texel_area_m2(*texel) > 0.0);
            let density = (covered.count() as f64 / chart.area_m2()).sqrt();
            if density.is_finite() {
                let [least, most] = survey.texels_per_m.unwrap_or([density; 2]);
                survey.texels_per_m = Some([least.min(density), most.max(density)]);
            }
        }
        survey
    }

    /// Scale of a quantity, in its own unit.
    pub fn scale(&self, quantity: Quantity, choice: &ScaleChoice) -> ColourScale {
        match quantity {
            Quantity::Irradiance => self.irradiance_scale(choice),
            // One octave beyond either end, because the density also varies within a map.
            _ => {
                let [least, most] = self.texels_per_m.unwrap_or([1.0; 2]);
                ColourScale {
                    low: 0.5 * least,
                    high: 2.0 * most,
                    is_logarithmic: true,
                }
            }
        }
    }

    fn irradiance_scale(&self, choice: &ScaleChoice) -> ColourScale {
        let peak = if self.peak_w_m2 > 0.0 { self.peak_w_m2 } else { 1.0 };
        let [low, high] = match (choice.is_automatic, choice.is_logarithmic) {
            (true, true) => [DECADES * rounded_up(peak), rounded_up(peak)],
            (true, false) => [0.0, rounded_up(peak)],
            (false, _) => choice.typed_w_m2,
        };
        ColourScale {
            low,
            high,
            is_logarithmic: choice.is_logarithmic,
        }
    }
}

/// Rounds up to 1, 2 or 5 times a power of ten.
fn rounded_up(value: f64) -> f64 {
    let decade = 10.0_f64.powf(value.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0];
    // Rounding errors must not lead to the next step.
    let step = steps
        .into_iter()
        .find(|step| step * decade >= value * (1.0 - 1e-9));
    step.unwrap_or(10.0) * decade
}
