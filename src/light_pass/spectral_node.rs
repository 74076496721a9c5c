//! One traced wavelength and its weight.

use std::ops::RangeInclusive;

use crate::optics::spectrum::{Spectrum, Xyz, xyz_bar};
use crate::optics::{ColourMatrix, LinearSrgb, Nanometres};
use crate::transport::Tracer;

/// A traced wavelength.
#[derive(Debug)]
pub struct SpectralNode {
    /// The scene at this wavelength.
    pub tracer: Tracer,
    /// From RGB to the CIE XYZ of all wavelengths that the node represents, for a lamp of 1 W (luminous-equivalent).
    pub channels: ColourMatrix,
    pub wavelength: Nanometres,
    /// Distinguishes its rays from those of the light's other wavelengths.
    pub number: u32,
}

/// ∫ Φ(λ) w(λ) (x̄, ȳ, z̄)(λ) dλ over a range, as a matrix for light with RGB factors on its path.
pub fn channels_within(
    lamp: &Spectrum,
    range: RangeInclusive<Nanometres>,
    weight: impl Fn(Nanometres) -> f64,
) -> ColourMatrix {
    ColourMatrix::from_array(lamp.integral_times(range, |wavelength| {
        let weight = weight(wavelength);
        let channels = xyz_bar(wavelength).map(|channel| channel * weight);
        ColourMatrix::of_wavelength(channels, wavelength).to_array()
    }))
}

/// To linear sRGB from X, Y and Z, held as red, green and blue.
pub fn to_linear_srgb(channels: LinearSrgb) -> LinearSrgb {
    let [x, y, z] = channels.to_array();
    Xyz { x, y, z }.to_linear_srgb()
}

/// Variable in which refractive indices are smoothest [nm⁻²].
pub fn place_of(wavelength: Nanometres) -> f64 {
    wavelength.0.powi(-2)
}
