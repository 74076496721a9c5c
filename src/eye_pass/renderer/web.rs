//! A scene for browsers: what this renderer would hand to a device, and how, for a host that draws as it does by WebGPU.
//! Descriptors have the names and words of that interface.

use bytemuck::Pod;
use serde_json::{Map, Value, json};
use strum::VariantArray;

use super::accumulation;
use super::bindings::Binding;
use super::draws::{Draw, DrawList, DrawState};
use super::geometry::{CORNER_LAYOUT, MAP_UV_LAYOUT, OBJECT_LAYOUT};
use super::maps::DeviceMap;
use super::pipelines::{
    COMPOSED_BINDINGS, DEPTH_FORMAT, FRAME_BINDINGS, HDR_FORMAT, PipelineFlags, PipelineKey, RenderTarget,
    TRACED_BINDINGS,
};
use super::shaders::{ACCUMULATED, SKY, SUMMED, TONE_MAPPING};
use super::uniforms::{
    ChainStart, DisplayWhite, Frame, MapTile, Node, ObjectRecord, SeenWavelengths, Triangle,
};
use super::{EyeQuality, Inspected, MapStyle, Renderer, sky, tone_mapping};
use crate::error::{Error, Result};
use crate::eye_pass::reference::ChainLimits;
use crate::eye_pass::{ToneMap, View, wavelengths};
use crate::gpu::layout::StructLayout;
use crate::gpu::shader::Program;
use crate::gpu::{Gpu, readback};
use crate::illumination::IlluminationMap;
use crate::illumination::false_colours::ColourScale;
use crate::optics::spectrum::xyz::IDENTITY;
use crate::scene::{Camera, Scene};

/// Of the three corners of a triangle [bytes].
const INDEX_BYTES: usize = 3 * size_of::<u32>();
/// Samples per pixel, as in a window.
const SAMPLES: u32 = 4;
/// What pictures in a browser are taken to have [pixels].
const PICTURE_HEIGHT: f64 = 1080.0;
/// Most that the maps of all layers together take on the device as half floats [bytes]: browsers on phones give a page
/// little, and files are sent.
const MAP_BUDGET_BYTES: u64 = 64 << 20;
/// Pictures of a view that differ in their wavelengths.
const PICTURES: u32 = 17;

/// What pictures of a scene are made of, whatever the view.
#[derive(Debug)]
pub struct WebScene {
    /// Shader modules, layouts, pipelines, draws and structs.
    pub description: Value,
    /// What buffers and textures hold, by their names in the description. Triangles lack what their indices tell, and nodes
    /// what their triangles tell.
    pub contents: Vec<(&'static str, Content)>,
    /// Where each map's tiles lie, as `summed.wgsl` reads them.
    pub map_tiles: Vec<Content>,
    /// Why mirrors and glass are drawn without reflections and refractions, if they are.
    pub refusal: Option<Error>,
}

/// What a buffer or a texture holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Content {
    pub bytes: Vec<u8>,
    /// Length of each of its records [bytes], if it has any that resemble each other.
    pub record_bytes: Option<usize>,
}

impl Content {
    pub(super) fn records<T: Pod>(records: &[T]) -> Self {
        Self {
            bytes: bytemuck::cast_slice(records).to_vec(),
            record_bytes: Some(size_of::<T>()),
        }
    }

    fn plain<T: Pod>(items: &[T]) -> Self {
        Self {
            record_bytes: None,
            ..Self::records(items)
        }
    }
}

