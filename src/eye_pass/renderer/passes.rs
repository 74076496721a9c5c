//! The passes of one picture: chains first, then all surfaces.

use std::ops::Range;

use glam::{DMat4, DVec3, DVec4};

use super::bindings::bind_group;
use super::chains::ChainScene;
use super::draws::{Draw, DrawList, DrawState, visible_objects};
use super::draws::{EyeQuality, Sample};
use super::geometry::Segment;
use super::pipelines::{PipelineKey, RenderTarget};
use super::sky::Sky;
use super::targets::Targets;
use super::timing::{AFTER_CHAINS, BEFORE_CHAINS, SURFACES};
use super::uniforms::{Frame, SeenWavelengths, rgb};
use super::{MapStyle, Renderer};
use crate::effect::EffectSwitch;
use crate::error::Result;
use crate::eye_pass::reference::ChainLimits;
use crate::eye_pass::{View, wavelengths};
use crate::gpu::Gpu;
use crate::optics::LinearSrgb;

/// Largest scaled radiance of a background; `LARGEST` in `frame.wgsl`.
const LARGEST_SCALED: f64 = 16368.0;
/// Level bias that always selects the finest level.
const FINEST: f64 = -64.0;
/// Exposed radiance of mirrors while chains are switched off [1].
const STAND_IN: f64 = 0.15;

impl Renderer {
    /// Draws radiance times a scale into the renderer's own targets.
    pub(super) fn draw_radiance(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
        radiance_scale: f64,
        sample: Sample,
    ) -> Result<()> {
        // The targets are overwritten from here on, so that after an error they show no view.
        let quality = self.quality;
        self.collect_times(gpu);
        self.drawn_view = None;
        let size = [view.width, view.height];
        let targets = Targets::of_size(self.targets.take(), gpu, "picture", size, self.sample_count)?;

        // Chains have an image of their own with one sample per pixel, as each of them may take dozens of rays.
        let list = self.prepare(gpu, view);
        if list.specular_objects > 0 {
            let limit = gpu.limits().max_texture_dimension_2d;
            let scaled = |pixels: u32| (f64::from(pixels) * quality.traced_scale).ceil() as u32;
            let size = size.map(|pixels| scaled(pixels).clamp(1, limit));
            let traced = Targets::of_size(self.traced.take(), gpu, "traced picture", size, 1)?;
            self.traced = Some(traced);
        }
        let frame = self.frame(view, radiance_scale, sample, quality);

        // Chains and shadow rays go through the scene; pictures without them need no hierarchy.
        let needs_scene = list.all().any(|draw| draw.key.writes.goes_through_scene());
        let through_scene = needs_scene
            .then(|| self.bind_chains(gpu, view, quality, sample))
            .flatten();

        // The traced image is complete before the surfaces compose it; its samples are spread over its own pixels.
        if let Some(chains) = &through_scene {
            let traced = Frame {
                jitter: jitter(view, sample.traced_offset(quality)),
                ..frame
            };
            self.trace(encoder, &self.bind_frame(gpu, &traced), chains, &list);
        }

        // The target holds half floats, to whose range the background is clamped.
        let frame = self.bind_frame(gpu, &frame);
        let background = view
            .background
            .map(|channel| (channel * radiance_scale).min(LARGEST_SCALED));
        let marks = self.timing.as_ref().map(|timing| timing.marks(SURFACES));
        let mut pass = targets.begin_pass(encoder, background.to_array(), marks);
        pass.set_bind_group(0, &frame, &[]);

        // Group 1 is either the traced image or the scene, so that surfaces are drawn in two runs.
        if let Some(sky) = self.seen_sky() {
            sky.draw(&mut pass);
        }
        if let Some(composed) = self.bind_composed(gpu, &list) {
            pass.set_bind_group(1, &composed, &[]);
        }
        let (composed, own): (Vec<Draw>, Vec<Draw>) = list
            .surfaces
            .iter()
            .partition(|draw| draw.key.writes == RenderTarget::Composed);
        self.draw_each(&mut pass, &composed);
        if let Some(chains) = &through_scene {
            pass.set_bind_group(1, chains, &[]);
        }
        self.draw_each(&mut pass, &own);
        if self.map_style == MapStyle::Lit {
            self.lamps.draw(gpu, &mut pass);
        }
        drop(pass);
        self.drawn = [list.surfaces.len(), list.specular_objects];
        self.targets = Some(targets);
        Ok(())
    }

