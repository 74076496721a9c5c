//! Maps of what an effect adds or takes away, in false colours with a legend.

use std::sync::Arc;

use crate::illumination::difference::{Difference, SignedMap};
use crate::illumination::{IlluminationMap, Layer};
use crate::optics::LinearSrgb;
use crate::settings::LayerKind;

/// Differences relative to the map's mean between the middle of the scale and its ends, logarithmic between them: 1 %
/// and 1000 %, either way.
pub const RANGE: (f64, f64) = (1e-2, 10.0);

/// Display colours (sRGB) from no difference to the end of the scale where light is added: warm.
const ADDED: [[u8; 3]; 4] = [[38, 38, 42], [128, 52, 24], [232, 122, 32], [255, 226, 150]];
/// The same where light is taken away: cool.
const TAKEN: [[u8; 3]; 4] = [[38, 38, 42], [24, 62, 128], [52, 140, 226], [190, 230, 255]];

/// Display colour (sRGB) of a difference relative to the map's mean; both ends of the scale go on.
pub fn colour(relative: f64) -> [u8; 3] {
    let stops = if relative < 0.0 { TAKEN } else { ADDED };
    let place = place(relative.abs()) * (stops.len() - 1) as f64;
    let index = (place as usize).min(stops.len() - 2);
    let share = place - index as f64;
    std::array::from_fn(|channel| {
        let (a, b) = (
            f64::from(stops[index][channel]),
            f64::from(stops[index + 1][channel]),
        );
        (a + (b - a) * share).round() as u8
    })
}

/// Where a size of a difference lies between the middle of the scale (0) and its ends (1).
fn place(size: f64) -> f64 {
    let (low, high) = RANGE;
    let place = ((size / low).log10() / (high / low).log10()).clamp(0.0, 1.0);
    if place.is_nan() { 0.0 } else { place }
}

/// The difference at a place of the scale from one end (−1) to the other (1).
pub fn at(place: f64) -> f64 {
    let (low, high) = RANGE;
    (low * (high / low).powf(place.abs())).copysign(place)
}

/// The differences as colours in linear light, to be shown as they are.
pub fn maps(difference: &Difference) -> Vec<IlluminationMap> {
    difference.maps.iter().map(coloured).collect()
}

fn coloured(map: &SignedMap) -> IlluminationMap {
    let colours = map.irradiance.iter().map(|difference| {
        let relative = if map.mean_w_m2 > 0.0 {
            f64::from(*difference) / map.mean_w_m2
        } else {
            0.0
        };
        colour(relative).map(|code| LinearSrgb::decode_channel(code) as f32)
    });
    IlluminationMap {
        chart: Arc::clone(&map.chart),
        layers: vec![Layer {
            kind: LayerKind::Caustic,
            irradiance: colours.collect(),
        }],
        error: None,
        estimated_relative_rmse: None,
    }
}