impl WebScene {
    /// Gathers a scene with maps of some sizes. Of their light, only the largest value counts: the host fills the tiles,
    /// and a texture of the environment.
    ///
    /// # Errors
    /// A scene beyond what every browser's device holds; maps that do not belong to the scene.
    pub fn new(scene: &Scene, maps: &[IlluminationMap]) -> Result<Self> {
        let gpu = Gpu::idle()?;
        let mut renderer = Renderer::new(&gpu, scene, wgpu::TextureFormat::Rgba8Unorm, SAMPLES)?;
        // The host traces at any resolution.
        renderer.set_quality(EyeQuality {
            traced_scale: 0.5,
            ..EyeQuality::STILL
        });
        // Coarse first: tiles then fill the pool without gaps.
        renderer.set_map_budget(0);
        renderer.set_maps(&gpu, scene, maps)?;
        renderer.set_map_budget(MAP_BUDGET_BYTES);
        renderer.fit_maps(&gpu);
        if renderer.geometry.pages.len() > 1 {
            return Err(Error::failure(
                &scene.source,
                format!(
                    "has {} triangles, more than every browser holds in one buffer",
                    scene.triangle_count()
                ),
                "export a scene of fewer triangles",
            ));
        }
        let mut looks = renderer.objects.list.iter();
        if looks.any(|look| renderer.draw_state().is_specular(look)) {
            renderer.make_chain_scene(&gpu);
        }
        let mut made = renderer.web_scene(&gpu, maps)?;
        made.refusal = renderer.refusal.take();
        gpu.take_error().map_or(Ok(made), Err)
    }
}

impl Renderer {
    /// Drops the finest levels of what is far from the scene's first camera, where maps are beyond the budget.
    fn fit_maps(&mut self, gpu: &Gpu) {
        let camera = self
            .scene
            .cameras
            .first()
            .cloned()
            .unwrap_or_else(|| self.outside());
        let all: Vec<usize> = (0..self.objects.list.len()).collect();
        let pixel_rad = camera.vertical_fov_rad / PICTURE_HEIGHT;
        self.objects.keep_budget(gpu, camera.position, pixel_rad, &all);
    }

    /// A camera that is in no body.
    fn outside(&self) -> Camera {
        Camera::framing("outside", self.scene.bounds().unwrap_or_default(), 1.0)
    }

    fn web_scene(&self, gpu: &Gpu, maps: &[IlluminationMap]) -> Result<WebScene> {
        let images = &self.objects.images;
        let tiles = maps.iter().map(|map| {
            let shown = images.map(map.chart.receiver);
            Content::records(&shown.map_or(Vec::new(), DeviceMap::tiles))
        });
        let map_tiles = tiles.collect();
        let [map_pool, texture_pool] = images.pool_sizes();
        let textures = json!({
            "map_tiles": {"size": map_pool, "format": word(HDR_FORMAT)},
            "texture_tiles": {"size": texture_pool, "format": "rgba8unorm-srgb"},
        });
        let mut contents = self.web_buffers(gpu)?;
        contents.push(("texture_tiles", Content::plain(&images.texture_tiles())));
        Ok(WebScene {
            description: self.web_description(textures),
            contents,
            map_tiles,
            refusal: None,
        })
    }

    fn web_buffers(&self, gpu: &Gpu) -> Result<Vec<(&'static str, Content)>> {
        let mut buffers = vec![
            ("objects", Content::plain(self.objects.records.bytes())),
            ("image_table", Content::plain(self.objects.images.table.bytes())),
        ];
        if let Some(page) = self.geometry.pages.first() {
            let [corner, uv] = [CORNER_LAYOUT, MAP_UV_LAYOUT].map(|layout| layout.array_stride as usize);
            for (name, buffer, record) in [
                ("corners", &page.corners, corner),
                ("map_uvs", &page.map_uvs, uv),
                ("indices", &page.indices, INDEX_BYTES),
            ] {
                let bytes = readback::read_buffer(gpu, buffer)?;
                let record_bytes = Some(record);
                buffers.push((name, Content { bytes, record_bytes }));
            }
        }
        if let Some(scene) = &self.chain_scene {
            buffers.extend(scene.contents_without_corners());
            let view = View::new(self.outside(), [1, 1]);
            let limits = ChainLimits {
                branching_depth: EyeQuality::STILL.branching_depth,
                ..ChainLimits::default()
            };
            let start = scene.start(&view, &limits, false);
            buffers.push(("start", Content::plain(&[start])));
        }
        let seen = |picture| match self.draw_state().flags.is_dispersive {
            true => SeenWavelengths::of(&wavelengths::of_picture(picture), &self.objects.glasses),
            false => SeenWavelengths::default(),
        };
        let seen: Vec<SeenWavelengths> = (0..PICTURES).map(seen).collect();
        buffers.push(("wavelengths", Content::plain(&seen)));
        let white = DisplayWhite::new(&IDENTITY);
        buffers.push(("white", Content::plain(&[white])));
        Ok(buffers)
    }

