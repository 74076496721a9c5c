//! Render targets, recreated when the size changes.

use super::pipelines::{DEPTH_FORMAT, HDR_FORMAT};
use crate::error::Result;
use crate::gpu::{Gpu, cleared, texture_of};

/// Render targets of a frame, or of the traced image, which has a resolution of its own.
#[derive(Debug)]
pub(super) struct Targets {
    pub(super) size: [u32; 2],
    /// One sample per pixel: shown or read back.
    pub(super) resolved: wgpu::Texture,
    pub(super) resolved_view: wgpu::TextureView,
    /// `None` with one sample per pixel.
    multisampled: Option<wgpu::TextureView>,
    depth: wgpu::TextureView,
}

const ATTACHMENT: wgpu::TextureUsages = wgpu::TextureUsages::RENDER_ATTACHMENT;

impl Targets {
    /// The targets that there are if they have the size, else new ones.
    ///
    /// # Errors
    /// A side of 0 or above the device's limit.
    pub(super) fn of_size(
        before: Option<Self>,
        gpu: &Gpu,
        label: &str,
        size: [u32; 2],
        sample_count: u32,
    ) -> Result<Self> {
        if let Some(before) = before.filter(|before| before.size == size) {
            return Ok(before);
        }
        let [width, height] = size;
        gpu.check_texture_size(label, width, height)?;
        let texture = |format, sample_count, usage| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                sample_count,
                ..texture_of(label, [width, height, 1], format, ATTACHMENT | usage)
            })
        };
        let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let read = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let samples = |format| view(&texture(format, sample_count, wgpu::TextureUsages::empty()));
        let resolved = texture(HDR_FORMAT, 1, read);
        Ok(Self {
            size,
            resolved_view: view(&resolved),
            resolved,
            multisampled: (sample_count > 1).then(|| samples(HDR_FORMAT)),
            depth: samples(DEPTH_FORMAT),
        })
    }

    /// Begins the pass over all surfaces, on a background [scaled radiance]. Samples are resolved; neither they nor
    /// depth are kept.
    pub(super) fn begin_pass<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        [r, g, b]: [f64; 3],
        timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) -> wgpu::RenderPass<'a> {
        let (view, resolve_target, store) = match &self.multisampled {
            Some(samples) => (samples, Some(&self.resolved_view), wgpu::StoreOp::Discard),
            None => (&self.resolved_view, None, wgpu::StoreOp::Store),
        };
        let target = cleared(view, wgpu::Color { r, g, b, a: 1.0 });
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("surfaces"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                resolve_target,
                ops: wgpu::Operations { store, ..target.ops },
                ..target
            })],
            depth_stencil_attachment: Some(depth(&self.depth, Some(0.0), wgpu::StoreOp::Discard)),
            timestamp_writes,
            ..Default::default()
        })
    }

    /// Begins the depth prepass of chains.
    pub(super) fn begin_depth<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) -> wgpu::RenderPass<'a> {
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("traced depth"),
            depth_stencil_attachment: Some(depth(&self.depth, Some(0.0), wgpu::StoreOp::Store)),
            timestamp_writes,
            ..Default::default()
        })
    }

    /// Begins the pass that traces chains, on transparent black.
    pub(super) fn begin_chains<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) -> wgpu::RenderPass<'a> {
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("chains"),
            color_attachments: &[Some(cleared(&self.resolved_view, wgpu::Color::TRANSPARENT))],
            depth_stencil_attachment: Some(depth(&self.depth, None, wgpu::StoreOp::Discard)),
            timestamp_writes,
            ..Default::default()
        })
    }
}

fn depth(
    view: &wgpu::TextureView,
    clear: Option<f32>,
    store: wgpu::StoreOp,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations {
            load: clear.map_or(wgpu::LoadOp::Load, wgpu::LoadOp::Clear),
            store,
        }),
        stencil_ops: None,
    }
}
