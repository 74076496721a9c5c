//! Colours in linear light.

use serde::{Deserialize, Serialize};

/// A triple in linear sRGB (Rec. 709 primaries, D65 white). As a factor it has no unit; as a quantity its name says
/// the unit, and its [luminance](Self::luminance) is the luminous-equivalent value.
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
    /// Nothing.
    pub const BLACK: Self = Self::grey(0.0);
    /// One in every channel.
    pub const WHITE: Self = Self::grey(1.0);

    /// The three channels.
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

    /// Channels as an array.
    pub const fn to_array(self) -> [f64; 3] {
        [self.r, self.g, self.b]
    }

    /// The function applied to each channel.
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

    /// From one 8-bit sRGB-encoded channel (IEC 61966-2-1) to linear light [0, 1].
    pub fn decode_channel(encoded: u8) -> f64 {
        let value = f64::from(encoded) / 255.0;
        if value <= 0.040_45 {
            value / 12.92
        } else {
            ((value + 0.055) / 1.055).powf(2.4)
        }
    }

    /// From linear light, cut to [0, 1], to the sRGB encoding [0, 1] (IEC 61966-2-1): for display only.
    pub fn encode_channel(linear: f64) -> f64 {
        let value = linear.clamp(0.0, 1.0);
        if value <= 0.003_130_8 {
            value * 12.92
        } else {
            1.055 * value.powf(1.0 / 2.4) - 0.055
        }
    }
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