    /// Draws of all objects: with chains, without them, and in false colours of the light.
    fn web_draws(&self) -> Vec<(&'static str, Vec<Draw>)> {
        let all: Vec<usize> = (0..self.objects.list.len()).collect();
        let lit = self.draw_state();
        let list = DrawList::new(&self.objects, &all, lit);
        let plain = DrawState {
            has_chains: false,
            ..lit
        };
        let scale = ColourScale {
            is_logarithmic: true,
            ..ColourScale::default()
        };
        let what = Inspected::Irradiance;
        let colours = DrawState {
            style: MapStyle::Inspected { what, scale },
            flags: PipelineFlags {
                is_logarithmic: true,
                ..lit.flags
            },
            ..lit
        };
        let surfaces = |state| DrawList::new(&self.objects, &all, state).surfaces;
        let is_composed = |draw: &Draw| draw.key.writes == RenderTarget::Composed;
        let (composed, own) = list.surfaces.into_iter().partition(is_composed);
        vec![
            ("depths", list.depths),
            ("traced", list.traced),
            ("composed", composed),
            ("own", own),
            ("plain", surfaces(plain)),
            ("colours", surfaces(colours)),
        ]
    }

    fn web_description(&self, textures: Value) -> Value {
        let mut keys: Vec<PipelineKey> = Vec::new();
        let mut draws = Map::new();
        for (name, of) in self.web_draws() {
            let runs = self.runs(&of).into_iter().map(|(key, segment, objects)| {
                let place = keys.iter().position(|known| *known == key).unwrap_or(keys.len());
                if place == keys.len() {
                    keys.push(key);
                }
                let indices = &segment.indices;
                json!([place, indices.len(), objects.len(), indices.start, objects.start])
            });
            draws.insert(name.into(), runs.collect());
        }
        let mut programs = Map::new();
        let fixed = [ACCUMULATED, SUMMED, TONE_MAPPING, SKY];
        for program in keys.iter().map(|key| key.program()).chain(fixed) {
            programs.insert(program.name.into(), program.wgsl().into());
        }
        let local = self.chain_scene.as_ref().map(|scene| {
            let frame = scene.frame();
            json!({
                "centre_m": frame.centre.to_array(),
                "per_m": frame.scale,
                "first_mesh_node": scene.first_mesh_node(),
            })
        });
        let buffers = [CORNER_LAYOUT, MAP_UV_LAYOUT, OBJECT_LAYOUT].map(|layout| vertices(&layout));
        let surfaces: Vec<Value> = keys.iter().map(|key| surface(*key)).collect();
        let tone_maps: Map<String, Value> = ToneMap::VARIANTS
            .iter()
            .map(|&tone_map| {
                let values = tone_mapping::constants(tone_map, true);
                (<&str>::from(tone_map).into(), constants(&values))
            })
            .collect();
        let background = self
            .scene
            .sky()
            .map_or([0.0; 3], |(_, strength)| strength.to_array());
        json!({
            "programs": programs,
            "layouts": {
                "frame": layout(&FRAME_BINDINGS),
                "traced": layout(&TRACED_BINDINGS),
                "composed": layout(&COMPOSED_BINDINGS),
                "sky": layout(&sky::BINDINGS),
                "nothing": layout(&[]),
                "mean": layout(&accumulation::BINDINGS),
                "shown": layout(&tone_mapping::BINDINGS),
            },
            "vertices": buffers,
            "surfaces": surfaces,
            "sky": sky_pipeline(),
            "mean": cover(ACCUMULATED, "mean", "accumulated", accumulation::FORMAT),
            "shown": cover(TONE_MAPPING, "shown", "to_display", HDR_FORMAT),
            "tone_maps": tone_maps,
            "formats": {"radiance": word(HDR_FORMAT), "depth": word(DEPTH_FORMAT), "mean": word(accumulation::FORMAT)},
            "samples": SAMPLES,
            "pictures": PICTURES,
            "draws": draws,
            "textures": textures,
            "Frame": offsets(&Frame::layout()),
            "ChainStart": offsets(&ChainStart::layout()),
            "ObjectRecord": offsets(&ObjectRecord::layout()),
            "MapTile": offsets(&MapTile::layout()),
            "Node": offsets(&Node::layout()),
            "Triangle": offsets(&Triangle::layout()),
            "local": local,
            "background": background,
        })
    }
}

