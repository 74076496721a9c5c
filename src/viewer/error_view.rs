//! Maps of how far the light may be off, in false colours with a legend.

use std::sync::Arc;

use crate::illumination::IlluminationMap;
use crate::optics::LinearSrgb;
use crate::settings::LayerKind;

/// Relative errors at the ends of the scale, logarithmic between them: 0.1 % and 100 % of the map's mean.
pub const RANGE: (f64, f64) = (1e-3, 1.0);

/// Display colours (sRGB) at even steps of the scale: dark and cool where the light is exact, bright where it is not.
const STOPS: [[u8; 3]; 5] = [
    [16, 24, 64],
    [40, 84, 140],
    [48, 150, 110],
    [230, 200, 60],
    [250, 90, 50],
];

/// Display colour (sRGB) of an error relative to the map's mean, ≥ 0; both ends of the scale go on.
pub fn colour(relative: f64) -> [u8; 3] {
    let (low, high) = RANGE;
    let place = ((relative / low).log10() / (high / low).log10()).clamp(0.0, 1.0);
    // NaN has no place on the scale, and is as wrong as can be.
    let place = if place.is_nan() { 1.0 } else { place } * (STOPS.len() - 1) as f64;
    let index = (place as usize).min(STOPS.len() - 2);
    let share = place - index as f64;
    std::array::from_fn(|channel| {
        let (a, b) = (
            f64::from(STOPS[index][channel]),
            f64::from(STOPS[index + 1][channel]),
        );
        (a + (b - a) * share).round() as u8
    })
}

/// Whether the maps tell how far they may be off.
pub fn is_available(maps: &[IlluminationMap]) -> bool {
    maps.iter().any(|map| map.error.is_some())
}

/// The maps' errors as colours in linear light, to be shown as they are. Maps without an error are left out.
pub fn maps(maps: &[IlluminationMap]) -> Vec<IlluminationMap> {
    maps.iter()
        .filter_map(|map| {
            let error = map.error.as_ref()?;
            let mean = mean_luminance(map);
            let colours = error.iter().map(|error| {
                let relative = if mean > 0.0 { f64::from(*error) / mean } else { 0.0 };
                colour(relative).map(|code| LinearSrgb::decode_channel(code) as f32)
            });
            Some(IlluminationMap::of_layer(
                Arc::clone(&map.chart),
                LayerKind::Caustic,
                colours.collect(),
            ))
        })
        .collect()
}

/// Mean luminance of a map over its surface [W/m²]: flux by area.
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
