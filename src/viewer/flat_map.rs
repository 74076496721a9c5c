//! A map as a flat picture: thumbnails, crops, and the value under the pointer.

use std::f64::consts::PI;

use crate::eye_pass::tone_mapping::display_rgba8;
use crate::eye_pass::{Picture, ToneMap};
use crate::illumination::IlluminationMap;
use crate::optics::luminance;
use crate::settings::LayerKind;

/// Longest side of a thumbnail [pixels].
pub const THUMBNAIL: usize = 64;
/// Largest number of samples per pixel along a side.
const MAX_SAMPLES: f64 = 4.0;

/// The part of a map that a picture shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapCrop {
    /// Column at the picture's left edge [finest texels]; may lie outside the map.
    pub left: f64,
    /// Row at the picture's top edge [finest texels]; may lie outside the map.
    pub top: f64,
    /// Texels per pixel along a side, > 0.
    pub texels_per_pixel: f64,
}

/// Encoded pixels of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ShownPixels {
    /// Width and height.
    pub size: [usize; 2],
    /// sRGB and opacity, row by row; transparent outside the map.
    pub rgba: Vec<u8>,
}

/// The values of a map's texel.
#[derive(Clone, Debug, PartialEq)]
pub struct MapReading {
    /// Column and row [finest texels].
    pub texel: [usize; 2],
    /// Luminance of the irradiance in each layer [W/m²].
    pub layers_w_per_m2: Vec<(LayerKind, f64)>,
    /// Estimated error of their sum [W/m²]; `None` if it was not estimated.
    pub error_w_per_m2: Option<f64>,
}

/// The whole map, at most [`THUMBNAIL`] pixels wide and high, with an exposure of its own.
pub fn thumbnail(map: &IlluminationMap) -> ShownPixels {
    let longest = map.width().max(map.height()) as f64;
    let texels_per_pixel = longest / THUMBNAIL as f64;
    let pixels = |texels: usize| ((texels as f64 / texels_per_pixel).round() as usize).max(1);
    let size = [pixels(map.width()), pixels(map.height())];
    let part = MapCrop {
        left: 0.0,
        top: 0.0,
        texels_per_pixel,
    };
    show(map, part, size, exposure_stops(map))
}

/// Exposure that suits the map alone [stops].
pub fn exposure_stops(map: &IlluminationMap) -> f64 {
    let side = 64;
    let step = |length: usize, index: usize| (2 * index + 1) * length / (2 * side);
    let places =
        (0..side * side).map(|index| (step(map.width(), index % side), step(map.height(), index / side)));
    let picture = Picture {
        width: side as u32,
        height: side as u32,
        radiance: places.map(|(column, row)| radiance(map, column, row)).collect(),
    };
    picture.auto_exposure_stops()
}

/// A part of a map as a picture of `size` pixels, exposed by that many stops. It looks like white paper lit by the
/// map's light.
pub fn show(map: &IlluminationMap, part: MapCrop, size: [usize; 2], exposure_stops: f64) -> ShownPixels {
    let places = (0..size[0] * size[1]).map(|index| [index % size[0], index / size[0]]);
    let means: Vec<Option<[f32; 3]>> = places.map(|place| mean(map, part, place)).collect();
    let picture = Picture {
        width: size[0] as u32,
        height: size[1] as u32,
        radiance: means.iter().map(|mean| mean.unwrap_or_default()).collect(),
    };
    let mut rgba = display_rgba8(&picture, exposure_stops, ToneMap::Neutral);
    for (pixel, mean) in rgba.chunks_exact_mut(4).zip(&means) {
        if mean.is_none() {
            pixel.fill(0);
        }
    }
    ShownPixels { size, rgba }
}

/// The values at a point [finest texels]; `None` outside the map.
pub fn read(map: &IlluminationMap, x: f64, y: f64) -> Option<MapReading> {
    let (column, row) = inside(map, x, y)?;
    let texel = map.chart.texel_at(column, row);
    Some(MapReading {
        texel: [column, row],
        layers_w_per_m2: layers_at(map, texel),
        error_w_per_m2: map.error.as_ref().map(|error| f64::from(error[texel])),
    })
}

/// Luminance of the irradiance in each layer of a texel [W/m²].
pub fn layers_at(map: &IlluminationMap, texel: usize) -> Vec<(LayerKind, f64)> {
    let layers = map.layers.iter();
    layers
        .map(|layer| (layer.kind, luminance(&layer.irradiance[texel])))
        .collect()
}

fn inside(map: &IlluminationMap, x: f64, y: f64) -> Option<(usize, usize)> {
    let is_inside = x >= 0.0 && y >= 0.0 && x < map.width() as f64 && y < map.height() as f64;
    is_inside.then_some((x as usize, y as usize))
}

/// Mean radiance of a pixel; `None` if its centre is outside the map.
fn mean(map: &IlluminationMap, part: MapCrop, [x, y]: [usize; 2]) -> Option<[f32; 3]> {
    let at = |origin: f64, pixel: usize, share: f64| origin + (pixel as f64 + share) * part.texels_per_pixel;
    inside(map, at(part.left, x, 0.5), at(part.top, y, 0.5))?;
    let samples = part.texels_per_pixel.ceil().clamp(1.0, MAX_SAMPLES) as usize;
    let share = |index: usize| (index as f64 + 0.5) / samples as f64;
    let mut sum = [0.0; 3];
    let mut count = 0.0_f32;
    for (i, j) in (0..samples * samples).map(|index| (index % samples, index / samples)) {
        if let Some((column, row)) = inside(map, at(part.left, x, share(i)), at(part.top, y, share(j))) {
            let radiance = radiance(map, column, row);
            sum = [0, 1, 2].map(|channel| sum[channel] + radiance[channel]);
            count += 1.0;
        }
    }
    Some(sum.map(|channel| channel / count.max(1.0)))
}

/// Radiance of white paper under the light of all layers [W/(m² sr)].
fn radiance(map: &IlluminationMap, column: usize, row: usize) -> [f32; 3] {
    let texel = map.chart.texel_at(column, row);
    let of_layers = map.layers.iter().map(|layer| layer.irradiance[texel]);
    let sum = of_layers.fold([0.0; 3], |sum: [f32; 3], e| {
        [sum[0] + e[0], sum[1] + e[1], sum[2] + e[2]]
    });
    sum.map(|channel| channel / PI as f32)
}
