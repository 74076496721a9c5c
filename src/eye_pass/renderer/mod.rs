//! The eye pass on the device: depth-tested triangles, radiance from the illumination maps, then tone mapping.
//!
//! Diffuse surfaces show L = ρE/π. Specular ones are approximated: they reflect the scene's plane receivers, coarsely
//! (see `surroundings`), and the view's background, but no other object, and what is clear shows what is straight
//! behind it, unbent, dimmed by Fresnel's equations, by the body's tint and by the square of its refractive index. The
//! CPU eye pass follows the true paths.

mod bindings;
mod camera;
mod geometry;
mod maps;
mod objects;
mod pipelines;
mod shaders;
mod surroundings;
mod targets;
mod textures;
mod tiles;
mod uniforms;

pub use shaders::{programs, shared_structs, vertex_attributes};
pub use tiles::Uploaded;

use half::f16;
use wgpu::util::DeviceExt;

use self::bindings::bind_group;
use self::geometry::Geometry;
use self::maps::ShownMap;
use self::objects::{DeviceObject, Objects};
use self::pipelines::{ClearPipelines, SurfacePipelines, ToneMappingPipeline};
use self::surroundings::DeviceSurroundings;
use self::targets::Targets;
use self::uniforms::{Frame, ToneMapping, rgb};
use super::{Picture, ToneMap, View};
use crate::error::{Error, Result};
use crate::gpu::{Gpu, readback};
use crate::illumination::IlluminationMap;
use crate::scene::{Scene, SurfaceKind};

/// Largest value of scaled radiance that the picture is scaled to: half floats end at 65504, and a body may still
/// multiply it by the square of its refractive index.
const LARGEST_SCALED: f64 = 4096.0;

/// What the values of maps stand for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MapStyle {
    /// Irradiance [W/m²]: surfaces send it by their albedo, mirrors reflect it, glass lets it through.
    #[default]
    Lit,
    /// Colours in linear light: shown as they are, and clear bodies left out. Surfaces without a map are black.
    AsItIs,
}

/// A scene on the device, drawn as often as asked.
#[derive(Debug)]
pub struct Renderer {
    sample_count: u32,
    encode_srgb: bool,
    surfaces: SurfacePipelines,
    tone_mapping: ToneMappingPipeline,
    geometry: Geometry,
    objects: Objects,
    surroundings: DeviceSurroundings,
    surroundings_sampler: wgpu::Sampler,
    targets: Option<Targets>,
    map_style: MapStyle,
}

impl Renderer {
    /// Uploads a scene. `colour_format` is that of the targets of [`draw`](Self::draw): formats that encode sRGB by
    /// themselves get linear light, all others get encoded values. `sample_count` is 1 or 4 samples per pixel.
    ///
    /// # Errors
    /// Another sample count; a device that refuses what it is given.
    pub fn new(
        gpu: &Gpu,
        scene: &Scene,
        colour_format: wgpu::TextureFormat,
        sample_count: u32,
    ) -> Result<Self> {
        if ![1, 4].contains(&sample_count) {
            return Err(Error::usage(
                "samples per pixel",
                format!("{sample_count} is not offered"),
                "use 1 or 4",
            ));
        }
        let surfaces = SurfacePipelines::new(gpu, sample_count);
        let renderer = Self {
            sample_count,
            encode_srgb: !colour_format.is_srgb(),
            tone_mapping: ToneMappingPipeline::new(gpu, colour_format),
            geometry: Geometry::new(gpu, scene),
            objects: Objects::new(gpu, scene, &surfaces.object_layout),
            surfaces,
            surroundings: DeviceSurroundings::none(gpu),
            surroundings_sampler: linear_sampler(gpu),
            targets: None,
            map_style: MapStyle::default(),
        };
        gpu.take_error().map_or(Ok(renderer), Err)
    }

    /// Shows an edited scene: other materials, moved objects. Uploads what differs; the maps stay until
    /// [`set_maps`](Self::set_maps), which has to follow where anything was uploaded: mirrors see what changed.
    ///
    /// # Errors
    /// A device that refuses what it is given.
    pub fn set_scene(&mut self, gpu: &Gpu, scene: &Scene) -> Result<Uploaded> {
        let mut uploaded = Uploaded::default();
        if self.objects.list.len() == scene.objects.len() {
            uploaded += self.geometry.set_scene(gpu, scene);
            uploaded += self.objects.set_scene(gpu, scene);
        } else {
            self.geometry = Geometry::new(gpu, scene);
            self.objects = Objects::new(gpu, scene, &self.surfaces.object_layout);
        }
        gpu.take_error().map_or(Ok(uploaded), Err)
    }

