//! What factors in RGB are at one wavelength: a linear upsampling for what light meets on its way.
//!
//! Three spectra that are 0 or more, add up to 1 at every wavelength and have the primaries' colours under D65: so every
//! factor comes back in its own colour, and stays within its least and largest channel. The idea of a partition of
//! unity is that of I. Mallett and C. Yuksel, Spectral Primary Decomposition for Rendering with sRGB Reflectance
//! (2019); the figures are our own (see assets/SOURCES.md).

use std::sync::LazyLock;

use super::spectrum::csv::columns;
use super::wavelength::VISIBLE;
use super::{LinearSrgb, Nanometres};

/// The parts that red, green and blue have in a factor at one wavelength; they add up to 1, so that grey stays what it
/// is and shares that add up to 1 still do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourBasis([f64; 3]);

/// The parts every [`STEP_NM`] of the visible.
static TABLE: LazyLock<Vec<[f64; 3]>> = LazyLock::new(|| {
    columns(include_str!("../../assets/spectra/srgb_parts.csv"))
        .map(|row| [row[1], row[2], row[3]])
        .collect()
});

/// Between two rows [nm].
const STEP_NM: f64 = 5.0;

impl ColourBasis {
    /// At a wavelength: linear between rows of the table; outside of the visible as at its end.
    pub fn at(wavelength: Nanometres) -> Self {
        let last = TABLE.len() - 1;
        let place = ((wavelength.0 - VISIBLE.start().0) / STEP_NM).clamp(0.0, last as f64);
        let index = (place as usize).min(last - 1);
        let along = place - index as f64;
        let (below, above) = (TABLE[index], TABLE[index + 1]);
        Self(std::array::from_fn(|i| below[i] + along * (above[i] - below[i])))
    }

    /// The parts of red, green and blue, [0, 1]: what a factor's channels are multiplied by and added up.
    pub fn row(&self) -> [f64; 3] {
        self.0
    }

    /// A factor [0, 1] per channel, as the same grey in all channels.
    pub fn tone(&self, factor: LinearSrgb) -> LinearSrgb {
        if factor.r == factor.g && factor.g == factor.b {
            return factor;
        }
        let [r, g, b] = self.0;
        LinearSrgb::grey(r * factor.r + g * factor.g + b * factor.b)
    }
}
