//! Base colour images on the device, with their mip chains.

use wgpu::util::DeviceExt;

use crate::gpu::Gpu;
use crate::optics::LinearSrgb;
use crate::scene::Texture;
use crate::scene::texture::Wrap;

/// An image with the sampler that its wrapping asks for.
#[derive(Debug)]
pub(super) struct BaseColour {
    pub(super) view: wgpu::TextureView,
    pub(super) sampler: wgpu::Sampler,
}

impl BaseColour {
    /// Uploads an image. One that is larger than the device's textures starts at the first mip level that fits.
    pub(super) fn new(gpu: &Gpu, texture: &Texture) -> Self {
        let limit = gpu.limits().max_texture_dimension_2d;
        let mut levels = mip_chain(texture);
        let fitting = levels
            .iter()
            .position(|level| level.width.max(level.height) <= limit)
            .unwrap_or(0);
        levels.drain(..fitting);
        let data: Vec<u8> = levels
            .iter()
            .flat_map(|level| level.rgba.as_flattened())
            .copied()
            .collect();
        let device_texture = gpu.device.create_texture_with_data(
            &gpu.queue,
            &wgpu::TextureDescriptor {
                label: Some(&texture.name),
                size: wgpu::Extent3d {
                    width: levels[0].width,
                    height: levels[0].height,
                    depth_or_array_layers: 1,
                },
                mip_level_count: levels.len() as u32,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba8UnormSrgb,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            },
            wgpu::util::TextureDataOrder::LayerMajor,
            &data,
        );
        Self {
            view: device_texture.create_view(&wgpu::TextureViewDescriptor::default()),
            sampler: sampler(gpu, texture.wrap),
        }
    }

    /// One white texel, for materials without an image.
    pub(super) fn white(gpu: &Gpu) -> Self {
        Self::new(
            gpu,
            &Texture {
                name: "white".into(),
                width: 1,
                height: 1,
                rgba: vec![[255; 4]],
                wrap: [Wrap::ClampToEdge; 2],
            },
        )
    }
}

fn sampler(gpu: &Gpu, wrap: [Wrap; 2]) -> wgpu::Sampler {
    let address = |wrap| match wrap {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::MirroredRepeat => wgpu::AddressMode::MirrorRepeat,
        Wrap::ClampToEdge => wgpu::AddressMode::ClampToEdge,
    };
    gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("base colour"),
        address_mode_u: address(wrap[0]),
        address_mode_v: address(wrap[1]),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..Default::default()
    })
}

struct Level {
    width: u32,
    height: u32,
    rgba: Vec<[u8; 4]>,
}

/// The image and its halvings down to one texel.
fn mip_chain(texture: &Texture) -> Vec<Level> {
    let mut levels = vec![Level {
        width: texture.width,
        height: texture.height,
        rgba: texture.rgba.clone(),
    }];
    while let Some(last) = levels.last().filter(|level| level.width.max(level.height) > 1) {
        levels.push(halved(last));
    }
    levels
}

/// Means of 2×2 texels in linear light; an odd last row or column is left out of its neighbour's mean.
fn halved(level: &Level) -> Level {
    let (width, height) = ((level.width / 2).max(1), (level.height / 2).max(1));
    let linear: Vec<f32> = (0..=u8::MAX)
        .map(|code| LinearSrgb::decode_channel(code) as f32)
        .collect();
    let texel = |x: u32, y: u32| {
        let (x, y) = (x.min(level.width - 1), y.min(level.height - 1));
        level.rgba[y as usize * level.width as usize + x as usize]
    };
    let mean = |x: u32, y: u32| {
        let four = [
            texel(2 * x, 2 * y),
            texel(2 * x + 1, 2 * y),
            texel(2 * x, 2 * y + 1),
            texel(2 * x + 1, 2 * y + 1),
        ];
        std::array::from_fn(|channel| {
            let codes = four.map(|texel| texel[channel]);
            if channel == 3 {
                return (codes.iter().map(|code| u32::from(*code)).sum::<u32>() / 4) as u8;
            }
            let light = codes.iter().map(|code| linear[usize::from(*code)]).sum::<f32>() / 4.0;
            (LinearSrgb::encode_channel(f64::from(light)) * 255.0).round() as u8
        })
    };
    let rgba = (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .map(|(x, y)| mean(x, y))
        .collect();
    Level { width, height, rgba }
}