    /// Replaces all illumination maps; surfaces without one are dark. Of maps that keep their size only the tiles that
    /// differ from what is shown are uploaded.
    ///
    /// # Errors
    /// A map that does not belong to the scene or is larger than the device's textures: the old maps stay. A device
    /// that refuses what it is given.
    pub fn set_maps(&mut self, gpu: &Gpu, scene: &Scene, maps: &[IlluminationMap]) -> Result<Uploaded> {
        let shown: Vec<ShownMap> = maps.iter().map(ShownMap::of).collect();
        let mut uploaded = self.objects.set_maps(gpu, scene, &shown)?;
        for map in maps {
            uploaded += self.geometry.set_chart(gpu, &map.chart);
        }
        uploaded += self.surroundings.update(gpu, scene, &shown);
        gpu.take_error().map_or(Ok(uploaded), Err)
    }

    /// Says what the values of the maps stand for, from the next picture on.
    pub fn set_map_style(&mut self, style: MapStyle) {
        self.map_style = style;
    }

    /// Draws a picture into `target`, a view of the size of `view` and of the format given to [`new`](Self::new).
    /// Draws nothing for a size of 0, which a minimised window has.
    ///
    /// # Errors
    /// A picture larger than the device's textures.
    pub fn draw(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        view: &View,
    ) -> Result<()> {
        if view.width == 0 || view.height == 0 {
            return Ok(());
        }
        // Exposed already, so that half floats hold whatever can be displayed.
        let exposure = view.exposure_stops.exp2();
        self.draw_radiance(gpu, encoder, view, exposure)?;
        if let Some(targets) = &self.targets {
            let uniform = ToneMapping {
                exposure: 1.0,
                tone_map: tone_map_code(view.tone_map),
                encode_srgb: u32::from(self.encode_srgb),
                padding: 0,
            };
            self.tone_mapping
                .draw(gpu, encoder, target, &targets.resolved_view, uniform);
        }
        Ok(())
    }

