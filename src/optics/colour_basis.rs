//! What factors in RGB are at one wavelength: a linear upsampling for what light meets on its way.

use std::sync::LazyLock;

use super::spectrum::SmoothSpectrum;
use super::{LinearSrgb, Nanometres};

/// The parts that red, green and blue have in a factor at one wavelength; they add up to 1, so that grey stays what it
/// is and shares that add up to 1 still do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourBasis([f64; 3]);

/// Smooth spectra of the three primaries.
static PRIMARIES: LazyLock<[SmoothSpectrum; 3]> = LazyLock::new(|| {
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|primary| {
        SmoothSpectrum::from_colour(LinearSrgb::from(primary)).expect("primaries have spectra")
    })
});

impl ColourBasis {
    /// At a wavelength.
    pub fn at(wavelength: Nanometres) -> Self {
        let parts = PRIMARIES.each_ref().map(|primary| primary.at(wavelength));
        let sum: f64 = parts.iter().sum();
        Self(parts.map(|part| part / sum))
    }

    /// The parts of red, green and blue.
    pub fn parts(&self) -> [f64; 3] {
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
