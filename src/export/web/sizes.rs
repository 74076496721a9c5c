//! As few texels as show the light of a map.

use crate::export::textures::texels::Texels;
use crate::illumination::IlluminationMap;
use crate::optics::luminance;

/// Longest side of a texture of the page [texels]: graphics cards of phones hold no more of many.
pub(super) const MAX_SIDE: usize = 2048;
/// A layer is made half as fine as long as it differs by no more than this, or than half of the error that the bake
/// estimates: root mean squares, relative to the light there and a tenth of the mean of all layers [1].
const ALIKE: f64 = 0.01;
const SHARE_OF_ERROR: f64 = 0.5;
/// Shortest side of a layer that is halved [texels]: below, nothing is gained.
const MIN_SIDE: usize = 32;

/// Each layer of a map in the size that it needs.
pub(super) fn fitted(map: &IlluminationMap) -> Vec<Texels> {
    let total = map.total();
    let floor = 0.1 * total.iter().map(luminance).sum::<f64>() / total.len() as f64;
    let errors = map.error.iter().flatten().zip(&total);
    let error = rms(errors.map(|(error, light)| f64::from(*error) / (luminance(light) + floor)));
    let tolerance = ALIKE.hypot(SHARE_OF_ERROR * error);
    let layers = map.layers.iter();
    let texels = layers.map(|layer| Texels::new(&map.chart, &layer.irradiance, 1.0));
    texels.map(|texels| shrunk(texels, floor, tolerance)).collect()
}

/// Root mean square of those that are finite; 0 of none.
fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let squares = values
        .map(|value| value * value)
        .filter(|square| square.is_finite());
    let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), square| (sum + square, count + 1.0));
    f64::sqrt(sum / f64::max(count, 1.0))
}

fn shrunk(mut texels: Texels, floor: f64, tolerance: f64) -> Texels {
    loop {
        let (width, height) = texels.size();
        if width % 2 != 0 || height % 2 != 0 || width.min(height) <= MIN_SIDE {
            return texels;
        }
        let half = texels.halved();
        if width.max(height) <= MAX_SIDE && difference(&texels, &half, floor) > tolerance {
            return texels;
        }
        texels = half;
    }
}

/// How far a picture of half the size is off where it is looked up between its texels, relative to the light there and
/// `floor` [W/m²].
fn difference(texels: &Texels, half: &Texels, floor: f64) -> f64 {
    let (width, _) = texels.size();
    let (across, down) = half.size();
    let at = |column: usize, row: usize| luminance(&half.values()[row * across + column]);
    // The nearer and the farther of two texels of half the size, from the middle of a quarter of the nearer.
    let both = |place: usize, count: usize| {
        let beside = if place.is_multiple_of(2) {
            (place / 2).saturating_sub(1)
        } else {
            place / 2 + 1
        };
        (place / 2, beside.min(count - 1))
    };
    rms(texels.values().iter().enumerate().map(|(texel, value)| {
        let ((near, far), (upper, lower)) = (both(texel % width, across), both(texel / width, down));
        let row = |row: usize| 0.75 * at(near, row) + 0.25 * at(far, row);
        let (wanted, found) = (luminance(value), 0.75 * row(upper) + 0.25 * row(lower));
        (found - wanted) / (wanted.max(0.0) + floor)
    }))
}
