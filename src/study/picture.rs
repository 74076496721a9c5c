//! Pictures of a study: maps side by side, views, and differences in false colours.

use std::sync::Arc;

use cpu_time::ProcessTime;

use super::references::{Reference, Truth, lit_side};
use super::sweep::Bench;
use crate::error::Result;
use crate::eye_pass::View;
use crate::eye_pass::reference::{self, ReferenceSettings};
use crate::eye_pass::tone_mapping::display_rgba8;
use crate::illumination::IlluminationMap;
use crate::illumination::difference::Difference;
use crate::illumination::difference_colours;
use crate::optics::LinearSrgb;
use crate::optics::spectrum::xyz::to_display_gamut;
use crate::scene::{Camera, Scene};
use crate::settings::LayerKind;
use crate::transport::Tracer;

/// White of a sheet, relative to the mean of the part of its first map that it shows.
const WHITE_OVER_MEAN: f64 = 6.0;

/// Luminance, relative to the peak of the first map, above which a sheet shows a texel.
const SHOWN: f64 = 5e-3;

/// Minimum length of the longer side of a map in a sheet [pixels].
const MIN_SIDE: usize = 200;

/// Gap between two maps [pixels], and its grey.
const GAP: usize = 4;
const GAP_GREY: [u8; 4] = [90, 90, 90, 255];

/// An 8-bit sRGB picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// File name without `.png`.
    pub file: String,
    /// Lists the contents, row by row.
    pub caption: String,
    /// Width and height [pixels].
    pub size: (u32, u32),
    /// Row 0 at the top.
    pub rgba: Vec<u8>,
}

/// Irradiance of one surface [W/m²], for display.
#[derive(Clone, Debug)]
pub struct Image {
    width: usize,
    height: usize,
    values: Vec<LinearSrgb>,
}

impl Image {
    /// The sum of all layers of a map.
    pub fn of_map(map: &IlluminationMap) -> Self {
        let map = map.dense();
        let values = map
            .total()
            .into_iter()
            .map(|rgb| LinearSrgb::from(rgb.map(f64::from)));
        Self {
            width: map.width(),
            height: map.height(),
            values: values.collect(),
        }
    }

    /// The reference and its object; the brightest surface if there are several.
    pub fn of_reference(reference: &Reference) -> Option<(usize, Self)> {
        match &reference.truth {
            Truth::Surface { object, grid } => Some((
                *object,
                Self {
                    width: grid.width,
                    height: grid.height,
                    values: grid.values.iter().map(|value| LinearSrgb::grey(*value)).collect(),
                },
            )),
            Truth::Maps(maps) => {
                let flux_w = |map: &&IlluminationMap| map.flux_w(LayerKind::Caustic).luminance();
                let brightest = maps.iter().max_by(|a, b| flux_w(a).total_cmp(&flux_w(b)))?;
                let object = brightest.chart.object();
                Some((object, Self::of_map(lit_side(maps, object)?)))
            }
        }
    }

    /// The texel at a position in [0, 1] from the upper left corner.
    fn at(&self, u: f64, v: f64) -> LinearSrgb {
        let index = |share: f64, side: usize| ((share * side as f64) as usize).min(side - 1);
        self.values[index(v, self.height) * self.width + index(u, self.width)]
    }

    /// Columns and rows that enclose everything lit; the whole image if nothing is.
    fn lit_part(&self) -> [std::ops::Range<usize>; 2] {
        let peak = self.values.iter().map(|rgb| rgb.luminance()).fold(0.0, f64::max);
        let lit = |texel: &usize| self.values[*texel].luminance() > SHOWN * peak;
        let texels: Vec<usize> = (0..self.values.len()).filter(lit).collect();
        let range = |place: fn(usize, usize) -> usize, side: usize| {
            let places = texels.iter().map(|texel| place(*texel, self.width));
            let (first, last) = (places.clone().min(), places.max());
            first.zip(last).map_or(0..side, |(first, last)| first..last + 1)
        };
        [
            range(|texel, width| texel % width, self.width),
            range(|texel, width| texel / width, self.height),
        ]
    }
}

