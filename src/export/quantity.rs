//! The physical quantity that an exported map holds.

use serde::{Deserialize, Serialize};

use crate::units::LUMENS_PER_WATT;

/// Meaning of the numbers in a written map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Quantity {
    /// Irradiance [W/m²].
    #[serde(rename = "E")]
    Irradiance,
    /// Radiance that a white Lambertian surface reflects [W/(m² sr)].
    #[serde(rename = "E/pi")]
    IrradianceByPi,
    /// Illuminance [lx].
    #[serde(rename = "lux")]
    Illuminance,
    /// Luminance that a white Lambertian surface reflects [cd/m²].
    #[serde(rename = "lux/pi")]
    IlluminanceByPi,
}

impl Quantity {
    /// Factor from irradiance [W/m²].
    pub fn factor(self) -> f64 {
        use std::f64::consts::FRAC_1_PI;
        match self {
            Self::Irradiance => 1.0,
            Self::IrradianceByPi => FRAC_1_PI,
            Self::Illuminance => LUMENS_PER_WATT,
            Self::IlluminanceByPi => LUMENS_PER_WATT * FRAC_1_PI,
        }
    }

    /// Name of the unit in files.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Irradiance => "W/m^2",
            Self::IrradianceByPi => "W/(m^2 sr)",
            Self::Illuminance => "lx",
            Self::IlluminanceByPi => "cd/m^2",
        }
    }
}

/// Default share of a map's light that may clip.
pub const DEFAULT_CUT: f64 = 0.005;

/// The smallest white that clips no more than a share `cut` of all light, for finer steps in dim light; `None` if no
/// value is above 0.
pub fn white(values: impl Iterator<Item = f64>, cut: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.filter(|value| *value > 0.0).collect();
    values.sort_unstable_by(|a, b| b.total_cmp(a));
    let all: f64 = values.iter().sum();
    let most = *values.first()?;
    let mut above = 0.0;
    for (count, pair) in values.windows(2).enumerate() {
        // Between two neighbouring values, clipped light grows linearly.
        let wider = above + (pair[0] - pair[1]) * (count + 1) as f64;
        if wider > cut * all {
            return Some((pair[0] - (cut * all - above) / (count + 1) as f64).min(most));
        }
        above = wider;
    }
    Some(most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_leaves_out_the_share_that_it_may() {
        let light = || (-3..=100).map(f64::from);
        for cut in [0.0, 0.001, 0.01, 0.1, 0.5] {
            let white = white(light(), cut).expect("there is light");
            let above: f64 = light().map(|light| (light - white).max(0.0)).sum();
            assert!((above / 5050.0 - cut).abs() < 1e-12, "{cut}: {above}");
        }
        assert_eq!(white([0.0, -1.0].into_iter(), 0.1), None);
    }
}
