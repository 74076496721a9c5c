//! Illumination maps on the device, as half floats with a scale of their own.

use super::tiles::{Texel, TiledImage, Uploaded, kept_scale, scale_for_half_floats, texel};
use crate::gpu::Gpu;
use crate::illumination::IlluminationMap;

/// A map on the device: E [W/m²] = texel × `irradiance_scale`.
#[derive(Debug)]
pub(super) struct DeviceMap {
    image: TiledImage,
    pub(super) view: wgpu::TextureView,
    pub(super) irradiance_scale: f32,
    /// Largest channel of any texel [W/m²].
    pub(super) peak_w_m2: f32,
}

impl DeviceMap {
    /// Uploads the sum of a map's layers; the map has to fit the device's textures.
    pub(super) fn new(gpu: &Gpu, name: &str, map: &IlluminationMap) -> (Self, Uploaded) {
        Self::from_texels(gpu, name, [map.width(), map.height()], &map.total())
    }

    /// One black texel, for surfaces without a map.
    pub(super) fn black(gpu: &Gpu) -> Self {
        Self::from_texels(gpu, "black", [1, 1], &[[0.0; 3]]).0
    }

    /// Whether a map can take this one's place in the same texture.
    pub(super) fn has_size_of(&self, map: &IlluminationMap) -> bool {
        self.image.size() == [map.width(), map.height()]
    }

    /// Replaces the map by one of the same size and uploads the tiles that differ. The scale stays where the new peak
    /// still fits it; else it changes, and with it all tiles that are not black.
    pub(super) fn update(&mut self, gpu: &Gpu, map: &IlluminationMap) -> Uploaded {
        let irradiance = map.total();
        self.peak_w_m2 = peak(&irradiance);
        self.irradiance_scale = kept_scale(self.irradiance_scale, self.peak_w_m2);
        self.image.update(gpu, texels(&irradiance, self.irradiance_scale))
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
    irradiance
        .iter()
        .flatten()
        .fold(0.0, |peak: f32, channel| peak.max(*channel))
}

fn texels(irradiance: &[[f32; 3]], scale: f32) -> Vec<Texel> {
    irradiance.iter().map(|values| texel(*values, scale)).collect()
}
