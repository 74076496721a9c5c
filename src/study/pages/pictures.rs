//! Maps and views as pictures.

use crate::error::Result;
use crate::eye_pass::reference::{self, ReferenceSettings};
use crate::eye_pass::tone_mapping::{auto_exposure_stops, display_rgba8};
use crate::eye_pass::{ToneMap, View};
use crate::illumination::IlluminationMap;
use crate::illumination::compare::{Grid, mean};
use crate::optics::LinearSrgb;
use crate::scene::{Camera, Scene};
use crate::study::page::Picture;
use crate::transport::Tracer;

use std::sync::Arc;

use cpu_time::ProcessTime;

use super::Bench;

/// So many times the mean of the first map is white.
const WHITE_OVER_MEAN: f64 = 6.0;

/// Pixels between two maps.
const GAP: usize = 4;

/// Of the gaps.
const GAP_GREY: u8 = 90;

/// Maps side by side, `columns` of them in a row, each `side` pixels across; all at the exposure of the first.
pub(super) fn sheet(
    name: &'static str,
    caption: String,
    maps: &[Grid],
    (columns, side): (usize, usize),
) -> Picture {
    let white = maps
        .first()
        .map_or(1.0, |map| WHITE_OVER_MEAN * mean(&map.values));
    let rows = maps.len().div_ceil(columns);
    let step = side + GAP;
    let (width, height) = (columns * step - GAP, rows * step - GAP);
    let mut rgba = Vec::with_capacity(4 * width * height);
    for y in 0..height {
        for x in 0..width {
            let map = maps.get(y / step * columns + x / step);
            let grey = match map {
                Some(map) if x % step < side && y % step < side => {
                    let (column, row) = (x % step * map.width / side, y % step * map.height / side);
                    shade(map.values[row * map.width + column] / white)
                }
                _ => GAP_GREY,
            };
            rgba.extend_from_slice(&[grey, grey, grey, 255]);
        }
    }
    Picture {
        name,
        caption,
        size: (width as u32, height as u32),
        rgba,
    }
}

fn shade(value: f64) -> u8 {
    let encoded = LinearSrgb::encode_channel(value.clamp(0.0, 1.0));
    (255.0 * encoded).round() as u8
}

/// What the reference's ray tracer sees, and the CPU seconds that it took.
pub(super) fn view(
    bench: &Bench,
    (name, caption): (&'static str, String),
    scene: &Arc<Scene>,
    maps: &[IlluminationMap],
    camera: Camera,
) -> Result<(Picture, f64)> {
    let (width, height) = if bench.quick { (80, 60) } else { (640, 480) };
    let mut view = View {
        camera,
        width,
        height,
        exposure_stops: 0.0,
        tone_map: ToneMap::default(),
        background: LinearSrgb::BLACK,
    };
    let tracer = Tracer::new(Arc::clone(scene));
    let settings = ReferenceSettings {
        samples_per_side: if bench.quick { 1 } else { 2 },
        ..ReferenceSettings::default()
    };
    let clock = ProcessTime::now();
    let seen = reference::render(&tracer, maps, &view, &settings, bench.progress, bench.control)?;
    let cpu_s = clock.elapsed().as_secs_f64();
    view.exposure_stops = auto_exposure_stops(&seen);
    let picture = Picture {
        name,
        caption,
        size: (width, height),
        rgba: display_rgba8(&seen, view.exposure_stops, view.tone_map),
    };
    Ok((picture, cpu_s))
}
