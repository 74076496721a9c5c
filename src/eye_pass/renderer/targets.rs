//! What the surface pass draws into, remade when the size changes.

use super::pipelines::{DEPTH_FORMAT, HDR_FORMAT};
use crate::error::Result;
use crate::gpu::Gpu;

/// Textures of one picture size.
#[derive(Debug)]
pub(super) struct Targets {
    pub(super) width: u32,
    pub(super) height: u32,
    /// One sample per pixel: what is shown or read back.
    pub(super) resolved: wgpu::Texture,
    pub(super) resolved_view: wgpu::TextureView,
    /// Where there are several samples per pixel.
    multisampled: Option<wgpu::TextureView>,
    depth: wgpu::TextureView,
}

impl Targets {
    /// # Errors
    /// A side of 0 or above the device's limit.
    pub(super) fn new(gpu: &Gpu, width: u32, height: u32, sample_count: u32) -> Result<Self> {
        gpu.check_texture_size("picture", width, height)?;
        let texture = |label, format, sample_count, usage| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width,
                    height,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let resolved = texture(
            "radiance",
            HDR_FORMAT,
            1,
            wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC,
        );
        let none = wgpu::TextureUsages::empty();
        Ok(Self {
            width,
            height,
            resolved_view: view(&resolved),
            resolved,
            multisampled: (sample_count > 1)
                .then(|| view(&texture("radiance samples", HDR_FORMAT, sample_count, none))),
            depth: view(&texture("depth", DEPTH_FORMAT, sample_count, none)),
        })
    }

    /// Starts a pass over surfaces: on a background [scaled radiance], or on what an earlier one left. Only the last
    /// one's samples are resolved; after it neither samples nor depths are kept.
    pub(super) fn begin_pass<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        background: Option<[f64; 3]>,
        is_last: bool,
        timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) -> wgpu::RenderPass<'a> {
        let kept = if is_last {
            wgpu::StoreOp::Discard
        } else {
            wgpu::StoreOp::Store
        };
        let (view, resolve_target, store) = match &self.multisampled {
            Some(samples) => (samples, is_last.then_some(&self.resolved_view), kept),
            None => (&self.resolved_view, None, wgpu::StoreOp::Store),
        };
        let colour = |[r, g, b]: [f64; 3]| wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 });
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("surfaces"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target,
                ops: wgpu::Operations {
                    load: background.map_or(wgpu::LoadOp::Load, colour),
                    store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: background.map_or(wgpu::LoadOp::Load, |_| wgpu::LoadOp::Clear(0.0)),
                    store: kept,
                }),
                stencil_ops: None,
            }),
            timestamp_writes,
            ..Default::default()
        })
    }
}
