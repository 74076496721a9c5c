//! Render pipelines of surfaces: one for each kind of drawing that was called for, made when it first is.

use std::collections::HashMap;

use super::bindings::{bind_group_layout, filtering_sampler, pipeline_layout, texture, uniform};
use super::geometry::{CORNER_LAYOUT, MAP_UV_LAYOUT};
use super::shaders::SURFACE;
use crate::gpu::Gpu;
use crate::scene::SurfaceKind;

/// Radiance is kept in half floats until it is displayed.
pub(super) const HDR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Reversed and infinite, see `camera`.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// What a pipeline writes; its entry point in `surface.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Writes {
    /// What an opaque surface sends by itself.
    Own,
    /// The same with what it reflects.
    OwnAndReflected,
    /// The map's value.
    MapValue,
    /// The factor of a clear surface on what is behind it.
    Transmitted,
    /// What a clear surface adds.
    Reflected,
    /// Both at once. Blending takes one factor for all channels, so that only what is grey does that.
    Grey,
}

impl Writes {
    pub(super) const ALL: [Self; 6] = [
        Self::Own,
        Self::OwnAndReflected,
        Self::MapValue,
        Self::Transmitted,
        Self::Reflected,
        Self::Grey,
    ];

    pub(super) fn entry_point(self) -> &'static str {
        match self {
            Self::Own => "own",
            Self::OwnAndReflected => "own_and_reflected",
            Self::MapValue => "map_value",
            Self::Transmitted => "transmitted",
            Self::Reflected => "reflected",
            Self::Grey => "grey",
        }
    }

    /// Whether it is part of a chain from the eye over specular surfaces.
    pub(super) fn is_specular(self) -> bool {
        !matches!(self, Self::Own | Self::MapValue)
    }

    /// Whether it sees the surroundings.
    fn reflects(self) -> bool {
        matches!(self, Self::OwnAndReflected | Self::Reflected | Self::Grey)
    }

    /// How it is blended with what is behind; `None` where it hides that.
    fn blend(self) -> Option<wgpu::BlendComponent> {
        let (src_factor, dst_factor) = match self {
            Self::Own | Self::OwnAndReflected | Self::MapValue => return None,
            Self::Transmitted => (wgpu::BlendFactor::Zero, wgpu::BlendFactor::Src),
            Self::Reflected => (wgpu::BlendFactor::One, wgpu::BlendFactor::One),
            Self::Grey => (wgpu::BlendFactor::One, wgpu::BlendFactor::SrcAlpha),
        };
        Some(wgpu::BlendComponent {
            src_factor,
            dst_factor,
            operation: wgpu::BlendOperation::Add,
        })
    }
}

/// Which faces are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Faces {
    Front,
    Back,
    Both,
}

/// All that a pipeline is specialised by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct PipelineKey {
    pub(super) writes: Writes,
    pub(super) faces: Faces,
    surface: SurfaceKind,
    has_texture: bool,
    has_receivers: bool,
}

impl PipelineKey {
    /// The key of a kind of drawing. What does not matter to it is left out, so that fewer pipelines serve.
    pub(super) fn new(
        writes: Writes,
        surface: SurfaceKind,
        faces: Faces,
        has_texture: bool,
        has_receivers: bool,
    ) -> Self {
        let shows_map = writes == Writes::MapValue;
        let shows_emission = writes == Writes::Own && surface == SurfaceKind::Mirror;
        Self {
            writes,
            faces,
            surface: if shows_map { SurfaceKind::Diffuse } else { surface },
            has_texture: has_texture && !shows_map && !shows_emission && writes != Writes::Reflected,
            has_receivers: has_receivers && writes.reflects(),
        }
    }