/// A word of WebGPU, which are those of wgpu in lower case.
fn word(value: impl std::fmt::Debug) -> String {
    format!("{value:?}").to_lowercase()
}

fn offsets(layout: &StructLayout) -> Value {
    let fields = layout.fields.iter();
    let fields: Map<String, Value> = fields
        .map(|field| (field.name.into(), field.offset.into()))
        .collect();
    json!({"size": layout.size, "fields": fields})
}

fn layout(bindings: &[Binding]) -> Value {
    let entries = bindings.iter().enumerate().map(|(binding, (stages, kind))| {
        let (name, what) = match kind {
            wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                ..
            } => ("buffer", json!({"type": "uniform"})),
            wgpu::BindingType::Buffer { .. } => ("buffer", json!({"type": "read-only-storage"})),
            wgpu::BindingType::Texture {
                view_dimension: wgpu::TextureViewDimension::D2Array,
                ..
            } => (
                "texture",
                json!({"sampleType": "unfilterable-float", "viewDimension": "2d-array"}),
            ),
            _ => ("texture", json!({"sampleType": "unfilterable-float"})),
        };
        json!({"binding": binding, "visibility": stages.bits(), name: what})
    });
    entries.collect()
}

fn vertices(layout: &wgpu::VertexBufferLayout<'_>) -> Value {
    let attribute = |attribute: &wgpu::VertexAttribute| {
        json!({
            "format": word(attribute.format),
            "offset": attribute.offset,
            "shaderLocation": attribute.shader_location,
        })
    };
    json!({
        "arrayStride": layout.array_stride,
        "stepMode": word(layout.step_mode),
        "attributes": layout.attributes.iter().map(attribute).collect::<Vec<_>>(),
    })
}

fn constants(values: &[(&str, f64)]) -> Value {
    values
        .iter()
        .map(|(name, value)| ((*name).to_string(), Value::from(*value)))
        .collect()
}

/// A pipeline as WebGPU describes it, but for its layout and module, which have names.
fn surface(key: PipelineKey) -> Value {
    let (writes_depth, compare) = key.depth();
    let groups: &[&str] = match (key.writes, key.has_sky()) {
        (RenderTarget::Traced, true) => &["frame", "traced", "sky"],
        (RenderTarget::Traced, false) => &["frame", "traced"],
        (RenderTarget::Composed, _) => &["frame", "composed"],
        _ => &["frame"],
    };
    let targets = match key.writes {
        RenderTarget::Depth => json!([]),
        _ => json!([{"format": word(HDR_FORMAT)}]),
    };
    let fragment = key.entry_point().map(|entry_point| {
        json!({"entryPoint": entry_point, "constants": constants(&key.constants()), "targets": targets})
    });
    json!({
        "program": key.program().name,
        "groups": groups,
        "vertex": "place",
        "fragment": fragment,
        "primitive": {"cullMode": key.cull_mode().map_or("none".into(), word)},
        "depthStencil": depth(writes_depth, compare),
        "multisample": {"count": key.sample_count(SAMPLES)},
    })
}

fn depth(writes: bool, compare: wgpu::CompareFunction) -> Value {
    json!({"format": word(DEPTH_FORMAT), "depthWriteEnabled": writes, "depthCompare": word(compare)})
}

fn sky_pipeline() -> Value {
    json!({
        "program": SKY.name,
        "groups": ["frame", "nothing", "sky"],
        "vertex": "behind",
        "fragment": {"entryPoint": "sky_drawn", "targets": [{"format": word(HDR_FORMAT)}]},
        "depthStencil": depth(false, wgpu::CompareFunction::Always),
        "multisample": {"count": SAMPLES},
    })
}

fn cover(program: Program, group: &str, entry_point: &str, target: wgpu::TextureFormat) -> Value {
    json!({
        "program": program.name,
        "groups": [group],
        "vertex": "cover",
        "fragment": {"entryPoint": entry_point, "targets": [{"format": word(target)}]},
    })
}
