//! What becomes of a factor or a flux in linear sRGB when light is seen in other channels.

use super::{ColourBasis, LinearSrgb, Nanometres};

/// A linear map from linear sRGB to three channels, such as CIE XYZ; a row for each channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourMatrix([[f64; 3]; 3]);

impl ColourMatrix {
    /// All stays as it is.
    pub const IDENTITY: Self = Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    /// Nothing is left.
    pub const ZERO: Self = Self([[0.0; 3]; 3]);

    /// For light of one wavelength that has such values in the channels.
    pub fn of_wavelength(channels: [f64; 3], wavelength: Nanometres) -> Self {
        let row = ColourBasis::at(wavelength).row();
        Self(channels.map(|channel| row.map(|part| channel * part)))
    }

    /// From its rows, one after the other.
    pub fn from_array(values: [f64; 9]) -> Self {
        Self(std::array::from_fn(|row| {
            std::array::from_fn(|column| values[3 * row + column])
        }))
    }

    /// Its rows, one after the other.
    pub fn to_array(self) -> [f64; 9] {
        std::array::from_fn(|index| self.0[index / 3][index % 3])
    }

    /// The channels of a colour.
    pub fn apply(&self, colour: LinearSrgb) -> LinearSrgb {
        let colour = colour.to_array();
        let row = |row: &[f64; 3]| row[0] * colour[0] + row[1] * colour[1] + row[2] * colour[2];
        LinearSrgb::new(row(&self.0[0]), row(&self.0[1]), row(&self.0[2]))
    }

    /// So many times as much.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self(self.0.map(|row| row.map(|value| value * factor)))
    }

    /// What white becomes.
    pub fn of_white(&self) -> LinearSrgb {
        self.apply(LinearSrgb::WHITE)
    }

    /// For light of a colour: channel by channel, the parts that red, green and blue have in it.
    #[must_use]
    pub fn weighing(&self, colour: LinearSrgb) -> Self {
        let colour = colour.to_array();
        Self(
            self.0
                .map(|row| std::array::from_fn(|column| row[column] * colour[column])),
        )
    }

    /// For factors on light whose channels are made of such parts: what a factor is in each channel. Of a channel that
    /// has nothing, as in its neighbours: the mean of the three.
    #[must_use]
    pub fn per_channel(&self) -> Self {
        Self(self.0.map(|row| {
            let sum: f64 = row.iter().sum();
            if sum > 0.0 {
                row.map(|part| part / sum)
            } else {
                [1.0 / 3.0; 3]
            }
        }))
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
