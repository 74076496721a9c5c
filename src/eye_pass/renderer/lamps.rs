//! Lamps with an extent on the device: drawn in front of the surfaces behind them. Only for scenes that have some.

use std::mem::offset_of;

use glam::DVec3;

use super::bindings::{Binding, Storage, bind_group, bind_group_layout, storage};
use super::geometry::attribute;
use super::pipelines::Beside;
use super::shaders::LAMPS;
use super::uniforms::LightRecord;
use crate::eye_pass::highlights::Outline;
use crate::gpu::Gpu;
use crate::scene::Scene;
use crate::scene::emitter::Emitter;

/// Group 1: the lamps' records.
const BINDINGS: [Binding; 1] = [storage()];

/// Per-instance attributes: of the lamps' records.
pub(super) const LAMP_LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: size_of::<LightRecord>() as u64,
    step_mode: wgpu::VertexStepMode::Instance,
    attributes: &[
        attribute(0, offset_of!(LightRecord, place), wgpu::VertexFormat::Float32x3),
        attribute(1, offset_of!(LightRecord, kind), wgpu::VertexFormat::Uint32),
        attribute(2, offset_of!(LightRecord, across), wgpu::VertexFormat::Float32x3),
        attribute(3, offset_of!(LightRecord, radius), wgpu::VertexFormat::Float32),
        attribute(4, offset_of!(LightRecord, down), wgpu::VertexFormat::Float32x3),
        attribute(5, offset_of!(LightRecord, outline), wgpu::VertexFormat::Uint32),
    ],
};

/// Vertices of the two triangles about a lamp.
pub(super) const CORNERS: u32 = 6;

/// Light is added to what is behind.
const ADDED: wgpu::BlendComponent = wgpu::BlendComponent {
    src_factor: wgpu::BlendFactor::One,
    dst_factor: wgpu::BlendFactor::One,
    operation: wgpu::BlendOperation::Add,
};

/// The lamps of a scene that the eye sees directly.
#[derive(Debug)]
pub(super) struct SeenLamps {
    records: Storage,
    count: u32,
    /// Made with the first lamp, as is the layout of group 1.
    pipeline: Option<(wgpu::RenderPipeline, wgpu::BindGroupLayout)>,
}

impl SeenLamps {
    pub(super) fn new(gpu: &Gpu, scene: &Scene) -> Self {
        let mut lamps = Self {
            records: Storage::new(gpu, "seen lamps"),
            count: 0,
            pipeline: None,
        };
        lamps.set_scene(gpu, scene);
        lamps
    }

    /// Takes up the lamps of an edited scene.
    pub(super) fn set_scene(&mut self, gpu: &Gpu, scene: &Scene) {
        let placed = |place: DVec3| place.as_vec3().to_array();
        let mut records = Vec::new();
        for light in &scene.lights {
            let outline = Outline::of(light).filter(|_| light.has_extent());
            if let (Some(outline), Some(emitter)) = (outline, Emitter::middle(light, scene)) {
                records.push(LightRecord::of(&emitter, placed).outlined(Some(outline), 1.0));
            }
        }
        self.count = records.len() as u32;
        self.records.write(gpu, &records);
    }

    /// Makes what drawing takes, if there are lamps to draw.
    pub(super) fn make(&mut self, gpu: &Gpu, frame: &wgpu::BindGroupLayout, sample_count: u32) {
        if self.count > 0 && self.pipeline.is_none() {
            let layout = bind_group_layout(gpu, "seen lamps", &BINDINGS);
            self.pipeline = Some((pipeline(gpu, frame, &layout, sample_count), layout));
        }
    }

    /// Draws the lamps after all surfaces, in a pass whose group 0 is set.
    pub(super) fn draw(&self, gpu: &Gpu, pass: &mut wgpu::RenderPass<'_>) {
        let Some((pipeline, layout)) = self.pipeline.as_ref().filter(|_| self.count > 0) else {
            return;
        };
        let bound = bind_group(gpu, "seen lamps", layout, [self.records.binding()]);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(1, &bound, &[]);
        pass.set_vertex_buffer(0, self.records.buffer().slice(..));
        pass.draw(0..CORNERS, 0..self.count);
    }

    pub(super) fn count(&self) -> u32 {
        self.count
    }

    /// What the records hold.
    pub(super) fn bytes(&self) -> &[u8] {
        self.records.bytes()
    }
}

fn pipeline(
    gpu: &Gpu,
    frame: &wgpu::BindGroupLayout,
    lamps: &wgpu::BindGroupLayout,
    sample_count: u32,
) -> wgpu::RenderPipeline {
    // Surfaces in front hide lamps, which hide nothing. Suns lie at the depth that the pass begins with.
    let drawn = Beside {
        program: LAMPS,
        groups: &[frame, lamps],
        entry_points: ["lamp_corner", "lamp_drawn"],
        buffers: &[Some(LAMP_LAYOUT)],
        depth_compare: wgpu::CompareFunction::GreaterEqual,
        blend: Some(wgpu::BlendState {
            color: ADDED,
            alpha: ADDED,
        }),
    };
    drawn.pipeline(gpu, sample_count)
}
