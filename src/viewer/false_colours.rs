//! False colours with a legend: estimated error, contribution of an effect, dominant wavelength.

use std::sync::Arc;

use crate::illumination::difference::Difference;
use crate::illumination::false_colours::mixed;
use crate::illumination::{Chart, IlluminationMap, difference_colours};
use crate::optics::spectrum::xyz::to_display_gamut;
use crate::optics::spectrum::{Hue, Xyz, dominant, xyz_bar};
use crate::optics::{LinearSrgb, Nanometres};
use crate::settings::LayerKind;

/// A map of linear colours that are shown unchanged.
fn coloured(chart: &Arc<Chart>, colours: impl Iterator<Item = [f32; 3]>) -> IlluminationMap {
    IlluminationMap::of_layer(Arc::clone(chart), LayerKind::Caustic, colours.collect())
}

fn decoded(code: [u8; 3]) -> [f32; 3] {
    code.map(|code| LinearSrgb::decode_channel(code) as f32)
}

/// Range of the scale of relative errors, logarithmic: 0.1 % to 100 % of the map's mean.
pub const ERROR_RANGE: (f64, f64) = (1e-3, 1.0);

/// sRGB colours at equal steps of the scale: dark and cool for small errors, bright for large ones.
const STOPS: [[u8; 3]; 5] = [
    [16, 24, 64],
    [40, 84, 140],
    [48, 150, 110],
    [230, 200, 60],
    [250, 90, 50],
];

/// sRGB colour of an error relative to the map's mean, ≥ 0; clamped to the scale.
pub fn error_colour(relative: f64) -> [u8; 3] {
    let (low, high) = ERROR_RANGE;
    let place = ((relative / low).log10() / (high / low).log10()).clamp(0.0, 1.0);
    // NaN counts as the largest error.
    mixed(&STOPS, if place.is_nan() { 1.0 } else { place })
}

/// Whether any map has estimated errors.
pub fn has_errors(maps: &[IlluminationMap]) -> bool {
    maps.iter().any(|map| map.error.is_some())
}

/// The errors of the maps as linear colours that are shown unchanged. Maps without errors are left out.
pub fn error_maps(maps: &[IlluminationMap]) -> Vec<IlluminationMap> {
    maps.iter()
        .filter_map(|map| {
            let error = map.error.as_ref()?;
            let mean = mean_luminance(map);
            let relative = |error: f64| if mean > 0.0 { error / mean } else { 0.0 };
            let colours = error
                .iter()
                .map(|error| error_colour(relative(f64::from(*error))));
            Some(coloured(&map.chart, colours.map(decoded)))
        })
        .collect()
}

/// Mean luminance of a map's irradiance over its surface [W/m²].
fn mean_luminance(map: &IlluminationMap) -> f64 {
    let flux_w: f64 = map
        .layers
        .iter()
        .map(|layer| map.flux_w(layer.kind).luminance())
        .sum();
    let texels = map.chart.texel_count();
    let area_m2: f64 = (0..texels).map(|texel| map.chart.texel_area_m2(texel)).sum();
    if area_m2 > 0.0 { flux_w / area_m2 } else { 0.0 }
}

/// The differences as linear colours that are shown unchanged.
pub fn difference_maps(difference: &Difference) -> Vec<IlluminationMap> {
    let maps = difference.maps.iter();
    maps.map(|map| coloured(&map.chart, difference_colours::of_map(map).map(decoded)))
        .collect()
}

/// Range of the legend [nm]; wavelengths beyond it are clamped.
pub const RANGE_NM: (f64, f64) = (400.0, 700.0);
/// Texels with a luminance below this fraction of the largest are black.
const DARK: f64 = 1e-3;
/// Colour for white light.
const GREY: LinearSrgb = LinearSrgb::new(0.25, 0.25, 0.25);
/// Colour for purple light, which has no dominant wavelength.
const PURPLE: LinearSrgb = LinearSrgb::new(0.16, 0.02, 0.16);

/// Linear colour of a wavelength; its largest channel is 1.
pub fn wavelength_colour(wavelength: Nanometres) -> LinearSrgb {
    let within = Nanometres(wavelength.0.clamp(RANGE_NM.0, RANGE_NM.1));
    let seen = to_display_gamut(Xyz::from(xyz_bar(within)).to_linear_srgb());
    seen * seen.max_channel().recip()
}

/// The dominant wavelengths of the maps' light as linear colours that are shown unchanged.
pub fn wavelength_maps(maps: &[IlluminationMap]) -> Vec<IlluminationMap> {
    let totals: Vec<Vec<[f32; 3]>> = maps.iter().map(IlluminationMap::total).collect();
    let of = |texel: &[f32; 3]| LinearSrgb::from(texel.map(f64::from));
    let luminances = totals.iter().flatten().map(|texel| of(texel).luminance());
    let least = DARK * luminances.filter(|value| value.is_finite()).fold(0.0, f64::max);
    let shown = |texel: &[f32; 3]| {
        let light = of(texel);
        if !light.is_finite() {
            // Kept, so that the picture marks it as a fault.
            return *texel;
        }
        let hue = dominant(light).filter(|_| light.luminance() >= least);
        let colour = match hue {
            None => LinearSrgb::BLACK,
            Some(Hue::White) => GREY,
            Some(Hue::Purple) => PURPLE,
            Some(Hue::Spectral(wavelength)) => wavelength_colour(wavelength),
        };
        colour.to_array().map(|channel| channel as f32)
    };
    let maps = maps.iter().zip(&totals);
    maps.map(|(map, total)| coloured(&map.chart, total.iter().map(shown)))
        .collect()
}
