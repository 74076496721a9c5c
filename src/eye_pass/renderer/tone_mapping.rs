//! The last pass: from exposed radiance to the target's colours, by one pipeline for each tone map in use.

use std::collections::HashMap;

use super::bindings::{bind_group, bind_group_layout, texture};
use super::cover;
use super::shaders::TONE_MAPPING;
use crate::eye_pass::ToneMap;
use crate::gpu::Gpu;

/// The pipelines that were called for so far.
#[derive(Debug)]
pub(super) struct ToneMappingPipelines {
    module: wgpu::ShaderModule,
    target: wgpu::TextureFormat,
    layout: wgpu::BindGroupLayout,
    made: HashMap<ToneMap, wgpu::RenderPipeline>,
}

impl ToneMappingPipelines {
    /// For targets of a format.
    pub(super) fn new(gpu: &Gpu, target: wgpu::TextureFormat) -> Self {
        let radiance = [texture(false, wgpu::TextureViewDimension::D2)];
        Self {
            module: TONE_MAPPING.module(&gpu.device),
            target,
            layout: bind_group_layout(gpu, "tone mapping", &radiance),
            made: HashMap::new(),
        }
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.made.len()
    }

    /// Fills `target` from `radiance`, texel by texel.
    pub(super) fn draw(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        radiance: &wgpu::TextureView,
        tone_map: ToneMap,
        timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) {
        if !self.made.contains_key(&tone_map) {
            let constants = constants(tone_map, !self.target.is_srgb());
            let pipeline = cover::pipeline(
                gpu,
                &self.module,
                &self.layout,
                "to_display",
                &constants,
                self.target,
            );
            self.made.insert(tone_map, pipeline);
        }
        let resources = [wgpu::BindingResource::TextureView(radiance)];
        let bind_group = bind_group(gpu, "tone mapping", &self.layout, resources);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("tone mapping"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            timestamp_writes,
            ..Default::default()
        });
        pass.set_pipeline(&self.made[&tone_map]);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// The values of the shader's overrides. Formats that encode sRGB by themselves take linear light.
pub(super) fn constants(tone_map: ToneMap, encode_srgb: bool) -> [(&'static str, f64); 2] {
    let code = match tone_map {
        ToneMap::None => 0.0,
        ToneMap::Neutral => 1.0,
        ToneMap::AgX => 2.0,
        ToneMap::Aces => 3.0,
    };
    [
        ("TONE_MAP", code),
        ("ENCODE_SRGB", f64::from(u8::from(encode_srgb))),
    ]
}
