//! Render pipelines of surfaces, one per variant, created on first use.

use std::collections::HashMap;

use super::bindings::{Binding, bind_group_layout, pipeline_layout, storage, texture, uniform};
use super::geometry::{CORNER_LAYOUT, MAP_UV_LAYOUT, OBJECT_LAYOUT};
use super::objects::Inspected;
use super::objects::surface_code;
use super::shaders::{
    COMPOSED, INSPECTED, PARTED, PARTED_UNDER_SKY, SURFACE, TRACED, TRACED_UNDER_SKY, UNDER_LIGHTS,
};
use super::sky;
use crate::gpu::Gpu;
use crate::gpu::shader::Program;
use crate::scene::SurfaceKind;

/// Radiance is stored in half floats until tone mapping.
pub(super) const HDR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Reversed, with an infinite far plane: see `passes::clip_from_camera`.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Group 0 of all surfaces: frame, objects, images and their tiles.
const FRAME_BINDINGS: [Binding; 5] = [
    uniform(wgpu::ShaderStages::VERTEX_FRAGMENT),
    storage(),
    storage(),
    texture(false, wgpu::TextureViewDimension::D2Array),
    texture(false, wgpu::TextureViewDimension::D2Array),
];
/// Group 1 of what traces: start, nodes, triangles, corners, map coordinates, indices, lights, wavelengths.
const TRACED_BINDINGS: [Binding; 8] = [
    uniform(wgpu::ShaderStages::FRAGMENT),
    storage(),
    storage(),
    storage(),
    storage(),
    storage(),
    storage(),
    uniform(wgpu::ShaderStages::FRAGMENT),
];
/// Group 1 of what shows what was traced.
const COMPOSED_BINDINGS: [Binding; 1] = [texture(false, wgpu::TextureViewDimension::D2)];

/// What a pipeline writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum RenderTarget {
    /// Emission and diffuse radiance of an opaque surface.
    Own,
    /// The same, with direct light traced by shadow rays.
    OwnUnderLights,
    /// Values of the map, unlit.
    MapValue,
    /// Another property of the surface.
    Inspected(Inspected),
    /// Depth only: the prepass of chains.
    Depth,
    /// Chains that start at a specular surface.
    Traced,
    /// The traced image, composed into the frame.
    Composed,
}

impl RenderTarget {
    /// Whether it is needed only for chains.
    pub(super) fn is_specular(self) -> bool {
        matches!(self, Self::Depth | Self::Traced | Self::Composed)
    }

    /// Whether it traces rays through the scene's hierarchy.
    pub(super) fn goes_through_scene(self) -> bool {
        matches!(self, Self::OwnUnderLights | Self::Traced)
    }

    /// Whether it draws into the traced image, which has one sample per pixel.
    fn is_of_traced_picture(self) -> bool {
        matches!(self, Self::Depth | Self::Traced)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Faces {
    Front,
    Both,
}

/// Everything that a pipeline is specialised by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct PipelineKey {
    pub(super) writes: RenderTarget,
    pub(super) faces: Faces,
    /// `Diffuse` where the pipeline does not depend on it.
    surface: SurfaceKind,
    flags: PipelineFlags,
}

/// Features that a pipeline supports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct PipelineFlags {
    /// Whether the surface has a texture; for chains, whether any mirror or clear surface of the scene has one.
    pub(super) has_texture: bool,
    /// Whether the resolution of the traced image differs from that of the frame.
    pub(super) is_scaled: bool,
    /// Whether direct light is traced.
    pub(super) traces_lights: bool,
    /// Whether the surface has bumps; for chains, whether any surface of the scene has.
    pub(super) has_bumps: bool,
    /// Whether chains that leave the scene end in an environment.
    pub(super) has_sky: bool,
    /// Whether chains split into wavelengths at dispersive surfaces.
    pub(super) is_dispersive: bool,
    /// Whether any specular surface of the scene is rough.
    pub(super) has_lobes: bool,
    /// Whether the surface has an alpha mask; for chains, whether any surface of the scene has.
    pub(super) has_mask: bool,
    /// Whether the scale of false colours is logarithmic.
    pub(super) is_logarithmic: bool,
}

