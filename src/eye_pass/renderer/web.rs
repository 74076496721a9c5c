//! A scene for browsers: what this renderer would hand to a device, for a host that draws as it does by WebGPU, whose
//! words these are.

use std::collections::BTreeMap;

use bytemuck::Pod;
use serde_json::{Map, Value, json};
use strum::VariantArray;

use super::accumulation;
use super::draws::{Draw, DrawList};
use super::geometry::{CORNER_LAYOUT, MAP_UV_LAYOUT, OBJECT_LAYOUT};
use super::lamps::{CORNERS, LAMP_LAYOUT};
use super::maps::DeviceMap;
use super::pipelines::{DEPTH_FORMAT, HDR_FORMAT, PipelineKey, RenderTarget};
use super::shaders::{ACCUMULATED, LAMPS, SKY, SUMMED, TONE_MAPPING};
use super::uniforms::{
    ChainStart, DisplayWhite, Frame, MapTile, Node, ObjectRecord, SeenWavelengths, Triangle,
};
use super::{EyeQuality, Inspected, MapStyle, Renderer, tone_mapping};
use crate::error::{Error, Result};
use crate::eye_pass::reference::ChainLimits;
use crate::eye_pass::{ToneMap, View, wavelengths};
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
/// Pictures of a view that differ in their wavelengths: the first, which may remain the only one, and as many as the
/// page averages at rest.
const PICTURES: u32 = 17;

/// What pictures of a scene are made of, whatever the view.
#[derive(Debug)]
pub struct WebScene {
    /// Shader modules, pipelines, draws and structs.
    pub description: Value,
    /// What buffers and textures hold, by name, and where the tiles of each map lie, as `summed.wgsl` reads them.
    /// Triangles lack what their indices tell, and nodes what their triangles tell.
    pub contents: BTreeMap<String, Content>,
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
    /// Gathers a scene with maps of some sizes. Of their light, only the largest value counts: the host fills the
    /// tiles, and a texture of the environment.
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

        // What is far from the first camera, or from one that frames a scene without cameras, loses its finest levels
        // where maps are beyond the budget.
        let outside = || Camera::framing("outside", scene.inner_bounds().unwrap_or_default(), 1.0);
        let camera = scene.cameras.first().cloned().unwrap_or_else(outside);
        let all: Vec<usize> = (0..renderer.objects.list.len()).collect();
        let pixel_rad = camera.vertical_fov_rad / PICTURE_HEIGHT;
        renderer
            .objects
            .keep_budget(&gpu, camera.position, pixel_rad, &all);

        // The host draws and traces from one buffer of vertices, whose size is limited in every browser.
        if renderer.geometry.pages.len() > 1 {
            let triangles = scene.triangle_count();
            return Err(Error::failure(
                &scene.source,
                format!("has {triangles} triangles, more than every browser holds in one buffer"),
                "export a scene of fewer triangles",
            ));
        }
        if renderer.draw_state().has_specular(&renderer.objects) {
            renderer.make_chain_scene(&gpu);
        }

        // The host fills the tiles of each map by a list of where they lie.
        let mut contents = renderer.web_contents(&gpu, camera)?;
        for receiver in maps.iter().map(|map| map.chart.receiver) {
            let tiles = renderer.objects.images.map(receiver).map(DeviceMap::tiles);
            let name = format!("tiles{}", receiver.index());
            contents.insert(name, Content::records(&tiles.unwrap_or_default()));
        }

        let made = Self {
            description: renderer.web_description(&all),
            contents,
            refusal: renderer.refusal.take(),
        };
        gpu.take_error().map_or(Ok(made), Err)
    }
}

impl Renderer {
    /// `camera`: some view, which the host replaces.
    fn web_contents(&self, gpu: &Gpu, camera: Camera) -> Result<BTreeMap<String, Content>> {
        // Each picture of a view traces chains at other wavelengths: the host gets one set for each.
        let is_dispersive = self.draw_state().flags.is_dispersive;
        let seen = |picture| match is_dispersive {
            true => SeenWavelengths::of(&wavelengths::of_picture(picture), &self.objects.glasses),
            false => SeenWavelengths::default(),
        };
        let mut contents = vec![
            ("objects", Content::plain(self.objects.records.bytes())),
            ("image_table", Content::plain(self.objects.images.table.bytes())),
            (
                "texture_tiles",
                Content::plain(&self.objects.images.texture_tiles()),
            ),
            (
                "wavelengths",
                Content::plain(&(0..PICTURES).map(seen).collect::<Vec<_>>()),
            ),
            ("white", Content::plain(&[DisplayWhite::new(&IDENTITY)])),
            ("seen_lamps", Content::plain(self.lamps.bytes())),
        ];

        // Vertices are read back from the idle device, as the renderer keeps no copy of them.
        if let Some(page) = self.geometry.pages.first() {
            let [corner, uv] = [CORNER_LAYOUT, MAP_UV_LAYOUT].map(|layout| layout.array_stride as usize);
            for (name, buffer, record) in [
                ("corners", &page.corners, corner),
                ("map_uvs", &page.map_uvs, uv),
                ("indices", &page.indices, INDEX_BYTES),
            ] {
                let bytes = readback::read_buffer(gpu, buffer)?;
                let record_bytes = Some(record);
                contents.push((name, Content { bytes, record_bytes }));
            }
        }

        // A scene without specular surfaces has no chains.
        if let Some(scene) = &self.chain_scene {
            contents.extend(scene.contents_without_corners());
            let start = scene.start(&View::new(camera, [1, 1]), &ChainLimits::default());
            contents.push(("start", Content::plain(&[start])));
        }
        let named = contents.into_iter();
        Ok(named.map(|(name, content)| (name.to_owned(), content)).collect())
    }