    /// Group 1 of pipelines that trace; `None` if nothing traces.
    fn bind_chains(
        &self,
        gpu: &Gpu,
        view: &View,
        quality: EyeQuality,
        sample: Sample,
    ) -> Option<wgpu::BindGroup> {
        let (scene, layout) = (self.chain_scene.as_ref()?, self.surfaces.traced_layout()?);
        let limits = ChainLimits {
            branching_depth: quality.branching_depth,
            ..ChainLimits::default()
        };
        let start = scene.start(view, &limits);
        let wavelengths = if self.draw_state().flags.is_dispersive {
            SeenWavelengths::of(&wavelengths::of_picture(sample.picture), &self.objects.glasses)
        } else {
            SeenWavelengths::default()
        };
        scene.bind(gpu, layout, &self.geometry, &start, &wavelengths)
    }

    /// Traces the chains of the visible specular surfaces.
    fn trace(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &wgpu::BindGroup,
        chains: &wgpu::BindGroup,
        list: &DrawList,
    ) {
        let Some(targets) = self.traced.as_ref().filter(|_| !list.traced.is_empty()) else {
            return;
        };
        let marks = |of| self.timing.as_ref().map(|timing| timing.marks(of));
        let mut pass = targets.begin_depth(encoder, marks(BEFORE_CHAINS));
        pass.set_bind_group(0, frame, &[]);
        self.draw_each(&mut pass, &list.depths);
        drop(pass);
        let mut pass = targets.begin_chains(encoder, marks(AFTER_CHAINS));
        pass.set_bind_group(0, frame, &[]);
        pass.set_bind_group(1, chains, &[]);
        if let Some(sky) = self.seen_sky() {
            pass.set_bind_group(2, sky.bound(), &[]);
        }
        self.draw_each(&mut pass, &list.traced);
    }

    /// Creates what a view needs and does not exist yet; returns its draw list.
    fn prepare(&mut self, gpu: &Gpu, view: &View) -> DrawList {
        if self.chains == EffectSwitch::On {
            self.make_everything(gpu);
        }
        self.make_sky(gpu);
        self.lamps
            .make(gpu, &self.surfaces.frame_layout, self.sample_count);
        let visible = visible_objects(&self.objects, view);
        let pixel_rad = view.camera.vertical_fov_rad / f64::from(view.height);
        self.objects
            .keep_budget(gpu, view.camera.position, pixel_rad, &visible);
        let draw_state = self.draw_state();
        let is_specular = |object: &usize| draw_state.is_specular(&self.objects.list[*object]);
        if draw_state.flags.traces_lights || visible.iter().any(is_specular) {
            self.make_chain_scene(gpu);
        }
        // Chains may have been refused just above, which changes the draw state.
        let list = DrawList::new(&self.objects, &visible, self.draw_state());
        for draw in list.all() {
            self.surfaces.make(gpu, draw.key);
        }
        list
    }

    /// Uploads the environment if it is visible and not uploaded yet.
    pub(super) fn make_sky(&mut self, gpu: &Gpu) {
        match &self.scene.environment {
            Some(source) if self.shows_sky() => {
                if !self.sky.as_ref().is_some_and(|sky| sky.is_of(source)) {
                    self.sky = Some(Sky::new(
                        gpu,
                        source,
                        &self.surfaces.frame_layout,
                        self.sample_count,
                    ));
                }
            }
            Some(_) => {}
            None => self.sky = None,
        }
    }

    /// The environment, if it is visible.
    pub(super) fn seen_sky(&self) -> Option<&Sky> {
        self.sky.as_ref().filter(|_| self.shows_sky())
    }