    /// The values of the shader's overrides.
    pub(super) fn constants(self) -> [(&'static str, f64); 3] {
        [
            ("SURFACE", f64::from(surface_code(self.surface))),
            ("HAS_BASE_COLOUR_TEXTURE", f64::from(u8::from(self.has_texture))),
            ("HAS_RECEIVERS", f64::from(u8::from(self.has_receivers))),
        ]
    }
}

/// The shader's `SURFACE_*`.
fn surface_code(surface: SurfaceKind) -> u32 {
    match surface {
        SurfaceKind::Diffuse => 0,
        SurfaceKind::Mirror => 1,
        SurfaceKind::Dielectric => 2,
        SurfaceKind::ThinWall => 3,
        SurfaceKind::Mixed => 4,
    }
}

/// The pipelines that were called for so far, and how they are bound.
#[derive(Debug)]
pub(super) struct SurfacePipelines {
    module: wgpu::ShaderModule,
    sample_count: u32,
    /// Group 0.
    pub(super) frame_layout: wgpu::BindGroupLayout,
    /// Group 1.
    pub(super) object_layout: wgpu::BindGroupLayout,
    /// Group 2, of those that reflect.
    pub(super) surroundings_layout: wgpu::BindGroupLayout,
    plain: wgpu::PipelineLayout,
    reflecting: wgpu::PipelineLayout,
    made: HashMap<PipelineKey, wgpu::RenderPipeline>,
}

impl SurfacePipelines {
    pub(super) fn new(gpu: &Gpu, sample_count: u32) -> Self {
        let frame = [uniform(wgpu::ShaderStages::VERTEX_FRAGMENT)];
        let frame_layout = bind_group_layout(gpu, "frame", &frame);
        let object = [
            uniform(wgpu::ShaderStages::FRAGMENT),
            texture(false, wgpu::TextureViewDimension::D2),
            texture(true, wgpu::TextureViewDimension::D2),
            filtering_sampler(),
        ];
        let object_layout = bind_group_layout(gpu, "object", &object);
        let surroundings = [
            uniform(wgpu::ShaderStages::FRAGMENT),
            texture(true, wgpu::TextureViewDimension::D2Array),
            filtering_sampler(),
        ];
        let surroundings_layout = bind_group_layout(gpu, "surroundings", &surroundings);
        Self {
            module: SURFACE.module(&gpu.device),
            sample_count,
            plain: pipeline_layout(gpu, &[&frame_layout, &object_layout]),
            reflecting: pipeline_layout(gpu, &[&frame_layout, &object_layout, &surroundings_layout]),
            frame_layout,
            object_layout,
            surroundings_layout,
            made: HashMap::new(),
        }
    }

    /// Makes a pipeline unless it is there.
    pub(super) fn make(&mut self, gpu: &Gpu, key: PipelineKey) {
        if !self.made.contains_key(&key) {
            let pipeline = self.pipeline(gpu, key);
            self.made.insert(key, pipeline);
        }
    }

    /// A pipeline that was made.
    pub(super) fn get(&self, key: PipelineKey) -> Option<&wgpu::RenderPipeline> {
        self.made.get(&key)
    }

    /// Gives up those of specular surfaces.
    pub(super) fn drop_specular(&mut self) {
        self.made.retain(|key, _| !key.writes.is_specular());
    }

    /// Gives up those that were made for surroundings with receivers, or without.
    pub(super) fn drop_reflecting(&mut self, has_receivers: bool) {
        self.made
            .retain(|key, _| !key.writes.reflects() || key.has_receivers != has_receivers);
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.made.len()
    }

    /// How many of them serve specular surfaces.
    pub(super) fn specular_count(&self) -> usize {
        self.made.keys().filter(|key| key.writes.is_specular()).count()
    }

    fn pipeline(&self, gpu: &Gpu, key: PipelineKey) -> wgpu::RenderPipeline {
        let layout = if key.writes.reflects() {
            &self.reflecting
        } else {
            &self.plain
        };
        let blend = key.writes.blend();
        gpu.device
            .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(key.writes.entry_point()),
                layout: Some(layout),
                vertex: wgpu::VertexState {
                    module: &self.module,
                    entry_point: Some("place"),
                    compilation_options: Default::default(),
                    buffers: &[Some(CORNER_LAYOUT), Some(MAP_UV_LAYOUT)],
                },
                primitive: wgpu::PrimitiveState {
                    cull_mode: match key.faces {
                        Faces::Front => Some(wgpu::Face::Back),
                        Faces::Back => Some(wgpu::Face::Front),
                        Faces::Both => None,
                    },
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
                    count: self.sample_count,
                    ..Default::default()
                },
                fragment: Some(wgpu::FragmentState {
                    module: &self.module,
                    entry_point: Some(key.writes.entry_point()),
                    compilation_options: wgpu::PipelineCompilationOptions {
                        constants: &key.constants(),
                        ..Default::default()
                    },
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
}
