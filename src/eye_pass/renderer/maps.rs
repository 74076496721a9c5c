//! Illumination maps on the device, as half floats with a scale of their own.

use half::f16;
use wgpu::util::DeviceExt;

use crate::error::Result;
use crate::gpu::Gpu;
use crate::illumination::IlluminationMap;

/// Largest map value written: below the end of half floats, 65504, with room to spare.
const LARGEST_VALUE: f32 = 32768.0;

/// A map on the device: E [W/m²] = texel × `irradiance_scale`.
#[derive(Debug)]
pub(super) struct DeviceMap {
    pub(super) view: wgpu::TextureView,
    pub(super) irradiance_scale: f32,
    /// Largest channel of any texel [W/m²].
    pub(super) peak_w_m2: f32,
}

impl DeviceMap {
    /// Uploads the sum of a map's layers.
    ///
    /// # Errors
    /// A map larger than the device's textures.
    pub(super) fn new(gpu: &Gpu, name: &str, map: &IlluminationMap) -> Result<Self> {
        let (width, height) = (map.width() as u32, map.height() as u32);
        gpu.check_texture_size(&format!("map of {name}"), width, height)?;
        Ok(Self::from_texels(gpu, name, width, height, &map.total()))
    }

    /// One black texel, for surfaces without a map.
    pub(super) fn black(gpu: &Gpu) -> Self {
        Self::from_texels(gpu, "black", 1, 1, &[[0.0; 3]])
    }

    fn from_texels(gpu: &Gpu, name: &str, width: u32, height: u32, irradiance: &[[f32; 3]]) -> Self {
        let peak_w_m2 = irradiance
            .iter()
            .flatten()
            .fold(0.0, |peak: f32, channel| peak.max(*channel));
        let irradiance_scale = scale_for_half_floats(peak_w_m2);
        let halves: Vec<[f16; 4]> = irradiance
            .iter()
            .map(|[r, g, b]| {
                [*r, *g, *b, irradiance_scale].map(|value| f16::from_f32(value / irradiance_scale))
            })
            .collect();
        let texture = gpu.device.create_texture_with_data(
            &gpu.queue,
            &wgpu::TextureDescriptor {
                label: Some(name),
                size: wgpu::Extent3d {
                    width,
                    height,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba16Float,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            },
            wgpu::util::TextureDataOrder::LayerMajor,
            bytemuck::cast_slice(&halves),
        );
        Self {
            view: texture.create_view(&wgpu::TextureViewDescriptor::default()),
            irradiance_scale,
            peak_w_m2,
        }
    }
}

/// The power of two by which a peak [any unit] is divided to lie in (16384, 32768]; 1 for nothing. Powers of two
/// change no digit, and half floats keep all of theirs down to 2⁻²⁹ of the peak.
pub(super) fn scale_for_half_floats(peak: f32) -> f32 {
    if peak > 0.0 && peak.is_finite() {
        (peak / LARGEST_VALUE).log2().ceil().exp2()
    } else {
        1.0
    }
}
