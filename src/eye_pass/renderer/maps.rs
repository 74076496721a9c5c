//! Illumination maps on the device, as half floats with a scale of their own.

use std::borrow::Cow;

use half::f16;
use half::slice::HalfFloatSliceExt;
use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::{ParallelSlice, ParallelSliceMut};

use super::tiles::{Texel, TiledImage, Uploaded, kept_scale, scale_for_half_floats};
use crate::gpu::Gpu;
use crate::illumination::IlluminationMap;
use crate::optics::LinearSrgb;

/// Texels that one thread works on at a time.
const BLOCK: usize = 4096;

/// A map on the device: E [W/m²] = texel × `irradiance_scale`.
#[derive(Debug)]
pub(super) struct DeviceMap {
    image: TiledImage,
    pub(super) view: wgpu::TextureView,
    pub(super) irradiance_scale: f32,
    /// Largest channel of any texel [W/m²].
    pub(super) peak_w_m2: f32,
}

/// What a map shows: the sum of its layers [W/m²], computed once for all who need it.
#[derive(Clone, Debug)]
pub(super) struct ShownMap<'a> {
    pub(super) map: &'a IlluminationMap,
    pub(super) irradiance: Cow<'a, [[f32; 3]]>,
}

impl<'a> ShownMap<'a> {
    pub(super) fn of(map: &'a IlluminationMap) -> Self {
        let irradiance = match &map.layers[..] {
            [alone] => Cow::Borrowed(&alone.irradiance[..]),
            _ => Cow::Owned(map.total()),
        };
        Self { map, irradiance }
    }

    /// Texels across and down.
    fn size(&self) -> [usize; 2] {
        [self.map.width(), self.map.height()]
    }
}

impl DeviceMap {
    /// Uploads a map, which has to fit the device's textures.
    pub(super) fn new(gpu: &Gpu, name: &str, map: &ShownMap) -> (Self, Uploaded) {
        Self::from_texels(gpu, name, map.size(), &map.irradiance)
    }

    /// One black texel, for surfaces without a map.
    pub(super) fn black(gpu: &Gpu) -> Self {
        Self::from_texels(gpu, "black", [1, 1], &[[0.0; 3]]).0
    }

    /// What it takes on the device [bytes].
    pub(super) fn bytes(&self) -> u64 {
        self.image.bytes()
    }

    /// Texels across and down.
    pub(super) fn size(&self) -> [usize; 2] {
        self.image.size()
    }

    /// Irradiance [W/m²] of a texel, row by row, as the device holds it.
    pub(super) fn irradiance(&self, texel: usize) -> LinearSrgb {
        let [r, g, b, _] = self.image.texels()[texel];
        LinearSrgb::from([r, g, b].map(f64::from)) * f64::from(self.irradiance_scale)
    }

    /// Whether a map can take this one's place in the same texture.
    pub(super) fn has_size_of(&self, map: &ShownMap) -> bool {
        self.image.size() == map.size()
    }

    /// Replaces the map by one of the same size and uploads the tiles that differ. The scale stays where the new peak
    /// still fits it; else it changes, and with it all tiles that are not black.
    pub(super) fn update(&mut self, gpu: &Gpu, map: &ShownMap) -> Uploaded {
        self.peak_w_m2 = peak(&map.irradiance);
        self.irradiance_scale = kept_scale(self.irradiance_scale, self.peak_w_m2);
        self.image
            .update(gpu, texels(&map.irradiance, self.irradiance_scale))
    }

    fn from_texels(gpu: &Gpu, name: &str, size: [usize; 2], irradiance: &[[f32; 3]]) -> (Self, Uploaded) {
        let peak_w_m2 = peak(irradiance);
        let irradiance_scale = scale_for_half_floats(peak_w_m2);
        let (image, uploaded) = TiledImage::new(gpu, name, size, texels(irradiance, irradiance_scale));
        let map = Self {
            view: image.view(wgpu::TextureViewDimension::D2),
            image,
            irradiance_scale,
            peak_w_m2,
        };
        (map, uploaded)
    }
}

fn peak(irradiance: &[[f32; 3]]) -> f32 {
    let of_block = |block: &[[f32; 3]]| {
        block
            .iter()
            .flatten()
            .fold(0.0, |peak: f32, value| peak.max(*value))
    };
    irradiance
        .par_chunks(BLOCK)
        .map(of_block)
        .reduce(|| 0.0, f32::max)
}

/// Half floats of a map, many at once: a window waits for them.
fn texels(irradiance: &[[f32; 3]], scale: f32) -> Vec<Texel> {
    let mut texels = vec![[f16::ZERO; 4]; irradiance.len()];
    let blocks = texels.par_chunks_mut(BLOCK).zip(irradiance.par_chunks(BLOCK));
    blocks.for_each(|(texels, irradiance)| {
        let scaled: Vec<[f32; 4]> = irradiance
            .iter()
            .map(|[r, g, b]| [*r / scale, *g / scale, *b / scale, 1.0])
            .collect();
        texels
            .as_flattened_mut()
            .convert_from_f32_slice(scaled.as_flattened());
    });
    texels
}