    /// Radiance per pixel without exposure and tone mapping, in the precision of half floats.
    ///
    /// # Errors
    /// A size of 0 or above the device's limit; a lost device.
    pub fn radiance(&mut self, gpu: &Gpu, view: &View) -> Result<Picture> {
        let peak = self.objects.peak_radiance.max(view.background.max_channel());
        // A power of two changes no digit.
        let scale = if peak > 0.0 {
            (LARGEST_SCALED / peak).log2().floor().exp2()
        } else {
            1.0
        };
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor {
                label: Some("radiance"),
            });
        let targets = self.draw_radiance(gpu, &mut encoder, view, scale)?;
        gpu.queue.submit([encoder.finish()]);
        let bytes = readback::read_texture(gpu, &targets.resolved)?;
        let unscaled = |half: f16| (f64::from(half) / scale) as f32;
        let texels = bytes.chunks_exact(8).map(|texel| {
            std::array::from_fn(|channel| {
                unscaled(f16::from_le_bytes([texel[2 * channel], texel[2 * channel + 1]]))
            })
        });
        Ok(Picture {
            width: view.width,
            height: view.height,
            radiance: texels.collect(),
        })
    }

    /// The surface pass, into this renderer's own targets.
    fn draw_radiance(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
        radiance_scale: f64,
    ) -> Result<&Targets> {
        let size_fits = |targets: &Targets| (targets.width, targets.height) == (view.width, view.height);
        let targets = match self.targets.take().filter(size_fits) {
            Some(targets) => targets,
            None => Targets::new(gpu, view.width, view.height, self.sample_count)?,
        };
        let frame = self.bind_frame(gpu, view, radiance_scale);
        let background = view
            .background
            .map(|channel| (channel * radiance_scale).min(LARGEST_SCALED));
        {
            let mut pass = targets.begin_pass(encoder, background.to_array());
            pass.set_bind_group(0, &frame, &[]);
            self.draw_opaque(&mut pass);
            if self.map_style == MapStyle::Lit {
                self.draw_clear(&mut pass, view);
            }
        }
        Ok(self.targets.insert(targets))
    }

    fn bind_frame(&self, gpu: &Gpu, view: &View, radiance_scale: f64) -> wgpu::BindGroup {
        let frame = Frame {
            clip_from_camera: camera::clip_from_camera(view),
            camera_position: camera::single(view.camera.position),
            radiance_scale: radiance_scale as f32,
            background: rgb(view.background),
            maps_as_they_are: u32::from(self.map_style == MapStyle::AsItIs),
        };
        let buffer = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("frame"),
            contents: bytemuck::bytes_of(&frame),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let resources = [
            buffer.as_entire_binding(),
            self.surroundings.uniform.as_entire_binding(),
            wgpu::BindingResource::TextureView(&self.surroundings.images),
            wgpu::BindingResource::Sampler(&self.surroundings_sampler),
        ];
        bind_group(gpu, "frame", &self.surfaces.frame_layout, resources)
    }

    fn draw_opaque(&self, pass: &mut wgpu::RenderPass<'_>) {
        for (index, object) in self.objects.list.iter().enumerate() {
            if !is_clear(object.look.surface) {
                let pipelines = &self.surfaces;
                let pipeline = if object.look.double_sided {
                    &pipelines.opaque_double_sided
                } else {
                    &pipelines.opaque_single_sided
                };
                pass.set_pipeline(pipeline);
                self.draw_object(pass, index, object);
            }
        }
    }

    /// Far ones first; within a body the far side first.
    fn draw_clear(&self, pass: &mut wgpu::RenderPass<'_>, view: &View) {
        let mut clear: Vec<_> = self
            .objects
            .list
            .iter()
            .enumerate()
            .filter(|(_, object)| is_clear(object.look.surface))
            .collect();
        let distance = |object: &DeviceObject| object.look.centre.distance_squared(view.camera.position);
        clear.sort_by(|(_, a), (_, b)| distance(b).total_cmp(&distance(a)));
        for (index, object) in clear {
            let faces: &[&ClearPipelines] = match object.look.surface {
                SurfaceKind::ThinWall => &[&self.surfaces.clear_both_faces],
                _ => &[&self.surfaces.clear_back_faces, &self.surfaces.clear_front_faces],
            };
            for pipelines in faces {
                let in_turn: &[_] = if object.look.is_grey {
                    &[&pipelines.grey]
                } else {
                    &[&pipelines.transmitted, &pipelines.reflected]
                };
                for pipeline in in_turn {
                    pass.set_pipeline(pipeline);
                    self.draw_object(pass, index, object);
                }
            }
        }
    }

    fn draw_object(&self, pass: &mut wgpu::RenderPass<'_>, index: usize, object: &DeviceObject) {
        pass.set_bind_group(1, &object.bind_group, &[]);
        for segment in &self.geometry.segments[index] {
            let page = &self.geometry.pages[segment.page];
            pass.set_vertex_buffer(0, page.corners.slice(..));
            pass.set_vertex_buffer(1, page.map_uvs.slice(..));
            pass.set_index_buffer(page.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(segment.indices.clone(), 0, 0..1);
        }
    }
}

/// One picture without a window: radiance before exposure and tone mapping, with 1 or 4 `samples` per pixel; a single
/// sample lies at the pixel's centre.
///
/// # Errors
/// Those of [`Renderer::new`], [`Renderer::set_maps`] and [`Renderer::radiance`].
pub fn render_offscreen(
    gpu: &Gpu,
    scene: &Scene,
    maps: &[IlluminationMap],
    view: &View,
    samples: u32,
) -> Result<Picture> {
    let mut renderer = Renderer::new(gpu, scene, wgpu::TextureFormat::Rgba8Unorm, samples)?;
    renderer.set_maps(gpu, scene, maps)?;
    renderer.radiance(gpu, view)
}

fn linear_sampler(gpu: &Gpu) -> wgpu::Sampler {
    gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("surroundings"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    })
}

fn is_clear(surface: SurfaceKind) -> bool {
    matches!(surface, SurfaceKind::Dielectric | SurfaceKind::ThinWall)
}

/// The shader's `TONE_MAP_*`.
fn tone_map_code(tone_map: ToneMap) -> u32 {
    match tone_map {
        ToneMap::None => 0,
        ToneMap::Neutral => 1,
    }
}
