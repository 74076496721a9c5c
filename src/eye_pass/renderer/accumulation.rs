//! Averages pictures of the same view, which antialiases what is seen in mirrors and through glass.

use super::bindings::{Binding, bind_group, bind_group_layout, cover, cover_pipeline, texture, uniform};
use super::shaders::ACCUMULATED;
use super::uniforms::Accumulation;
use crate::gpu::{Gpu, texture_of};

/// Half floats are too coarse for the mean of many frames.
pub(super) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

const BINDINGS: [Binding; 3] = [
    uniform(wgpu::ShaderStages::FRAGMENT),
    texture(false, wgpu::TextureViewDimension::D2),
    texture(false, wgpu::TextureViewDimension::D2),
];

/// A running mean of frames. The two pictures alternate between the current mean and the previous one.
#[derive(Debug)]
pub(super) struct Mean {
    size: [u32; 2],
    pictures: [wgpu::Texture; 2],
    views: [wgpu::TextureView; 2],
    /// Frames in the mean.
    count: u32,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
}

impl Mean {
    /// The mean that there is if it has the size, else an empty one. The size must be within the device's limit.
    pub(super) fn of_size(before: Option<Self>, gpu: &Gpu, size: [u32; 2]) -> Self {
        before
            .filter(|mean| mean.size == size)
            .unwrap_or_else(|| Self::new(gpu, size))
    }

    fn new(gpu: &Gpu, size: [u32; 2]) -> Self {
        let [width, height] = size;
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC;
        let picture = texture_of("mean", [width, height, 1], FORMAT, usage);
        let pictures = [(); 2].map(|()| gpu.device.create_texture(&picture));
        let layout = bind_group_layout(gpu, "mean", &BINDINGS);
        Self {
            size,
            views: [0, 1].map(|index: usize| pictures[index].create_view(&Default::default())),
            pictures,
            count: 0,
            pipeline: cover_pipeline(
                gpu,
                &ACCUMULATED.module(&gpu.device),
                &layout,
                "accumulated",
                &[],
                FORMAT,
            ),
            layout,
        }
    }

    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    pub(super) fn count(&self) -> u32 {
        self.count
    }

    /// Adds a frame of the same size.
    pub(super) fn add(&mut self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, picture: &wgpu::TextureView) {
        let accumulation = Accumulation {
            share: 1.0 / (self.count + 1) as f32,
            ..Default::default()
        };
        let buffer = gpu.filled_buffer(
            "share",
            bytemuck::bytes_of(&accumulation),
            wgpu::BufferUsages::UNIFORM,
        );
        let (before, after) = (self.count as usize % 2, (self.count as usize + 1) % 2);
        let resources = [
            buffer.as_entire_binding(),
            wgpu::BindingResource::TextureView(picture),
            wgpu::BindingResource::TextureView(&self.views[before]),
        ];
        let bind_group = bind_group(gpu, "mean", &self.layout, resources);
        cover(encoder, &self.views[after], (&self.pipeline, &bind_group), None);
        self.count += 1;
    }

    /// The mean, as a texture for readback (four floats per pixel) and as its view.
    pub(super) fn picture(&self) -> (&wgpu::Texture, &wgpu::TextureView) {
        let latest = self.count as usize % 2;
        (&self.pictures[latest], &self.views[latest])
    }
}