impl PipelineKey {
    /// The key of a draw. Clears what does not affect its pipeline, so that draws share pipelines.
    pub(super) fn new(
        writes: RenderTarget,
        surface: SurfaceKind,
        faces: Faces,
        flags: PipelineFlags,
    ) -> Self {
        // Mirrors have no diffuse part that direct light could add to.
        let is_lit = flags.traces_lights && surface != SurfaceKind::Mirror;
        let writes = match writes {
            RenderTarget::Own if is_lit => RenderTarget::OwnUnderLights,
            other => other,
        };

        // Only surfaces that show themselves depend on their kind; only these and chains look up textures.
        let shows_itself = matches!(writes, RenderTarget::Own | RenderTarget::OwnUnderLights);
        let looks_up = match writes {
            RenderTarget::Own | RenderTarget::OwnUnderLights => surface != SurfaceKind::Mirror,
            RenderTarget::Traced => true,
            RenderTarget::MapValue
            | RenderTarget::Inspected(_)
            | RenderTarget::Depth
            | RenderTarget::Composed => false,
        };
        Self {
            writes,
            // The shader of chains leaves out back faces itself.
            faces: if writes == RenderTarget::Traced {
                Faces::Both
            } else {
                faces
            },
            surface: if shows_itself {
                surface
            } else {
                SurfaceKind::Diffuse
            },
            flags: PipelineFlags {
                has_texture: flags.has_texture && looks_up,
                is_scaled: flags.is_scaled && writes == RenderTarget::Composed,
                traces_lights: flags.traces_lights && writes == RenderTarget::Traced,
                has_bumps: flags.has_bumps && looks_up,
                has_sky: flags.has_sky && writes == RenderTarget::Traced,
                is_dispersive: flags.is_dispersive && writes == RenderTarget::Traced,
                has_lobes: flags.has_lobes && writes == RenderTarget::Traced,
                has_mask: flags.has_mask,
                is_logarithmic: flags.is_logarithmic && matches!(writes, RenderTarget::Inspected(_)),
            },
        }
    }

    /// The fragment entry point, if there is one.
    pub(super) fn entry_point(self) -> Option<&'static str> {
        match self.writes {
            RenderTarget::Own => Some("own"),
            RenderTarget::OwnUnderLights => Some("own_under_lights"),
            RenderTarget::MapValue => Some("map_value"),
            RenderTarget::Inspected(_) => Some("inspected"),
            RenderTarget::Depth => self.flags.has_mask.then_some("masked_depth"),
            RenderTarget::Traced => Some("traced"),
            RenderTarget::Composed => Some("composed"),
        }
    }

    pub(super) fn program(self) -> Program {
        match self.writes {
            RenderTarget::Own | RenderTarget::MapValue | RenderTarget::Depth => SURFACE,
            RenderTarget::OwnUnderLights => UNDER_LIGHTS,
            RenderTarget::Inspected(_) => INSPECTED,
            RenderTarget::Traced => match (self.flags.is_dispersive, self.flags.has_sky) {
                (false, false) => TRACED,
                (false, true) => TRACED_UNDER_SKY,
                (true, false) => PARTED,
                (true, true) => PARTED_UNDER_SKY,
            },
            RenderTarget::Composed => COMPOSED,
        }
    }

    /// Whether it writes depths, and which it passes. Chains are traced once per pixel: where the surface is the
    /// nearest, which was drawn before.
    pub(super) fn depth(self) -> (bool, wgpu::CompareFunction) {
        if self.writes == RenderTarget::Traced {
            (false, wgpu::CompareFunction::Equal)
        } else {
            (true, wgpu::CompareFunction::Greater)
        }
    }

    pub(super) fn cull_mode(self) -> Option<wgpu::Face> {
        match self.faces {
            Faces::Front => Some(wgpu::Face::Back),
            Faces::Both => None,
        }
    }

    /// Samples per pixel, of a picture that has so many.
    pub(super) fn sample_count(self, of_picture: u32) -> u32 {
        if self.writes.is_of_traced_picture() {
            1
        } else {
            of_picture
        }
    }

    /// Values of the shader's overrides.
    pub(super) fn constants(self) -> Vec<(&'static str, f64)> {
        let mask = ("HAS_MASK", flag(self.flags.has_mask));
        match self.writes {
            RenderTarget::Own
            | RenderTarget::OwnUnderLights
            | RenderTarget::MapValue
            | RenderTarget::Depth => vec![
                mask,
                ("SURFACE", f64::from(surface_code(self.surface))),
                ("HAS_TEXTURE", flag(self.flags.has_texture)),
                ("HAS_BUMPS", flag(self.flags.has_bumps)),
            ],
            RenderTarget::Inspected(what) => vec![
                mask,
                ("INSPECTED", f64::from(what.code())),
                ("IS_LOGARITHMIC", flag(self.flags.is_logarithmic)),
            ],
            RenderTarget::Traced => vec![
                mask,
                ("HAS_TINTED_GLASS", flag(self.flags.has_texture)),
                ("TRACES_LIGHTS", flag(self.flags.traces_lights)),
                ("HAS_LOBES", flag(self.flags.has_lobes)),
                ("HAS_BUMPS", flag(self.flags.has_bumps)),
            ],
            RenderTarget::Composed => vec![mask, ("IS_SCALED", flag(self.flags.is_scaled))],
        }
    }
}

