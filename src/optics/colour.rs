//! Colours in linear light.

use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use super::Nanometres;
use super::spectrum::csv::columns;
use super::wavelength::VISIBLE;

/// A colour in linear sRGB (Rec. 709 primaries, D65 white). Factors have no unit; quantities are named with their unit,
/// and their [luminance](Self::luminance) is the luminous-equivalent value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 3]", into = "[f64; 3]")]
pub struct LinearSrgb {
    /// Red.
    pub r: f64,
    /// Green.
    pub g: f64,
    /// Blue.
    pub b: f64,
}

impl LinearSrgb {
    /// All channels 0.
    pub const BLACK: Self = Self::grey(0.0);
    /// All channels 1.
    pub const WHITE: Self = Self::grey(1.0);

    /// From its channels.
    pub const fn new(r: f64, g: f64, b: f64) -> Self {
        Self { r, g, b }
    }

    /// The same value in every channel.
    pub const fn grey(value: f64) -> Self {
        Self {
            r: value,
            g: value,
            b: value,
        }
    }

    /// Y of CIE 1931 for linear sRGB (IEC 61966-2-1).
    pub fn luminance(self) -> f64 {
        0.212_639_005_871_510_36 * self.r
            + 0.715_168_678_767_755_9 * self.g
            + 0.072_192_315_360_733_71 * self.b
    }

    /// Red, green, blue.
    pub const fn to_array(self) -> [f64; 3] {
        [self.r, self.g, self.b]
    }

    /// Applies a function to each channel.
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self::new(f(self.r), f(self.g), f(self.b))
    }

    /// The largest channel.
    pub fn max_channel(self) -> f64 {
        self.r.max(self.g).max(self.b)
    }

    /// Whether every channel is finite.
    pub fn is_finite(self) -> bool {
        self.r.is_finite() && self.g.is_finite() && self.b.is_finite()
    }

    /// Decodes an 8-bit sRGB channel (IEC 61966-2-1) to linear light [0, 1].
    pub fn decode_channel(encoded: u8) -> f64 {
        static DECODED: LazyLock<[f64; 256]> =
            LazyLock::new(|| std::array::from_fn(|code| LinearSrgb::decode(code as f64 / 255.0)));
        DECODED[usize::from(encoded)]
    }

    /// The same for an encoded channel in [0, 1].
    pub fn decode(value: f64) -> f64 {
        if value <= 0.040_45 {
            value / 12.92
        } else {
            ((value + 0.055) / 1.055).powf(2.4)
        }
    }

    /// Encodes linear light, clamped to [0, 1], as sRGB [0, 1] (IEC 61966-2-1): for display only.
    pub fn encode_channel(linear: f64) -> f64 {
        let value = linear.clamp(0.0, 1.0);
        if value <= 0.003_130_8 {
            value * 12.92
        } else {
            1.055 * value.powf(1.0 / 2.4) - 0.055
        }
    }
}

/// Luminance of a linear sRGB triple, the pixel format of maps and pictures.
pub fn luminance(rgb: &[f32; 3]) -> f64 {
    LinearSrgb::from(rgb.map(f64::from)).luminance()
}

impl From<[f64; 3]> for LinearSrgb {
    fn from([r, g, b]: [f64; 3]) -> Self {
        Self { r, g, b }
    }
}

impl From<LinearSrgb> for [f64; 3] {
    fn from(colour: LinearSrgb) -> Self {
        colour.to_array()
    }
}

impl std::ops::Add for LinearSrgb {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.r + other.r, self.g + other.g, self.b + other.b)
    }
}

impl std::ops::AddAssign for LinearSrgb {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl std::ops::Sub for LinearSrgb {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.r - other.r, self.g - other.g, self.b - other.b)
    }
}

impl std::ops::Mul for LinearSrgb {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self::new(self.r * other.r, self.g * other.g, self.b * other.b)
    }
}

