//! Render pipelines of surfaces and of the last pass.

use wgpu::util::DeviceExt;

use super::bindings::{bind_group, bind_group_layout, filtering_sampler, pipeline_layout, texture, uniform};
use super::geometry::{CORNER_LAYOUT, MAP_UV_LAYOUT};
use super::shaders::{SURFACE, TONE_MAPPING};
use super::uniforms::ToneMapping;
use crate::gpu::Gpu;

/// Radiance is kept in half floats until it is displayed.
pub(super) const HDR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Reversed and infinite, see `camera`.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Which faces are left out.
pub(super) type Cull = Option<wgpu::Face>;

/// A clear surface: what is behind is multiplied, then what it reflects is added. Blending takes one factor for all
/// channels, so that only what is grey does both at once.
#[derive(Debug)]
pub(super) struct ClearPipelines {
    pub(super) transmitted: wgpu::RenderPipeline,
    pub(super) reflected: wgpu::RenderPipeline,
    pub(super) grey: wgpu::RenderPipeline,
}

/// All pipelines that draw surfaces.
#[derive(Debug)]
pub(super) struct SurfacePipelines {
    pub(super) frame_layout: wgpu::BindGroupLayout,
    pub(super) object_layout: wgpu::BindGroupLayout,
    pub(super) opaque_single_sided: wgpu::RenderPipeline,
    pub(super) opaque_double_sided: wgpu::RenderPipeline,
    pub(super) clear_back_faces: ClearPipelines,
    pub(super) clear_front_faces: ClearPipelines,
    pub(super) clear_both_faces: ClearPipelines,
}

impl SurfacePipelines {
    pub(super) fn new(gpu: &Gpu, sample_count: u32) -> Self {
        let module = SURFACE.module(&gpu.device);
        let frame_layout = bind_group_layout(
            gpu,
            "frame",
            &[
                uniform(wgpu::ShaderStages::VERTEX_FRAGMENT),
                uniform(wgpu::ShaderStages::FRAGMENT),
                texture(true, wgpu::TextureViewDimension::D2Array),
                filtering_sampler(),
            ],
        );
        let object_layout = bind_group_layout(
            gpu,
            "object",
            &[
                uniform(wgpu::ShaderStages::FRAGMENT),
                texture(false, wgpu::TextureViewDimension::D2),
                texture(true, wgpu::TextureViewDimension::D2),
                filtering_sampler(),
            ],
        );
        let layout = pipeline_layout(gpu, &[&frame_layout, &object_layout]);
        let pipeline = |entry_point: &str, cull, blend: Option<wgpu::BlendComponent>| {
            surface_pipeline(gpu, &layout, &module, entry_point, cull, blend, sample_count)
        };
        let clear = |cull| ClearPipelines {
            transmitted: pipeline(
                "transmitted",
                cull,
                Some(factors(wgpu::BlendFactor::Zero, wgpu::BlendFactor::Src)),
            ),
            reflected: pipeline(
                "reflected",
                cull,
                Some(factors(wgpu::BlendFactor::One, wgpu::BlendFactor::One)),
            ),
            grey: pipeline(
                "grey",
                cull,
                Some(factors(wgpu::BlendFactor::One, wgpu::BlendFactor::SrcAlpha)),
            ),
        };
        Self {
            opaque_single_sided: pipeline("opaque", Some(wgpu::Face::Back), None),
            opaque_double_sided: pipeline("opaque", None, None),
            clear_back_faces: clear(Some(wgpu::Face::Front)),
            clear_front_faces: clear(Some(wgpu::Face::Back)),
            clear_both_faces: clear(None),
            frame_layout,
            object_layout,
        }
    }
}

fn factors(src_factor: wgpu::BlendFactor, dst_factor: wgpu::BlendFactor) -> wgpu::BlendComponent {
    wgpu::BlendComponent {
        src_factor,
        dst_factor,
        operation: wgpu::BlendOperation::Add,
    }
}

fn surface_pipeline(
    gpu: &Gpu,
    layout: &wgpu::PipelineLayout,
    module: &wgpu::ShaderModule,
    entry_point: &str,
    cull_mode: Cull,
    blend: Option<wgpu::BlendComponent>,
    count: u32,
) -> wgpu::RenderPipeline {
    gpu.device
        .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(entry_point),
            layout: Some(layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some("place"),
                compilation_options: Default::default(),
                buffers: &[Some(CORNER_LAYOUT), Some(MAP_UV_LAYOUT)],
            },
            primitive: wgpu::PrimitiveState {
                cull_mode,
                ..Default::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                // What is clear hides nothing.
                depth_write_enabled: Some(blend.is_none()),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: wgpu::MultisampleState {
                count,
                ..Default::default()
            },
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(entry_point),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format: HDR_FORMAT,
                    blend: blend.map(|color| wgpu::BlendState {
                        color,
                        alpha: wgpu::BlendComponent::REPLACE,
                    }),
                    write_mask: wgpu::ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
}

/// The last pass.
#[derive(Debug)]
pub(super) struct ToneMappingPipeline {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
}

impl ToneMappingPipeline {
    pub(super) fn new(gpu: &Gpu, target: wgpu::TextureFormat) -> Self {
        let module = TONE_MAPPING.module(&gpu.device);
        let layout = bind_group_layout(
            gpu,
            "tone mapping",
            &[
                uniform(wgpu::ShaderStages::FRAGMENT),
                texture(false, wgpu::TextureViewDimension::D2),
            ],
        );
        let pipeline = gpu
            .device
            .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("tone mapping"),
                layout: Some(&pipeline_layout(gpu, &[&layout])),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("cover"),
                    compilation_options: Default::default(),
                    buffers: &[],
                },
                primitive: Default::default(),
                depth_stencil: None,
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some("to_display"),
                    compilation_options: Default::default(),
                    targets: &[Some(target.into())],
                }),
                multiview_mask: None,
                cache: None,
            });
        Self { layout, pipeline }
    }
}

impl ToneMappingPipeline {
    /// Fills `target` from `radiance`, texel by texel.
    pub(super) fn draw(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        radiance: &wgpu::TextureView,
        uniform: ToneMapping,
    ) {
        let uniform = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("tone mapping"),
            contents: bytemuck::bytes_of(&uniform),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let resources = [
            uniform.as_entire_binding(),
            wgpu::BindingResource::TextureView(radiance),
        ];
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
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.draw(0..3, 0..1);
    }
}