/// Maps side by side in rows of `columns`, cropped to the lit part of the first and at its exposure. `None` without
/// maps.
pub fn sheet(file: String, caption: String, images: &[Image], columns: usize) -> Option<Picture> {
    // One crop and one exposure for all maps, so that they can be compared.
    let first = images.first()?;
    let [across, down] = first.lit_part();
    let share = |place: usize, side: usize| place as f64 / side as f64;
    let lit = down
        .clone()
        .flat_map(|row| across.clone().map(move |column| (row, column)));
    let sum: f64 = lit
        .map(|(row, column)| first.values[row * first.width + column].luminance())
        .sum();
    let white = WHITE_OVER_MEAN * sum / (across.len() * down.len()) as f64;

    // Maps are enlarged by a whole factor, so that all texels are squares of the same size.
    let scale = MIN_SIDE.div_ceil(across.len().max(down.len()));
    let cell = [across.len() * scale, down.len() * scale];
    let columns = columns.clamp(1, images.len());
    let size = [
        columns * (cell[0] + GAP) - GAP,
        images.len().div_ceil(columns) * (cell[1] + GAP) - GAP,
    ];

    // A map of another size is sampled at the same places of its surface as the first.
    let mut rgba = Vec::with_capacity(4 * size[0] * size[1]);
    for (y, x) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (y, x))) {
        let (inner_x, inner_y) = (x % (cell[0] + GAP), y % (cell[1] + GAP));
        let image = images.get(y / (cell[1] + GAP) * columns + x / (cell[0] + GAP));
        let pixel = match image.filter(|_| inner_x < cell[0] && inner_y < cell[1]) {
            None => GAP_GREY,
            Some(image) => {
                let texel = |inner: usize| (inner as f64 + 0.5) / scale as f64;
                let u = share(across.start, first.width) + texel(inner_x) / first.width as f64;
                let v = share(down.start, first.height) + texel(inner_y) / first.height as f64;
                let shown = to_display_gamut(image.at(u, v) / white).map(LinearSrgb::encode_channel);
                let [r, g, b] = shown
                    .to_array()
                    .map(|channel| (255.0 * channel.clamp(0.0, 1.0)).round() as u8);
                [r, g, b, u8::MAX]
            }
        };
        rgba.extend_from_slice(&pixel);
    }
    Some(Picture {
        file,
        caption,
        size: (size[0] as u32, size[1] as u32),
        rgba,
    })
}

/// Renders a view with the CPU ray tracer; returns it with the CPU time [s].
///
/// # Errors
/// It was cancelled.
pub fn view(
    bench: &Bench,
    (file, caption): (String, String),
    (scene, maps): (&Arc<Scene>, &[IlluminationMap]),
    camera: &Camera,
) -> Result<(Picture, f64)> {
    let (width, height, samples_per_side) = if bench.quick { (80, 60, 1) } else { (640, 480, 2) };
    let mut view = View::new(camera.clone(), [width, height]);
    let tracer = Tracer::new(Arc::clone(scene));
    let settings = ReferenceSettings {
        samples_per_side,
        ..ReferenceSettings::default()
    };
    let clock = ProcessTime::now();
    let seen = reference::render(&tracer, maps, &view, &settings, bench.progress, bench.control)?;
    let cpu_s = clock.elapsed().as_secs_f64();
    view.exposure_stops = seen.auto_exposure_stops();
    let picture = Picture {
        file,
        caption,
        size: (width, height),
        rgba: display_rgba8(&seen, view.exposure_stops, view.tone_map),
    };
    Ok((picture, cpu_s))
}

/// Picture of the largest map of a difference: warm where the first bake has more light, cool where it has less.
pub fn difference(file: String, caption: String, found: &Difference) -> Option<Picture> {
    // Both sides of a sheet have maps of the same size; this takes the front.
    let map = found.maps.iter().rev().max_by_key(|map| map.irradiance.len())?;
    let rgba = difference_colours::of_map(map).flat_map(|[r, g, b]| [r, g, b, u8::MAX]);
    Some(Picture {
        file,
        caption,
        size: (map.chart.width as u32, map.chart.height as u32),
        rgba: rgba.collect(),
    })
}
