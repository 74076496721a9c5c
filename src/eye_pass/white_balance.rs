//! White balance: the light that the display shows as white.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::Picture;
use crate::optics::LinearSrgb;
use crate::optics::spectrum::Xyz;
use crate::optics::spectrum::temperature::{CAMERA_KELVIN, white_of_kelvin};
use crate::optics::spectrum::xyz::{IDENTITY, Matrix3, transformed, white_balance};
use crate::scene::Scene;

/// The illuminant that the display shows as white.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WhiteBalance {
    /// That of the display, D65: colours are unchanged.
    #[default]
    None,
    /// The combined light of all lamps at the middle of the scene, as a grey card there would show it.
    Lamps,
    /// Daylight or a black body of a colour temperature [K], see [`white_of_kelvin`].
    Kelvin(f64),
    /// CIE 1931 chromaticity x, y.
    Chromaticity([f64; 2]),
}

impl WhiteBalance {
    /// Matrix by which linear sRGB radiance is multiplied before tone mapping (Bradford). Light of the chosen colour
    /// keeps its luminance. The identity without lamps, or if the cone responses to their light are not all positive.
    pub fn matrix(self, scene: &Scene) -> Matrix3 {
        let white = match self {
            Self::None => None,
            Self::Lamps => Some(Xyz::from(scene.light_at_middle())),
            Self::Kelvin(kelvin) => Some(white_of_kelvin(kelvin)),
            Self::Chromaticity([x, y]) => Some(Xyz { x, y, z: 1.0 - x - y }),
        };
        white.and_then(white_balance).unwrap_or(IDENTITY)
    }
}

/// Accepts `none`, `lamps`, kelvin with or without a K, or x and y separated by a comma.
impl FromStr for WhiteBalance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let [least, most] = CAMERA_KELVIN;
        let number = |text: &str| text.trim().parse::<f64>().ok();
        let kelvin = || number(text.strip_suffix(['K', 'k']).unwrap_or(text));
        let is_colour = |[x, y]: &[f64; 2]| *x > 0.0 && *y > 0.0 && x + y < 1.0;
        let pair = || {
            text.split_once(',')
                .and_then(|(x, y)| Some([number(x)?, number(y)?]))
        };
        match text {
            "none" => return Ok(Self::None),
            "lamps" => return Ok(Self::Lamps),
            _ => {}
        }
        if let Some(chromaticity) = pair().filter(is_colour) {
            return Ok(Self::Chromaticity(chromaticity));
        }
        kelvin()
            .filter(|kelvin| (least..=most).contains(kelvin))
            .map(Self::Kelvin)
            .ok_or_else(|| {
                format!(
                    "give `none`, `lamps`, {least:.0} to {most:.0} kelvin, or a chromaticity as 0.31,0.33"
                )
            })
    }
}

impl fmt::Display for WhiteBalance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("none"),
            Self::Lamps => f.write_str("lamps"),
            Self::Kelvin(kelvin) => write!(f, "{kelvin} K"),
            Self::Chromaticity([x, y]) => write!(f, "{x},{y}"),
        }
    }
}

impl Picture {
    /// Multiplies every pixel by a matrix of [`WhiteBalance::matrix`].
    #[must_use]
    pub fn white_balanced(mut self, matrix: &Matrix3) -> Self {
        if *matrix != IDENTITY {
            for pixel in &mut self.radiance {
                let balanced = transformed(matrix, LinearSrgb::from(pixel.map(f64::from)));
                *pixel = balanced.to_array().map(|channel| channel as f32);
            }
        }
        self
    }
}
