//! The eye pass on the device: depth-tested triangles, radiance from the illumination maps, then tone mapping.
//!
//! Diffuse surfaces show L = ρE/π. Specular ones are approximated: they reflect the scene's plane receivers, coarsely
//! (see `surroundings`), and the view's background, but no other object, and what is clear shows what is straight
//! behind it, unbent, dimmed by Fresnel's equations, by the body's tint and by the square of its refractive index. The
//! CPU eye pass follows the true paths.
//!
//! Only what a view calls for is made: pipelines when an object that needs them first comes into view, and so what
//! mirrors and glass are shown.

mod bindings;
mod camera;
mod counts;
mod draws;
mod geometry;
mod maps;
mod objects;
mod pipelines;
mod receivers;
mod shaders;
mod surroundings;
mod targets;
mod textures;
mod tiles;
mod timing;
mod tone_mapping;
mod uniforms;

pub use counts::{EyeCounts, GpuMs};
pub use shaders::{Specialisation, programs, shared_structs, specialisations, vertex_attributes};
pub use tiles::Uploaded;

use half::f16;
use wgpu::util::DeviceExt;

use self::bindings::bind_group;
use self::draws::{Draw, DrawList, Manner, visible_objects};
use self::geometry::Geometry;
use self::maps::ShownMap;
use self::objects::Objects;
use self::pipelines::SurfacePipelines;
use self::receivers::LitSurface;
use self::surroundings::DeviceSurroundings;
use self::targets::Targets;
use self::timing::Timing;
use self::tone_mapping::ToneMappingPipelines;
use self::uniforms::{Frame, rgb};
use super::{Picture, View};
use crate::effect::EffectSwitch;
use crate::error::{Error, Result};
use crate::gpu::{Gpu, readback};
use crate::illumination::IlluminationMap;
use crate::scene::Scene;

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
    scene: Scene,
    surfaces: SurfacePipelines,
    tone_mapping: ToneMappingPipelines,
    geometry: Geometry,
    objects: Objects,
    surroundings: Option<DeviceSurroundings>,
    /// Whether the scene or the maps changed since the surroundings were made.
    surroundings_are_stale: bool,
    targets: Option<Targets>,
    map_style: MapStyle,
    chains: EffectSwitch,
    timing: Option<Timing>,
    /// Objects of the last picture, and the specular ones among them.
    drawn: [usize; 2],
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
            scene: scene.clone(),
            tone_mapping: ToneMappingPipelines::new(gpu, colour_format),
            geometry: Geometry::new(gpu, scene),
            objects: Objects::new(gpu, scene, &surfaces.object_layout),
            surfaces,
            surroundings: None,
            surroundings_are_stale: true,
            targets: None,
            map_style: MapStyle::default(),
            chains: EffectSwitch::default(),
            timing: Timing::new(gpu),
            drawn: [0; 2],
        };
        gpu.take_error().map_or(Ok(renderer), Err)
    }

    /// Shows an edited scene: other materials, moved objects. Uploads what differs; the maps stay until
    /// [`set_maps`](Self::set_maps), unless the number of objects changed.
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
        self.scene = scene.clone();
        self.surroundings_are_stale = true;
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
        self.surroundings_are_stale = true;
        gpu.take_error().map_or(Ok(uploaded), Err)
    }

    /// Says what the values of the maps stand for, from the next picture on.
    pub fn set_map_style(&mut self, style: MapStyle) {
        self.map_style = style;
    }

    /// Switches what is seen in mirrors and through glass, from the next picture on. Auto makes what it takes when a
    /// specular surface comes into view, on makes at once what all of the scene's objects could take. Off gives it up:
    /// mirrors show what they emit, polished surfaces their diffuse part, and clear bodies are left out.
    ///
    /// # Errors
    /// A device that refuses what it is given.
    pub fn set_chains(&mut self, gpu: &Gpu, switch: EffectSwitch) -> Result<()> {
        self.chains = switch;
        match switch {
            EffectSwitch::Auto => {}
            EffectSwitch::On => self.make_everything(gpu),
            EffectSwitch::Off => {
                self.surfaces.drop_specular();
                self.surroundings = None;
            }
        }
        gpu.take_error().map_or(Ok(()), Err)
    }

    /// What was made and drawn so far.
    pub fn counts(&self) -> EyeCounts {
        EyeCounts {
            pipelines: (self.surfaces.count() + self.tone_mapping.count()) as u64,
            specular_pipelines: self.surfaces.specular_count() as u64,
            surroundings_bytes: self.surroundings.as_ref().map_or(0, DeviceSurroundings::bytes),
            map_bytes: self.objects.map_bytes(),
            drawn_objects: self.drawn[0] as u64,
            drawn_specular: self.drawn[1] as u64,
            gpu_ms: self.timing.as_ref().and_then(Timing::latest),
        }
    }

    /// Looks whether the device has told how long pictures took, without waiting for it. Tells whether it has:
    /// [`counts`](Self::counts) then says so. [`draw`](Self::draw) does this too, for pictures before its own.
    pub fn collect_times(&mut self, gpu: &Gpu) -> bool {
        self.timing.as_mut().is_some_and(|timing| timing.collect(gpu))
    }

    /// Whether the device has still to tell how long a picture took.
    pub fn awaits_times(&self) -> bool {
        self.timing.as_ref().is_some_and(Timing::is_waiting)
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
        let has_specular = self.draw_radiance(gpu, encoder, view, exposure)?;
        if let Some(targets) = &self.targets {
            let marks = self.timing.as_ref().map(Timing::around_tone_mapping);
            let radiance = &targets.resolved_view;
            self.tone_mapping
                .draw(gpu, encoder, target, radiance, view.tone_map, marks);
        }
        if let Some(timing) = &mut self.timing {
            timing.finish(encoder, has_specular, true);
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
        let has_specular = self.draw_radiance(gpu, &mut encoder, view, scale)?;
        if let Some(timing) = &mut self.timing {
            timing.finish(&mut encoder, has_specular, false);
        }
        gpu.queue.submit([encoder.finish()]);
        let bytes = match &self.targets {
            Some(targets) => readback::read_texture(gpu, &targets.resolved)?,
            None => Vec::new(),
        };
        self.collect_times(gpu);
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

    /// The surface pass, into this renderer's own targets; tells whether it drew anything specular.
    fn draw_radiance(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
        radiance_scale: f64,
    ) -> Result<bool> {
        self.collect_times(gpu);
        let size_fits = |targets: &Targets| (targets.width, targets.height) == (view.width, view.height);
        let targets = match self.targets.take().filter(size_fits) {
            Some(targets) => targets,
            None => Targets::new(gpu, view.width, view.height, self.sample_count)?,
        };
        let list = self.prepare(gpu, view);
        let frame = self.bind_frame(gpu, view, radiance_scale);
        let background = view
            .background
            .map(|channel| (channel * radiance_scale).min(LARGEST_SCALED));
        self.draw_surfaces(encoder, &targets, &frame, background.to_array(), &list);
        self.drawn = [list.objects, list.specular_objects];
        self.targets = Some(targets);
        Ok(list.specular_objects > 0)
    }

    /// Specular surfaces are drawn in a pass of their own where times are taken: devices that draw tile by tile cannot
    /// tell the parts of a pass apart.
    fn draw_surfaces(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        targets: &Targets,
        frame: &wgpu::BindGroup,
        background: [f64; 3],
        list: &DrawList,
    ) {
        let timing = self.timing.as_ref();
        let is_split = timing.is_some() && !list.specular.is_empty();
        let marks = timing.map(Timing::around_plain);
        let mut pass = targets.begin_pass(encoder, Some(background), !is_split, marks);
        pass.set_bind_group(0, frame, &[]);
        self.draw_each(&mut pass, &list.plain);
        if is_split {
            drop(pass);
            let marks = timing.map(Timing::around_specular);
            pass = targets.begin_pass(encoder, None, true, marks);
            pass.set_bind_group(0, frame, &[]);
        }
        if let Some(surroundings) = &self.surroundings {
            pass.set_bind_group(2, &surroundings.bind_group, &[]);
        }
        self.draw_each(&mut pass, &list.specular);
    }

    /// Makes what a view calls for and does not exist yet; gives what it draws.
    fn prepare(&mut self, gpu: &Gpu, view: &View) -> DrawList {
        if self.chains == EffectSwitch::On {
            self.make_everything(gpu);
        }
        let visible = visible_objects(&self.objects, view);
        self.make_surroundings(gpu, self.manner(), &visible);
        let list = DrawList::new(&self.objects, &visible, view.camera.position, self.manner());
        for draw in list.plain.iter().chain(&list.specular) {
            self.surfaces.make(gpu, draw.key);
        }
        list
    }

    /// Makes what any view could call for, with maps as light.
    fn make_everything(&mut self, gpu: &Gpu) {
        let lit = Manner {
            style: MapStyle::Lit,
            ..self.manner()
        };
        let all: Vec<usize> = (0..self.objects.list.len()).collect();
        self.make_surroundings(gpu, lit, &all);
        let lit = Manner {
            has_receivers: self.manner().has_receivers,
            ..lit
        };
        for object in &self.objects.list {
            for key in lit.keys(&object.look) {
                self.surfaces.make(gpu, key);
            }
        }
    }

    /// How objects are drawn now.
    fn manner(&self) -> Manner {
        let surroundings = self.surroundings.as_ref();
        Manner {
            style: self.map_style,
            has_chains: self.chains != EffectSwitch::Off,
            has_receivers: surroundings.is_some_and(DeviceSurroundings::has_receivers),
        }
    }

    /// Makes the surroundings or brings them up to date, where any of these objects is specular.
    fn make_surroundings(&mut self, gpu: &Gpu, manner: Manner, objects: &[usize]) {
        let is_specular = |index: &usize| manner.is_specular(&self.objects.list[*index].look);
        let is_up_to_date = self.surroundings.is_some() && !self.surroundings_are_stale;
        if is_up_to_date || !objects.iter().any(is_specular) {
            return;
        }
        let objects = self.objects.list.iter().zip(&self.geometry.charts);
        let lit: Vec<LitSurface> = objects
            .filter_map(|(object, chart)| {
                Some(LitSurface {
                    chart: chart.as_ref()?,
                    map: object.map.as_ref()?,
                })
            })
            .collect();
        let layout = &self.surfaces.surroundings_layout;
        match &mut self.surroundings {
            Some(surroundings) => surroundings.update(gpu, &self.scene, &lit, layout),
            none => *none = Some(DeviceSurroundings::new(gpu, &self.scene, &lit, layout)),
        }
        self.surroundings_are_stale = false;
        self.surfaces.drop_reflecting(!self.manner().has_receivers);
    }

    fn bind_frame(&self, gpu: &Gpu, view: &View, radiance_scale: f64) -> wgpu::BindGroup {
        let frame = Frame {
            clip_from_camera: camera::clip_from_camera(view),
            camera_position: camera::single(view.camera.position),
            radiance_scale: radiance_scale as f32,
            background: rgb(view.background),
            padding: 0,
        };
        let buffer = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("frame"),
            contents: bytemuck::bytes_of(&frame),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let resources = [buffer.as_entire_binding()];
        bind_group(gpu, "frame", &self.surfaces.frame_layout, resources)
    }

    fn draw_each(&self, pass: &mut wgpu::RenderPass<'_>, draws: &[Draw]) {
        for draw in draws {
            let Some(pipeline) = self.surfaces.get(draw.key) else {
                continue;
            };
            pass.set_pipeline(pipeline);
            pass.set_bind_group(1, &self.objects.list[draw.object].bind_group, &[]);
            for segment in &self.geometry.segments[draw.object] {
                let page = &self.geometry.pages[segment.page];
                pass.set_vertex_buffer(0, page.corners.slice(..));
                pass.set_vertex_buffer(1, page.map_uvs.slice(..));
                pass.set_index_buffer(page.indices.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(segment.indices.clone(), 0, 0..1);
            }
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
    let counted = render_counted(gpu, scene, maps, view, samples, EffectSwitch::Auto)?;
    Ok(counted.0)
}

/// [`render_offscreen`] with chains switched, and what was made and drawn for it.
///
/// # Errors
/// Those of [`render_offscreen`].
pub fn render_counted(
    gpu: &Gpu,
    scene: &Scene,
    maps: &[IlluminationMap],
    view: &View,
    samples: u32,
    chains: EffectSwitch,
) -> Result<(Picture, EyeCounts)> {
    let mut renderer = Renderer::new(gpu, scene, wgpu::TextureFormat::Rgba8Unorm, samples)?;
    renderer.set_maps(gpu, scene, maps)?;
    renderer.set_chains(gpu, chains)?;
    let picture = renderer.radiance(gpu, view)?;
    Ok((picture, renderer.counts()))
}