fn flag(is_set: bool) -> f64 {
    f64::from(u8::from(is_set))
}

/// What is drawn in the pass of the surfaces besides them, and leaves the depth as it is.
pub(super) struct Beside<'a> {
    pub(super) program: Program,
    pub(super) groups: &'a [&'a wgpu::BindGroupLayout],
    /// Of vertices and fragments.
    pub(super) entry_points: [&'a str; 2],
    pub(super) buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    pub(super) depth_compare: wgpu::CompareFunction,
    /// How it is put over what is there; replaces that without.
    pub(super) blend: Option<wgpu::BlendState>,
}

impl Beside<'_> {
    pub(super) fn pipeline(&self, gpu: &Gpu, sample_count: u32) -> wgpu::RenderPipeline {
        let module = self.program.module(&gpu.device);
        let [vertex, fragment] = self.entry_points;
        gpu.device
            .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(self.program.name),
                layout: Some(&pipeline_layout(gpu, self.groups)),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some(vertex),
                    compilation_options: Default::default(),
                    buffers: self.buffers,
                },
                primitive: Default::default(),
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: DEPTH_FORMAT,
                    depth_write_enabled: Some(false),
                    depth_compare: Some(self.depth_compare),
                    stencil: Default::default(),
                    bias: Default::default(),
                }),
                multisample: wgpu::MultisampleState {
                    count: sample_count,
                    ..Default::default()
                },
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(fragment),
                    compilation_options: Default::default(),
                    targets: &[Some(wgpu::ColorTargetState {
                        blend: self.blend,
                        ..HDR_FORMAT.into()
                    })],
                }),
                multiview_mask: None,
                cache: None,
            })
    }
}

/// The pipelines created so far, with their bind group layouts.
#[derive(Debug)]
pub(super) struct SurfacePipelines {
    modules: HashMap<&'static str, wgpu::ShaderModule>,
    sample_count: u32,
    /// Group 0.
    pub(super) frame_layout: wgpu::BindGroupLayout,
    /// Group 1 of pipelines that trace; created on first use, as many devices do not support it.
    traced_layout: Option<wgpu::BindGroupLayout>,
    /// Group 1 of pipelines that compose the traced image.
    pub(super) composed_layout: wgpu::BindGroupLayout,
    made: HashMap<PipelineKey, wgpu::RenderPipeline>,
}

impl SurfacePipelines {
    pub(super) fn new(gpu: &Gpu, sample_count: u32) -> Self {
        Self {
            modules: HashMap::new(),
            sample_count,
            frame_layout: bind_group_layout(gpu, "frame", &FRAME_BINDINGS),
            traced_layout: None,
            composed_layout: bind_group_layout(gpu, "traced picture", &COMPOSED_BINDINGS),
            made: HashMap::new(),
        }
    }

