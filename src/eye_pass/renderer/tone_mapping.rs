//! The last pass: from exposed, white-balanced radiance to the colours of the target, with one pipeline per tone map.

use std::collections::HashMap;

use super::bindings::{Binding, bind_group, bind_group_layout, cover, cover_pipeline, texture, uniform};
use super::shaders::TONE_MAPPING;
use super::uniforms::DisplayWhite;
use crate::eye_pass::ToneMap;
use crate::gpu::Gpu;
use crate::optics::spectrum::xyz::{IDENTITY, Matrix3};

const BINDINGS: [Binding; 2] = [
    texture(false, wgpu::TextureViewDimension::D2),
    uniform(wgpu::ShaderStages::FRAGMENT),
];

/// A frame to be tone-mapped.
pub(super) struct Exposed<'a> {
    pub(super) radiance: &'a wgpu::TextureView,
    /// Exposure beyond that of the frame [stops].
    pub(super) gain_stops: f64,
    pub(super) tone_map: ToneMap,
}

/// The pipelines created so far.
#[derive(Debug)]
pub(super) struct ToneMappingPipelines {
    module: wgpu::ShaderModule,
    target: wgpu::TextureFormat,
    layout: wgpu::BindGroupLayout,
    white_balance: Matrix3,
    made: HashMap<ToneMap, wgpu::RenderPipeline>,
}

impl ToneMappingPipelines {
    pub(super) fn new(gpu: &Gpu, target: wgpu::TextureFormat) -> Self {
        Self {
            module: TONE_MAPPING.module(&gpu.device),
            target,
            layout: bind_group_layout(gpu, "tone mapping", &BINDINGS),
            white_balance: IDENTITY,
            made: HashMap::new(),
        }
    }

    /// Multiplies radiance by a matrix from the next frame on.
    pub(super) fn set_white_balance(&mut self, matrix: &Matrix3) {
        self.white_balance = *matrix;
    }

    pub(super) fn count(&self) -> usize {
        self.made.len()
    }

    /// Tone-maps `exposed` into `target`, texel by texel.
    pub(super) fn draw(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        exposed: &Exposed<'_>,
        timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) {
        let tone_map = exposed.tone_map;

        // Each tone map is a specialisation of one shader, compiled when it is first shown.
        if !self.made.contains_key(&tone_map) {
            let constants = constants(tone_map, !self.target.is_srgb());
            let pipeline = cover_pipeline(
                gpu,
                &self.module,
                &self.layout,
                "to_display",
                &constants,
                self.target,
            );
            self.made.insert(tone_map, pipeline);
        }

        // The radiance is that of the frame or the mean of several, so that its texture is bound anew each time.
        let gain = exposed.gain_stops.exp2();
        let balance = self.white_balance.map(|row| row.map(|share| gain * share));
        let white = gpu.filled_buffer(
            "white balance",
            bytemuck::bytes_of(&DisplayWhite::new(&balance)),
            wgpu::BufferUsages::UNIFORM,
        );
        let resources = [
            wgpu::BindingResource::TextureView(exposed.radiance),
            white.as_entire_binding(),
        ];
        let bind_group = bind_group(gpu, "tone mapping", &self.layout, resources);
        cover(
            encoder,
            target,
            (&self.made[&tone_map], &bind_group),
            timestamp_writes,
        );
    }
}

/// Values of the shader's overrides. sRGB formats take linear values.
pub(super) fn constants(tone_map: ToneMap, encode_srgb: bool) -> [(&'static str, f64); 2] {
    let code = match tone_map {
        ToneMap::None => 0.0,
        ToneMap::Neutral => 1.0,
        ToneMap::AgX => 2.0,
        ToneMap::Aces => 3.0,
        ToneMap::Soft => 4.0,
    };
    [
        ("TONE_MAP", code),
        ("ENCODE_SRGB", f64::from(u8::from(encode_srgb))),
    ]
}
