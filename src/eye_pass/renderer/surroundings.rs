//! What specular surfaces are shown instead of their true surroundings: the plane receivers with their light, coarsely,
//! and the background around them. Made when a specular surface first comes into view.

use bytemuck::Zeroable;
use half::f16;
use wgpu::util::DeviceExt;

use super::bindings::bind_group;
use super::receivers::{Image, LitSurface, PlaneReceiver, SIDE, layers_of, mean_radiance};
use super::tiles::{Texel, TiledImage, kept_scale};
use super::uniforms::{MAX_RECEIVERS, Surroundings, rgb};
use crate::gpu::Gpu;
use crate::scene::Scene;

/// The surroundings on the device.
#[derive(Debug)]
pub(super) struct DeviceSurroundings {
    buffer: wgpu::Buffer,
    /// As `buffer` holds it.
    written: Surroundings,
    image: TiledImage,
    sampler: wgpu::Sampler,
    /// Group 2.
    pub(super) bind_group: wgpu::BindGroup,
}

/// Computed on the processor.
struct Wanted {
    uniform: Surroundings,
    size: [usize; 2],
    texels: Vec<Texel>,
}

impl DeviceSurroundings {
    /// Uploads what is lit.
    pub(super) fn new(
        gpu: &Gpu,
        scene: &Scene,
        lit: &[LitSurface<'_>],
        layout: &wgpu::BindGroupLayout,
    ) -> Self {
        let wanted = wanted(scene, lit, 1.0);
        let buffer = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("surroundings"),
            contents: bytemuck::bytes_of(&wanted.uniform),
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        });
        let (image, _) = TiledImage::new(gpu, "surroundings", wanted.size, wanted.texels);
        let sampler = linear_sampler(gpu);
        Self {
            bind_group: bound(gpu, layout, &buffer, &image, &sampler),
            buffer,
            written: wanted.uniform,
            image,
            sampler,
        }
    }

    /// Takes over what is lit now; uploads what differs from before.
    pub(super) fn update(
        &mut self,
        gpu: &Gpu,
        scene: &Scene,
        lit: &[LitSurface<'_>],
        layout: &wgpu::BindGroupLayout,
    ) {
        let wanted = wanted(scene, lit, self.written.radiance_scale);
        if wanted.size == self.image.size() && wanted.texels.len() == self.image.texels().len() {
            self.image.update(gpu, wanted.texels);
        } else {
            (self.image, _) = TiledImage::new(gpu, "surroundings", wanted.size, wanted.texels);
            self.bind_group = bound(gpu, layout, &self.buffer, &self.image, &self.sampler);
        }
        if wanted.uniform != self.written {
            self.written = wanted.uniform;
            gpu.queue
                .write_buffer(&self.buffer, 0, bytemuck::bytes_of(&self.written));
        }
    }

    /// Whether there are plane receivers among them.
    pub(super) fn has_receivers(&self) -> bool {
        self.written.count > 0
    }

    /// What they take on the device [bytes].
    pub(super) fn bytes(&self) -> u64 {
        self.image.bytes() + size_of_val(&self.written) as u64
    }
}

/// The largest plane receivers of the maps, with a scale that may stay as it was.
fn wanted(scene: &Scene, lit: &[LitSurface<'_>], present_scale: f32) -> Wanted {
    let mut planes: Vec<_> = lit
        .iter()
        .filter_map(|lit| Some((PlaneReceiver::of(scene, lit.chart)?, lit)))
        .collect();
    planes.sort_by(|a, b| b.0.area_m2.total_cmp(&a.0.area_m2));
    planes.truncate(MAX_RECEIVERS);

    let images: Vec<Image> = planes.iter().map(|(_, lit)| Image::of(scene, lit)).collect();
    let peak = images.iter().map(Image::peak).fold(0.0, f32::max);
    let scale = kept_scale(present_scale, peak);
    let mut uniform = Surroundings {
        radiance_scale: scale,
        count: planes.len() as u32,
        ..Zeroable::zeroed()
    };
    for (slot, ((plane, _), image)) in uniform.receivers.iter_mut().zip(planes.iter().zip(&images)) {
        *slot = plane.receiver(image.size);
    }
    if planes.is_empty() {
        // Only then is it looked at.
        uniform.mean_radiance = rgb(mean_radiance(scene, lit));
        return Wanted {
            uniform,
            size: [1, 1],
            texels: vec![[f16::ZERO; 4]],
        };
    }
    Wanted {
        uniform,
        size: [SIDE; 2],
        texels: layers_of(&images, scale),
    }
}

fn bound(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    buffer: &wgpu::Buffer,
    image: &TiledImage,
    sampler: &wgpu::Sampler,
) -> wgpu::BindGroup {
    let images = image.view(wgpu::TextureViewDimension::D2Array);
    let resources = [
        buffer.as_entire_binding(),
        wgpu::BindingResource::TextureView(&images),
        wgpu::BindingResource::Sampler(sampler),
    ];
    bind_group(gpu, "surroundings", layout, resources)
}

fn linear_sampler(gpu: &Gpu) -> wgpu::Sampler {
    gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("surroundings"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    })
}
