//! Render targets, recreated when the size changes.

use super::pipelines::{DEPTH_FORMAT, HDR_FORMAT};
use crate::error::Result;
use crate::gpu::{Gpu, cleared, texture_of};

/// Render targets of a frame.
#[derive(Debug)]
pub(super) struct Targets {
    pub(super) width: u32,
    pub(super) height: u32,
    /// One sample per pixel: shown or read back.
    pub(super) resolved: wgpu::Texture,
    pub(super) resolved_view: wgpu::TextureView,
    /// `None` with one sample per pixel.
    multisampled: Option<wgpu::TextureView>,
    depth: wgpu::TextureView,
}

/// Render targets of the traced image, in a resolution of its own.
#[derive(Debug)]
pub(super) struct TracedTargets {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) view: wgpu::TextureView,
    depth: wgpu::TextureView,
}

const ATTACHMENT: wgpu::TextureUsages = wgpu::TextureUsages::RENDER_ATTACHMENT;

impl Targets {
    /// # Errors
    /// A side of 0 or above the device's limit.
    pub(super) fn new(gpu: &Gpu, width: u32, height: u32, sample_count: u32) -> Result<Self> {
        gpu.check_texture_size("picture", width, height)?;
        let size = [width, height];
        let read = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let resolved = texture(gpu, "radiance", size, HDR_FORMAT, 1, ATTACHMENT | read);
        let samples = |label, format| texture(gpu, label, size, format, sample_count, ATTACHMENT);
        Ok(Self {
            width,
            height,
            resolved_view: view(&resolved),
            resolved,
            multisampled: (sample_count > 1).then(|| view(&samples("radiance samples", HDR_FORMAT))),
            depth: view(&samples("depth", DEPTH_FORMAT)),
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
}

impl TracedTargets {
    /// # Errors
    /// A side of 0 or above the device's limit.
    pub(super) fn new(gpu: &Gpu, width: u32, height: u32) -> Result<Self> {
        gpu.check_texture_size("traced picture", width, height)?;
        let size = [width, height];
        let read = wgpu::TextureUsages::TEXTURE_BINDING;
        let picture = texture(gpu, "traced picture", size, HDR_FORMAT, 1, ATTACHMENT | read);
        let depth = texture(gpu, "traced depth", size, DEPTH_FORMAT, 1, ATTACHMENT);
        Ok(Self {
            width,
            height,
            view: view(&picture),
            depth: view(&depth),
        })
    }

    /// Begins the depth prepass.
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
            color_attachments: &[Some(cleared(&self.view, wgpu::Color::TRANSPARENT))],
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

fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn texture(
    gpu: &Gpu,
    label: &str,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    sample_count: u32,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        sample_count,
        ..texture_of(label, [width, height, 1], format, usage)
    })
}