impl std::ops::Mul<f64> for LinearSrgb {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        self.map(|channel| channel * factor)
    }
}

impl std::ops::Div<f64> for LinearSrgb {
    type Output = Self;
    fn div(self, divisor: f64) -> Self {
        self.map(|channel| channel / divisor)
    }
}

/// A linear map from linear sRGB to three channels, such as CIE XYZ; one row per channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourMatrix([[f64; 3]; 3]);

impl ColourMatrix {
    /// Leaves every colour unchanged.
    pub const IDENTITY: Self = Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    /// Maps every colour to black.
    pub const ZERO: Self = Self([[0.0; 3]; 3]);

    /// For light of one wavelength with the given channel values.
    pub fn of_wavelength(channels: [f64; 3], wavelength: Nanometres) -> Self {
        let row = ColourBasis::at(wavelength).row();
        Self(channels.map(|channel| row.map(|part| channel * part)))
    }

    /// From its rows, concatenated.
    pub fn from_array(values: [f64; 9]) -> Self {
        Self(std::array::from_fn(|row| {
            std::array::from_fn(|column| values[3 * row + column])
        }))
    }

    /// Its rows, concatenated.
    pub fn to_array(self) -> [f64; 9] {
        std::array::from_fn(|index| self.0[index / 3][index % 3])
    }

    /// The matrix times a colour.
    pub fn apply(&self, colour: LinearSrgb) -> LinearSrgb {
        let colour = colour.to_array();
        let row = |row: &[f64; 3]| row[0] * colour[0] + row[1] * colour[1] + row[2] * colour[2];
        LinearSrgb::new(row(&self.0[0]), row(&self.0[1]), row(&self.0[2]))
    }

    /// Every element times a factor.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self(self.0.map(|row| row.map(|value| value * factor)))
    }

    /// Channels of white.
    pub fn of_white(&self) -> LinearSrgb {
        self.apply(LinearSrgb::WHITE)
    }
}

impl std::ops::Add for ColourMatrix {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let (a, b) = (self.to_array(), other.to_array());
        Self::from_array(std::array::from_fn(|index| a[index] + b[index]))
    }
}

impl std::iter::Sum for ColourMatrix {
    fn sum<I: Iterator<Item = Self>>(parts: I) -> Self {
        parts.fold(Self::ZERO, |sum, part| sum + part)
    }
}

/// Weights of red, green and blue in an RGB factor at one wavelength. They sum to 1, so that grey stays unchanged and
/// fractions that sum to 1 still do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourBasis([f64; 3]);

/// The weights every [`STEP_NM`] across the visible range.
static TABLE: LazyLock<Vec<[f64; 3]>> = LazyLock::new(|| {
    columns(include_str!("../../assets/spectra/srgb_parts.csv"))
        .map(|row| [row[1], row[2], row[3]])
        .collect()
});

/// Between two rows [nm].
const STEP_NM: f64 = 5.0;

impl ColourBasis {
    /// At a wavelength: linear between rows of the table, clamped to its ends.
    pub fn at(wavelength: Nanometres) -> Self {
        let last = TABLE.len() - 1;
        let place = ((wavelength.0 - VISIBLE.start().0) / STEP_NM).clamp(0.0, last as f64);
        let index = (place as usize).min(last - 1);
        let along = place - index as f64;
        let (below, above) = (TABLE[index], TABLE[index + 1]);
        Self(std::array::from_fn(|i| below[i] + along * (above[i] - below[i])))
    }

    /// Weights of red, green and blue, [0, 1].
    pub fn row(&self) -> [f64; 3] {
        self.0
    }

    /// An RGB factor [0, 1] at this wavelength, as grey.
    pub fn tone(&self, factor: LinearSrgb) -> LinearSrgb {
        if factor.r == factor.g && factor.g == factor.b {
            return factor;
        }
        let [r, g, b] = self.0;
        LinearSrgb::grey(r * factor.r + g * factor.g + b * factor.b)
    }
}