    /// Creates a pipeline unless it exists.
    pub(super) fn make(&mut self, gpu: &Gpu, key: PipelineKey) {
        if !self.made.contains_key(&key) {
            let program = key.program();
            self.modules
                .entry(program.name)
                .or_insert_with(|| program.module(&gpu.device));
            if key.writes.goes_through_scene() {
                self.make_traced_layout(gpu);
            }
            let pipeline = self.pipeline(gpu, key);
            self.made.insert(key, pipeline);
        }
    }

    /// `None` if it was not created.
    pub(super) fn get(&self, key: PipelineKey) -> Option<&wgpu::RenderPipeline> {
        self.made.get(&key)
    }

    /// Group 1 of pipelines that trace; `None` before the first of them.
    pub(super) fn traced_layout(&self) -> Option<&wgpu::BindGroupLayout> {
        self.traced_layout.as_ref()
    }

    pub(super) fn drop_specular(&mut self) {
        self.made.retain(|key, _| !key.writes.is_specular());
    }

    pub(super) fn count(&self) -> usize {
        self.made.len()
    }

    pub(super) fn specular_count(&self) -> usize {
        self.made.keys().filter(|key| key.writes.is_specular()).count()
    }

    fn make_traced_layout(&mut self, gpu: &Gpu) {
        self.traced_layout
            .get_or_insert_with(|| bind_group_layout(gpu, "chains", &TRACED_BINDINGS));
    }

    fn layout(&self, gpu: &Gpu, key: PipelineKey) -> wgpu::PipelineLayout {
        let second = match key.writes {
            RenderTarget::Own | RenderTarget::MapValue | RenderTarget::Inspected(_) | RenderTarget::Depth => {
                None
            }
            RenderTarget::OwnUnderLights | RenderTarget::Traced => self.traced_layout.as_ref(),
            RenderTarget::Composed => Some(&self.composed_layout),
        };
        let third = key.flags.has_sky.then(|| sky::layout(gpu));
        let groups: Vec<_> = std::iter::once(&self.frame_layout)
            .chain(second)
            .chain(&third)
            .collect();
        pipeline_layout(gpu, &groups)
    }

    fn pipeline(&self, gpu: &Gpu, key: PipelineKey) -> wgpu::RenderPipeline {
        // The depth prepass writes no colour, and has a fragment stage only where a mask cuts holes.
        let writes = key.writes;
        let module = &self.modules[key.program().name];
        let constants = key.constants();
        let target = [Some(wgpu::ColorTargetState::from(HDR_FORMAT))];
        let targets = if writes == RenderTarget::Depth {
            &[][..]
        } else {
            &target
        };
        let fragment = key.entry_point().map(|entry_point| wgpu::FragmentState {
            module,
            entry_point: Some(entry_point),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                ..Default::default()
            },
            targets,
        });

        // All variants share the vertex stage: chains are traced where the depths of two passes are exactly equal.
        let (depth_write, depth_compare) = key.depth();
        gpu.device
            .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(key.entry_point().unwrap_or("depth")),
                layout: Some(&self.layout(gpu, key)),
                vertex: wgpu::VertexState {
                    module,
                    entry_point: Some("place"),
                    compilation_options: Default::default(),
                    buffers: &[Some(CORNER_LAYOUT), Some(MAP_UV_LAYOUT), Some(OBJECT_LAYOUT)],
                },
                primitive: wgpu::PrimitiveState {
                    cull_mode: key.cull_mode(),
                    ..Default::default()
                },
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: DEPTH_FORMAT,
                    depth_write_enabled: Some(depth_write),
                    depth_compare: Some(depth_compare),
                    stencil: Default::default(),
                    bias: Default::default(),
                }),
                multisample: wgpu::MultisampleState {
                    count: key.sample_count(self.sample_count),
                    ..Default::default()
                },
                fragment,
                multiview_mask: None,
                cache: None,
            })
    }
}