    /// Draws of all objects: with chains, without them, and in false colours of the light.
    fn web_draws(&self, all: &[usize]) -> [(&'static str, Vec<Draw>); 5] {
        let list = |state| DrawList::new(&self.objects, all, state);
        let lit = self.draw_state();
        let (mut plain, mut colours) = (lit, lit);
        plain.has_chains = false;
        colours.flags.is_logarithmic = true;
        colours.style = MapStyle::Inspected {
            what: Inspected::Irradiance,
            scale: ColourScale::default(),
        };
        let seen = list(lit);
        [
            ("depths", seen.depths),
            ("traced", seen.traced),
            ("surfaces", seen.surfaces),
            ("plain", list(plain).surfaces),
            ("colours", list(colours).surfaces),
        ]
    }

    fn web_description(&self, all: &[usize]) -> Value {
        // Full-screen passes have no draws that would name their programs.
        let (mut programs, mut pipelines, mut draws) = (Map::new(), Map::new(), Map::new());
        for program in [ACCUMULATED, SUMMED, TONE_MAPPING, SKY, LAMPS] {
            programs.insert(program.name.into(), program.wgsl().into());
        }

        // Each program and each pipeline is described once, however many draws use it.
        for (list, of) in self.web_draws(all) {
            let runs = self.runs(&of).into_iter().map(|(key, segment, objects)| {
                let (program, name, indices) = (key.program(), format!("{key:?}"), &segment.indices);
                programs
                    .entry(program.name)
                    .or_insert_with(|| program.wgsl().into());
                pipelines.insert(name.clone(), pipeline(key));
                json!([name, indices.len(), objects.len(), indices.start, objects.start])
            });
            draws.insert(list.into(), runs.collect());
        }

        // A canvas takes encoded values, so that every tone map encodes as sRGB.
        let tone_maps = ToneMap::VARIANTS.iter().map(|&tone_map| {
            let values = constants(&tone_mapping::constants(tone_map, true));
            (<&str>::from(tone_map).to_owned(), values)
        });

        // Corners of triangles and boxes of nodes are left out; the host restores them in local coordinates.
        let local = self.chain_scene.as_ref().map(|scene| {
            let (frame, first) = (scene.frame(), scene.first_mesh_node());
            json!({"centre_m": frame.centre.to_array(), "per_m": frame.scale, "first_mesh_node": first})
        });

        // The description holds what does not depend on the view, in words of WebGPU.
        let vertices = [CORNER_LAYOUT, MAP_UV_LAYOUT, OBJECT_LAYOUT].map(|layout| vertices(&layout));
        let [map_pool, texture_pool] = self.objects.images.pool_sizes();
        let sky_strength = self.scene.sky().map(|(_, strength)| strength.to_array());
        let mut description = json!({
            "programs": programs,
            "pipelines": pipelines,
            "draws": draws,
            "vertices": vertices,
            "lamps": {"vertices": [self::vertices(&LAMP_LAYOUT)], "draw": [CORNERS, self.lamps.count()]},
            "tone_maps": tone_maps.collect::<Map<_, _>>(),
            "formats": {"radiance": word(HDR_FORMAT), "depth": word(DEPTH_FORMAT), "mean": word(accumulation::FORMAT)},
            "textures": {"map_tiles": {"size": map_pool}, "texture_tiles": {"size": texture_pool}},
            "samples": SAMPLES,
            "pictures": PICTURES,
            "local": local,
            "background": sky_strength.unwrap_or_default(),
            "sky_cut": self.sky_cut(),
        });

        // The host finds the fields that it reads and writes by their offsets.
        let structs = [Frame::layout(), ChainStart::layout(), ObjectRecord::layout()];
        for layout in structs
            .into_iter()
            .chain([MapTile::layout(), Node::layout(), Triangle::layout()])
        {
            let fields = layout
                .fields
                .iter()
                .map(|field| (field.name.to_owned(), field.offset.into()));
            description[layout.name] = json!({"size": layout.size, "fields": fields.collect::<Map<_, _>>()});
        }
        description
    }
}

/// A word of WebGPU, which are those of wgpu in lower case.
fn word(value: impl std::fmt::Debug) -> String {
    format!("{value:?}").to_lowercase()
}

fn constants(values: &[(&str, f64)]) -> Value {
    let values = values.iter();
    values
        .map(|(name, value)| ((*name).to_owned(), Value::from(*value)))
        .collect()
}

fn vertices(layout: &wgpu::VertexBufferLayout<'_>) -> Value {
    let attributes = layout.attributes.iter().map(|attribute| {
        let (format, location) = (word(attribute.format), attribute.shader_location);
        json!({"format": format, "offset": attribute.offset, "shaderLocation": location})
    });
    let attributes: Value = attributes.collect();
    json!({"arrayStride": layout.array_stride, "stepMode": word(layout.step_mode), "attributes": attributes})
}

/// How a pipeline of surfaces differs from others.
fn pipeline(key: PipelineKey) -> Value {
    let (writes_depth, compare) = key.depth();
    json!({
        "program": key.program().name,
        "entry": key.entry_point(),
        "constants": constants(&key.constants()),
        "cull": key.cull_mode().map_or("none".into(), word),
        "depth": [writes_depth, word(compare)],
        "samples": key.sample_count(SAMPLES),
        "format": (key.writes != RenderTarget::Depth).then(|| word(HDR_FORMAT)),
    })
}