    /// Background radiance [W/(m² sr)], or the factor of the environment's radiance.
    fn background(&self, view: &View) -> LinearSrgb {
        match self.scene.sky() {
            Some((_, strength)) if self.shows_sky() => strength,
            _ => view.background,
        }
    }

    /// Creates what any view could need when maps are shown as light.
    pub(super) fn make_everything(&mut self, gpu: &Gpu) {
        let lit = |draw_state: DrawState| DrawState {
            style: MapStyle::Lit,
            ..draw_state
        };
        let has_specular = lit(self.draw_state()).has_specular(&self.objects);
        if has_specular {
            self.make_chain_scene(gpu);
        }
        let draw_state = lit(self.draw_state());
        for look in &self.objects.list {
            let traced = if has_specular {
                draw_state.traced_keys(look)
            } else {
                Vec::new()
            };
            for key in draw_state.key(look).into_iter().chain(traced) {
                self.surfaces.make(gpu, key);
            }
        }
    }

    /// Builds what chains are traced through, or updates it if it is stale.
    pub(super) fn make_chain_scene(&mut self, gpu: &Gpu) {
        if self.chain_scene.is_none() || self.chain_scene_is_stale {
            let before = self.chain_scene.take();
            match ChainScene::new(gpu, &self.scene, &self.geometry, before) {
                Ok(made) => {
                    self.chain_scene = Some(made);
                    self.chain_scene_is_stale = false;
                    self.lights_are_stale = true;
                }
                Err(refusal) => {
                    log::warn!("{refusal}");
                    self.refusal = Some(refusal);
                }
            }
        }
        if let Some(scene) = self.chain_scene.as_mut().filter(|_| self.lights_are_stale) {
            scene.set_lights(gpu, &self.scene);
            self.lights_are_stale = false;
        }
    }

    fn frame(&self, view: &View, radiance_scale: f64, sample: Sample, quality: EyeQuality) -> Frame {
        // Without a traced image, its size is taken to be that of the frame.
        let camera = &view.camera;
        let size = [view.width, view.height].map(f64::from);
        let traced = self
            .traced
            .as_ref()
            .map_or([view.width, view.height], |traced| traced.size);
        let half_height = (0.5 * camera.vertical_fov_rad).tan();
        let traced_height = f64::from(traced[1]);
        let traced_per_pixel = [0, 1].map(|axis: usize| f64::from(traced[axis]) / size[axis]);
        let level_bias = if quality.minifies {
            sample.level_bias
        } else {
            FINEST
        };

        // Mirrors without chains and values that are not finite look the same at any exposure, which is divided out.
        Frame {
            clip_from_camera: clip_from_camera(view),
            camera_position: single(camera.position),
            radiance_scale: radiance_scale as f32,
            background: rgb(self.background(view)),
            level_bias: level_bias as f32,
            forward: single(camera.forward),
            traced_width: traced[0] as f32,
            right: single(camera.right() * (half_height * size[0] / size[1])),
            traced_height: traced_height as f32,
            up: single(camera.up * half_height),
            pixel_rad: (2.0 * half_height / traced_height) as f32,
            jitter: jitter(view, sample.offset),
            traced_per_pixel: traced_per_pixel.map(|ratio| ratio as f32),
            traced_offset: [0, 1].map(|axis: usize| {
                let offset = sample.offset[axis] - sample.traced_offset(quality)[axis];
                (offset * traced_per_pixel[axis]) as f32
            }),
            stand_in: if self.has_stand_in {
                (STAND_IN / view.exposure_stops.exp2()) as f32
            } else {
                0.0
            },
            colour_scale: self.map_style.colour_scale().map(|number| number as f32),
            fault: (radiance_scale / view.exposure_stops.exp2()) as f32,
            picture: sample.picture,
            sky_cut: self.sky_cut(),
        }
    }

    /// Luminance above which a pixel of the sky belongs to a sun [W/(m² sr)].
    pub(super) fn sky_cut(&self) -> f32 {
        let sky = self.scene.environment.as_ref();
        sky.map_or(f32::MAX, |sky| sky.suns().cut.min(f64::from(f32::MAX)) as f32)
    }

