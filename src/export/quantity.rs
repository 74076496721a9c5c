//! What the numbers of an exported map mean.

use serde::{Deserialize, Serialize};

use crate::units::LUMENS_PER_WATT;

/// What the numbers of a map mean where it is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Quantity {
    /// Irradiance [W/m²].
    #[serde(rename = "E")]
    Irradiance,
    /// The radiance that a white Lambertian surface sends on [W/(m² sr)].
    #[serde(rename = "E/pi")]
    IrradianceByPi,
    /// Illuminance [lx].
    #[serde(rename = "lux")]
    Illuminance,
    /// The luminance that a white Lambertian surface sends on [cd/m²].
    #[serde(rename = "lux/pi")]
    IlluminanceByPi,
}

impl Quantity {
    /// What irradiance [W/m²] is multiplied by.
    pub fn factor(self) -> f64 {
        use std::f64::consts::FRAC_1_PI;
        match self {
            Self::Irradiance => 1.0,
            Self::IrradianceByPi => FRAC_1_PI,
            Self::Illuminance => LUMENS_PER_WATT,
            Self::IlluminanceByPi => LUMENS_PER_WATT * FRAC_1_PI,
        }
    }

    /// As the manifest names its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Irradiance => "W/m^2",
            Self::IrradianceByPi => "W/(m^2 sr)",
            Self::Illuminance => "lx",
            Self::IlluminanceByPi => "cd/m^2",
        }
    }
}
