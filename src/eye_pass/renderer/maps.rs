//! Illumination maps on the device: half floats, with one scale per map.

use std::borrow::Cow;
use std::sync::Arc;

use half::f16;
use half::slice::HalfFloatSliceExt;
use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::{ParallelSlice, ParallelSliceMut};

use super::minify::Minification;
use super::paging::{Level, PagedImage, TILE, TilePool, Uploaded, origin};
use super::tiled;
use super::uniforms::MapTile;
use crate::gpu::Gpu;
use crate::illumination::{Chart, IlluminationMap};
use crate::scene::texture::Wrap;

/// Linear red, green and blue; if one of them is not finite, all are 0 and alpha is 1.
pub(super) type Texel = [f16; 4];

/// Maps do not repeat.
const WRAP: [Wrap; 2] = [Wrap::ClampToEdge; 2];
/// Texels per parallel task.
const BLOCK: usize = 4096;
/// Largest stored value, well below the largest half float, 65504.
const LARGEST_VALUE: f32 = 32768.0;
/// Smallest peak for which a scale is kept [stored value]: half floats reach 21 binary orders below it.
const MIN_PEAK: f32 = 128.0;

/// A map on the device: E [W/m²] = texel × `irradiance_scale`.
#[derive(Debug)]
pub(super) struct DeviceMap {
    pub(super) image: PagedImage<Texel>,
    chart: Arc<Chart>,
    minification: Minification,
    pub(super) irradiance_scale: f32,
    /// Largest channel of any texel [W/m²].
    pub(super) peak_w_m2: f32,
}

/// Irradiance shown by a map: the sum of its layers [W/m²], computed only once.
#[derive(Clone, Debug)]
pub(super) struct ShownMap<'a> {
    pub(super) chart: Arc<Chart>,
    pub(super) irradiance: Cow<'a, [[f32; 3]]>,
}

impl<'a> ShownMap<'a> {
    pub(super) fn of(map: &'a IlluminationMap) -> Self {
        let irradiance = match &map.layers[..] {
            [alone] => Cow::Borrowed(&alone.irradiance[..]),
            _ => Cow::Owned(map.total()),
        };
        Self {
            chart: Arc::clone(&map.chart),
            irradiance,
        }
    }
}

impl DeviceMap {
    /// Uploads a map with its mip levels, from level `finest` on.
    pub(super) fn new(gpu: &Gpu, pool: &mut TilePool, map: &ShownMap, finest: usize) -> (Self, Uploaded) {
        let minification = Minification::of(&map.chart);
        let peak_w_m2 = peak(&map.irradiance);
        let irradiance_scale = scale_for_half_floats(peak_w_m2);
        let levels = levels(map, &minification, irradiance_scale);
        let (image, uploaded) = PagedImage::new(gpu, pool, levels, WRAP, finest);
        let map = Self {
            image,
            chart: Arc::clone(&map.chart),
            minification,
            irradiance_scale,
            peak_w_m2,
        };
        (map, uploaded)
    }

    /// Its tiles in their pool.
    pub(super) fn tiles(&self) -> Vec<MapTile> {
        let tile = |(slot, level, tile): (u32, &Level<Texel>, usize)| MapTile {
            corner: origin(slot),
            irradiance_scale: self.irradiance_scale,
            first_texel: level.place(tile).map(|index| (index * TILE) as f32),
            extent: level.extent,
        };
        self.image.held().map(tile).collect()
    }

    /// Whether a map can replace this one in place: both have the same chart.
    pub(super) fn can_become(&self, map: &ShownMap) -> bool {
        let (old, new) = (&self.chart, &map.chart);
        Arc::ptr_eq(old, new)
            || ([old.width, old.height] == [new.width, new.height]
                && old.corner_uvs == new.corner_uvs
                && old.texel_areas_m2 == new.texel_areas_m2
                && old.layout == new.layout)
    }

    /// Replaces the map by another of the same chart and uploads the tiles that differ. The scale is kept if the new
    /// peak fits it; otherwise it changes, and with it all tiles that are not black.
    pub(super) fn update(&mut self, gpu: &Gpu, pool: &mut TilePool, map: &ShownMap) -> Uploaded {
        self.peak_w_m2 = peak(&map.irradiance);
        self.irradiance_scale = kept_scale(self.irradiance_scale, self.peak_w_m2);
        let levels = levels(map, &self.minification, self.irradiance_scale);
        self.image.update(gpu, pool, levels)
    }
}

/// The power of two that brings a peak [any unit] into (16384, 32768] when dividing it; 1 for a peak of 0. Powers of
/// two are lossless, and half floats keep their full precision down to 2⁻²⁹ of the peak.
fn scale_for_half_floats(peak: f32) -> f32 {
    if peak > 0.0 && peak.is_finite() {
        (peak / LARGEST_VALUE).log2().ceil().exp2()
    } else {
        1.0
    }
}

/// The present scale if a peak fits it, so that unchanged texels keep their bits; otherwise the peak's own.
fn kept_scale(present: f32, peak: f32) -> f32 {
    let written = peak / present;
    if (MIN_PEAK..=LARGEST_VALUE).contains(&written) {
        present
    } else {
        scale_for_half_floats(peak)
    }
}

fn peak(irradiance: &[[f32; 3]]) -> f32 {
    let of_block = |block: &[[f32; 3]]| {
        block
            .iter()
            .flatten()
            .filter(|value| value.is_finite())
            .fold(0.0, |peak: f32, value| peak.max(*value))
    };
    irradiance
        .par_chunks(BLOCK)
        .map(of_block)
        .reduce(|| 0.0, f32::max)
}

fn levels(map: &ShownMap, minification: &Minification, scale: f32) -> Vec<Level<Texel>> {
    let irradiance = &map.irradiance[..];
    if let Some(layout) = &map.chart.layout {
        return tiled::levels(&map.chart, layout, irradiance, scale);
    }
    let sizes = minification.sizes();
    let [width, height] = sizes[0].map(|side| side as f32);
    let coarser = minification.coarser(irradiance);
    let all = std::iter::once(irradiance).chain(coarser.iter().map(Vec::as_slice));
    (0..)
        .zip(sizes)
        .zip(all)
        .map(|((level, size), irradiance)| {
            let extent = [width, height].map(|side| side * (-level as f32).exp2());
            Level::of_rows(*size, extent, WRAP, &half_floats(irradiance, scale))
        })
        .collect()
}

/// Converts irradiance to half floats in batches, since an interactive window waits for it.
pub(super) fn half_floats(irradiance: &[[f32; 3]], scale: f32) -> Vec<Texel> {
    let mut texels = vec![[f16::ZERO; 4]; irradiance.len()];
    let blocks = texels.par_chunks_mut(BLOCK).zip(irradiance.par_chunks(BLOCK));
    blocks.for_each(|(texels, irradiance)| {
        let scaled: Vec<[f32; 4]> = irradiance
            .iter()
            .map(|rgb| match rgb {
                [r, g, b] if rgb.iter().all(|value| value.is_finite()) => {
                    [r / scale, g / scale, b / scale, 0.0]
                }
                _ => [0.0, 0.0, 0.0, 1.0],
            })
            .collect();
        texels
            .as_flattened_mut()
            .convert_from_f32_slice(scaled.as_flattened());
    });
    texels
}