    fn bind_frame(&self, gpu: &Gpu, frame: &Frame) -> wgpu::BindGroup {
        let buffer = gpu.filled_buffer("frame", bytemuck::bytes_of(frame), wgpu::BufferUsages::UNIFORM);
        let [maps, textures] = self.objects.images.views();
        let resources = [
            buffer.as_entire_binding(),
            self.objects.records.binding(),
            self.objects.images.table.binding(),
            wgpu::BindingResource::TextureView(&maps),
            wgpu::BindingResource::TextureView(&textures),
        ];
        bind_group(gpu, "frame", &self.surfaces.frame_layout, resources)
    }

    fn bind_composed(&self, gpu: &Gpu, list: &DrawList) -> Option<wgpu::BindGroup> {
        let traced = self.traced.as_ref().filter(|_| list.specular_objects > 0)?;
        let resources = [wgpu::BindingResource::TextureView(&traced.resolved_view)];
        Some(bind_group(
            gpu,
            "traced picture",
            &self.surfaces.composed_layout,
            resources,
        ))
    }

    /// Instances that follow each other are one draw.
    pub(super) fn runs(&self, draws: &[Draw]) -> Vec<(PipelineKey, &Segment, Range<u32>)> {
        let mut runs: Vec<(PipelineKey, &Segment, Range<u32>)> = Vec::new();
        for draw in draws {
            let object = draw.object as u32;
            for segment in &self.geometry.segments[draw.object] {
                match runs.last_mut() {
                    Some((key, of, run)) if *key == draw.key && *of == segment && run.end == object => {
                        run.end += 1;
                    }
                    _ => runs.push((draw.key, segment, object..object + 1)),
                }
            }
        }
        runs
    }

    fn draw_each(&self, pass: &mut wgpu::RenderPass<'_>, draws: &[Draw]) {
        pass.set_vertex_buffer(2, self.objects.records.buffer().slice(..));
        let (mut present_key, mut present_page) = (None, None);
        for (key, segment, objects) in self.runs(draws) {
            let Some(pipeline) = self.surfaces.get(key) else {
                continue;
            };
            if present_key.replace(key) != Some(key) {
                pass.set_pipeline(pipeline);
            }
            if present_page.replace(segment.page) != Some(segment.page) {
                let page = &self.geometry.pages[segment.page];
                pass.set_vertex_buffer(0, page.corners.slice(..));
                pass.set_vertex_buffer(1, page.map_uvs.slice(..));
                pass.set_index_buffer(page.indices.slice(..), wgpu::IndexFormat::Uint32);
            }
            pass.draw_indexed(segment.indices.clone(), 0, objects);
        }
    }
}

/// Converts an offset right and down [pixels] to the shaders' right and up [half images].
fn jitter(view: &View, [right, down]: [f64; 2]) -> [f32; 2] {
    let half = |pixels: f64, size: u32| (2.0 * pixels / f64::from(size)) as f32;
    [half(right, view.width), -half(down, view.height)]
}

/// Clip space from world axes with the camera at the origin. Depth is near/distance: 1 at the near plane, 0 at
/// infinity, with the same relative precision at all distances.
pub(super) fn clip_from_camera(view: &View) -> [[f32; 4]; 4] {
    let camera = &view.camera;
    let aspect = f64::from(view.width) / f64::from(view.height);
    let focal = 1.0 / (0.5 * camera.vertical_fov_rad).tan();
    let x = camera.right() * (focal / aspect);
    let y = camera.up * focal;
    let rows = [
        x.extend(0.0),
        y.extend(0.0),
        DVec4::new(0.0, 0.0, 0.0, camera.near_m),
        camera.forward.extend(0.0),
    ];
    DMat4::from_cols_array_2d(&rows.map(|row| row.to_array()))
        .transpose()
        .as_mat4()
        .to_cols_array_2d()
}

/// A point in single precision [m].
pub(super) fn single(point: DVec3) -> [f32; 3] {
    point.as_vec3().to_array()
}
