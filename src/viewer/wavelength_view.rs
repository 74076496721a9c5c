//! Maps of which wavelength their light looks like, in the colours of the spectrum.

use std::sync::Arc;

use crate::illumination::IlluminationMap;
use crate::optics::spectrum::xyz::to_display_gamut;
use crate::optics::spectrum::{Hue, Xyz, dominant, xyz_bar};
use crate::optics::{LinearSrgb, Nanometres};
use crate::settings::LayerKind;

/// Ends of the legend [nm]; what lies beyond has their colours.
pub const RANGE_NM: (f64, f64) = (400.0, 700.0);
/// Texels darker than this, of the brightest, are black.
const DARK: f64 = 1e-3;
/// Of white light.
const GREY: LinearSrgb = LinearSrgb::new(0.25, 0.25, 0.25);
/// Of light that no single wavelength looks like.
const PURPLE: LinearSrgb = LinearSrgb::new(0.16, 0.02, 0.16);

/// Colour of a wavelength in linear light, its strongest channel 1.
pub fn colour(wavelength: Nanometres) -> LinearSrgb {
    let within = Nanometres(wavelength.0.clamp(RANGE_NM.0, RANGE_NM.1));
    let seen = to_display_gamut(Xyz::from(xyz_bar(within)).to_linear_srgb());
    seen * seen.max_channel().recip()
}

/// The maps' light as colours in linear light, to be shown as they are.
pub fn maps(maps: &[IlluminationMap]) -> Vec<IlluminationMap> {
    let totals: Vec<Vec<[f32; 3]>> = maps.iter().map(IlluminationMap::total).collect();
    let of = |texel: &[f32; 3]| LinearSrgb::from(texel.map(f64::from));
    let luminances = totals.iter().flatten().map(|texel| of(texel).luminance());
    let least = DARK * luminances.filter(|value| value.is_finite()).fold(0.0, f64::max);
    let shown = |texel: &[f32; 3]| {
        let light = of(texel);
        if !light.is_finite() {
            // To be shown as what it is.
            return *texel;
        }
        let hue = dominant(light).filter(|_| light.luminance() >= least);
        let colour = match hue {
            None => LinearSrgb::BLACK,
            Some(Hue::White) => GREY,
            Some(Hue::Purple) => PURPLE,
            Some(Hue::Spectral(wavelength)) => colour(wavelength),
        };
        colour.to_array().map(|channel| channel as f32)
    };
    let coloured = |(map, total): (&IlluminationMap, &Vec<[f32; 3]>)| {
        IlluminationMap::of_layer(
            Arc::clone(&map.chart),
            LayerKind::Caustic,
            total.iter().map(shown).collect(),
        )
    };
    maps.iter().zip(&totals).map(coloured).collect()
}
