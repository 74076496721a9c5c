//! Averages pictures of the same view, which antialiases what is seen in mirrors and through glass.

use super::bindings::{Binding, bind_group, bind_group_layout, cover_pipeline, texture, uniform};
use super::shaders::ACCUMULATED;
use super::uniforms::Accumulation;
use crate::gpu::Gpu;

/// Half floats are too coarse for the mean of many frames.
pub(super) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

pub(super) const BINDINGS: [Binding; 3] = [
    uniform(wgpu::ShaderStages::FRAGMENT),
    texture(false, wgpu::TextureViewDimension::D2),
    texture(false, wgpu::TextureViewDimension::D2),
];

/// A running mean of frames. The two pictures alternate between the current mean and the previous one.
#[derive(Debug)]
pub(super) struct Mean {
    width: u32,
    height: u32,
    pictures: [wgpu::Texture; 2],
    views: [wgpu::TextureView; 2],
    /// Frames in the mean.
    count: u32,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
}

impl Mean {
    /// The size must be within the device's limit.
    pub(super) fn new(gpu: &Gpu, width: u32, height: u32) -> Self {
        let picture = || {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("mean"),
                size: wgpu::Extent3d {
                    width,
                    height,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: FORMAT,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::TEXTURE_BINDING
                    | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        };
        let pictures = [picture(), picture()];
        let layout = bind_group_layout(gpu, "mean", &BINDINGS);
        Self {
            width,
            height,
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

    pub(super) fn has_size(&self, width: u32, height: u32) -> bool {
        (self.width, self.height) == (width, height)
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
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("mean"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.views[after],
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations::default(),
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.draw(0..3, 0..1);
        self.count += 1;
    }

    /// The mean, as a texture for readback (four floats per pixel) and as its view.
    pub(super) fn picture(&self) -> (&wgpu::Texture, &wgpu::TextureView) {
        let latest = self.count as usize % 2;
        (&self.pictures[latest], &self.views[latest])
    }
}
