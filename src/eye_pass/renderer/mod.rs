//! The eye pass on the device: rasterised triangles with radiance from the illumination maps, chains traced where a
//! specular surface is nearest, then tone mapping.
//!
//! Diffuse surfaces show L = ρE/π. Where the nearest surface of a pixel is a mirror, a coat, glass or water, its chain
//! is traced through the scene's hierarchy as in the CPU eye pass, but in single precision and with two approximations:
//! after the first surfaces of a chain only the stronger branch is followed, and images are read with an isotropic
//! footprint. [`EyeQuality`] controls both.
//!
//! Resources are created when a view first needs them: pipelines when an object that uses them comes into view, and
//! likewise what chains are traced through.

mod accumulation;
mod bindings;
mod chains;
mod draws;
mod geometry;
mod images;
mod lamps;
mod maps;
mod minify;
mod objects;
mod offscreen;
mod paging;
mod passes;
mod pipelines;
mod probe;
mod shaders;
mod sky;
mod targets;
mod tiled;
mod timing;
mod tone_mapping;
mod uniforms;
mod web;

pub use draws::EyeQuality;
pub use draws::{EyeCounts, GpuMs, TimedFrame};
pub use objects::{Inspected, MapStyle};
pub use offscreen::render_counted;
pub use paging::Uploaded;
pub use probe::{ProbedHit, probe};
pub use web::{Content, WebScene};

use std::sync::Arc;

use self::accumulation::Mean;
use self::chains::ChainScene;
use self::draws::DrawState;
use self::draws::Sample;
use self::geometry::Geometry;
use self::lamps::SeenLamps;
use self::maps::ShownMap;
use self::objects::{Appearance, Objects};
use self::pipelines::{PipelineFlags, SurfacePipelines};
use self::sky::Sky;
use self::targets::Targets;
use self::timing::Timing;
use self::tone_mapping::{Exposed, ToneMappingPipelines};
use super::View;
use crate::effect::EffectSwitch;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::illumination::IlluminationMap;
use crate::optics::spectrum::xyz::Matrix3;
use crate::scene::Scene;

/// Default memory budget of illumination maps on the device [bytes].
const MAP_BUDGET_BYTES: u64 = 1 << 30;
/// Largest difference of exposures between a frame and the picture shown of it [stops]. Half floats hold radiance of
/// 16,368 times white (`LARGEST` in `frame.wgsl`): four stops darker, a thousand times white is left.
const MAX_GAIN_STOPS: f64 = 4.0;
/// Storage buffers that fragment shaders read even without chains.
const MIN_BUFFERS: u32 = 3;

#[derive(Debug)]
pub struct Renderer {
    sample_count: u32,
    scene: Arc<Scene>,
    surfaces: SurfacePipelines,
    tone_mapping: ToneMappingPipelines,
    geometry: Geometry,
    objects: Objects,
    /// What chains are traced through; `None` until it is needed.
    chain_scene: Option<ChainScene>,
    /// Whether geometry changed since `chain_scene` was built.
    chain_scene_is_stale: bool,
    /// Whether lights or what is around them changed since they were uploaded.
    lights_are_stale: bool,
    /// Why chains are not drawn although they were requested.
    refusal: Option<Error>,
    sky: Option<Sky>,
    lamps: SeenLamps,
    targets: Option<Targets>,
    traced: Option<Targets>,
    mean: Option<Mean>,
    /// Whether mirrors are grey instead of black while chains are switched off.
    has_stand_in: bool,
    /// View of the last [`draw`](Self::draw), with the exposure of its radiance, as long as `targets` show it.
    drawn_view: Option<View>,
    map_style: MapStyle,
    chains: EffectSwitch,
    dispersion: EffectSwitch,
    quality: EyeQuality,
    /// Whether direct light is traced instead of read from the maps.
    traces_lights: bool,
    timing: Option<Timing>,
    /// Objects of the last frame, and the specular ones among them.
    drawn: [usize; 2],
}

impl Renderer {
    /// Uploads a scene. `colour_format` is the format of the targets of [`draw`](Self::draw): sRGB formats receive
    /// linear values, all others encoded ones. `sample_count` is 1 or 4 samples per pixel.
    ///
    /// # Errors
    /// An unsupported sample count; an error of the device.
    pub fn new(
        gpu: &Gpu,
        scene: &Scene,
        colour_format: wgpu::TextureFormat,
        sample_count: u32,
    ) -> Result<Self> {
        // Devices guarantee one and four samples alone.
        if ![1, 4].contains(&sample_count) {
            return Err(Error::usage(
                "samples per pixel",
                format!("{sample_count} is not offered"),
                "use 1 or 4",
            ));
        }
        if gpu.limits().max_storage_buffers_per_shader_stage < MIN_BUFFERS {
            return Err(Error::failure(
                "graphics device",
                format!("{} lets fragments read no storage buffers", gpu.adapter_name()),
                "update its driver, or use --backend cpu",
            ));
        }

        // Chains, environment and targets are created with the first view that needs them.
        let scene = Arc::new(scene.as_seen());
        let geometry = Geometry::new(gpu, &scene);
        let lamps = SeenLamps::new(gpu, &scene);
        let renderer = Self {
            sample_count,
            tone_mapping: ToneMappingPipelines::new(gpu, colour_format),
            objects: Objects::new(gpu, &scene, &geometry, MAP_BUDGET_BYTES),
            scene,
            geometry,
            surfaces: SurfacePipelines::new(gpu, sample_count),
            chain_scene: None,
            chain_scene_is_stale: false,
            lights_are_stale: true,
            refusal: None,
            sky: None,
            lamps,
            targets: None,
            traced: None,
            mean: None,
            drawn_view: None,
            has_stand_in: false,
            map_style: MapStyle::default(),
            chains: EffectSwitch::default(),
            dispersion: EffectSwitch::default(),
            quality: EyeQuality::default(),
            traces_lights: false,
            timing: Timing::new(gpu),
            drawn: [0; 2],
        };

        // Calls to the device return no errors: a callback collects them.
        gpu.take_error().map_or(Ok(renderer), Err)
    }

    /// Switches to an edited scene with other materials or moved objects. Uploads what differs; the maps stay until
    /// [`set_maps`](Self::set_maps), unless the number of objects changed.
    ///
    /// # Errors
    /// An error of the device.
    pub fn set_scene(&mut self, gpu: &Gpu, scene: &Scene) -> Result<Uploaded> {
        let scene = Arc::new(scene.as_seen());
        let mut uploaded = Uploaded::default();
        self.lights_are_stale = true;
        if self.scene.triangle_count() != scene.triangle_count() {
            self.refusal = None;
        }
        if self.objects.list.len() == scene.objects.len() {
            let triangles = self.geometry.set_scene(gpu, &scene);
            let mut objects = self.scene.objects.iter().zip(&scene.objects);
            let is_moved = objects.any(|(was, is)| !was.stands_as(is));
            self.chain_scene_is_stale |= is_moved || triangles != Uploaded::default();
            uploaded += triangles;
        } else {
            self.geometry = Geometry::new(gpu, &scene);
            self.chain_scene = None;
        }
        uploaded += self.objects.set_scene(gpu, &scene, &self.geometry);
        self.lamps.set_scene(gpu, &scene);
        self.scene = scene;
        self.drawn_view = None;
        gpu.take_error().map_or(Ok(uploaded), Err)
    }

    /// Replaces all illumination maps; receivers without one are dark. If a map keeps its chart, only tiles that differ
    /// are uploaded.
    ///
    /// # Errors
    /// A map that does not belong to the scene: the old maps stay. An error of the device.
    pub fn set_maps(&mut self, gpu: &Gpu, scene: &Scene, maps: &[IlluminationMap]) -> Result<Uploaded> {
        let shown: Vec<ShownMap> = maps.iter().map(ShownMap::of).collect();
        let mut uploaded = self.objects.set_maps(gpu, scene, &shown)?;
        for map in maps {
            uploaded += self.geometry.set_chart(gpu, &map.chart);
        }
        self.drawn_view = None;
        gpu.take_error().map_or(Ok(uploaded), Err)
    }

    /// Sets what map values mean, from the next frame on.
    pub fn set_map_style(&mut self, style: MapStyle) {
        self.map_style = style;
        self.drawn_view = None;
    }

    /// Limits the memory of illumination maps on the device [bytes], from the next frame on; 1 GiB by default. Maps
    /// beyond the budget lose their finest levels, starting where their detail is least visible.
    pub fn set_map_budget(&mut self, bytes: u64) {
        self.objects.images.set_budget(bytes);
        self.drawn_view = None;
    }

    /// Sets the quality, from the next frame on.
    pub fn set_quality(&mut self, quality: EyeQuality) {
        self.quality = quality.clamped();
        self.drawn_view = None;
    }

    /// Whether direct light is traced from the next frame on, with a shadow ray per light and pixel: it is correct as
    /// soon as a light or an object moves. The maps must then exclude direct light.
    pub fn set_traces_lights(&mut self, traces: bool) {
        self.traces_lights = traces;
        self.drawn_view = None;
    }

    pub fn quality(&self) -> EyeQuality {
        self.quality
    }

    /// Switches chains, from the next frame on. Auto creates what they need when a specular surface comes into view; on
    /// creates at once what any object of the scene could need. Off frees it: mirrors show only their emission, coated
    /// surfaces their diffuse part, and clear bodies are left out.
    ///
    /// # Errors
    /// An error of the device.
    pub fn set_chains(&mut self, gpu: &Gpu, switch: EffectSwitch) -> Result<()> {
        self.chains = switch;
        self.drawn_view = None;
        match switch {
            EffectSwitch::Auto => {}
            EffectSwitch::On => self.make_everything(gpu),
            EffectSwitch::Off => {
                self.surfaces.drop_specular();
                self.chain_scene = None;
                self.traced = None;
            }
        }
        gpu.take_error().map_or(Ok(()), Err)
    }

    /// Switches dispersion in chains, from the next frame on; off, all light is refracted as at 587.56 nm. Auto and on
    /// are equivalent: without dispersive glass there is nothing to prepare.
    pub fn set_dispersion(&mut self, switch: EffectSwitch) {
        self.dispersion = switch;
        self.drawn_view = None;
    }

    /// Multiplies radiance by a matrix of [`WhiteBalance::matrix`](super::WhiteBalance::matrix) before tone mapping,
    /// from the next frame on. Radiance that is read back is not affected.
    pub fn set_white_balance(&mut self, matrix: &Matrix3) {
        self.tone_mapping.set_white_balance(matrix);
    }

    /// Whether mirrors are grey instead of black while chains are switched off, from the next frame on.
    pub fn set_stand_in(&mut self, has_stand_in: bool) {
        if self.has_stand_in != has_stand_in {
            self.has_stand_in = has_stand_in;
            self.drawn_view = None;
        }
    }

    /// Why mirrors and glass are drawn without reflections and refractions although these were requested: the scene
    /// exceeds the device's limits.
    pub fn chain_refusal(&self) -> Option<&Error> {
        self.refusal.as_ref()
    }

    /// Counts of resources, and figures of the last frame.
    pub fn counts(&self) -> EyeCounts {
        let traced_pixels = self
            .traced
            .as_ref()
            .filter(|_| self.drawn[1] > 0)
            .map(|traced| traced.size.map(u64::from).iter().product());
        let timed = self.timing.as_ref().and_then(Timing::latest);
        EyeCounts {
            pipelines: (self.surfaces.count() + self.tone_mapping.count()) as u64,
            specular_pipelines: self.surfaces.specular_count() as u64,
            sky_bytes: self.sky.as_ref().map_or(0, Sky::bytes),
            chain_bytes: self.chain_scene.as_ref().map_or(0, ChainScene::bytes),
            map_bytes: self.objects.images.map_bytes(),
            coarse_maps: self.objects.images.coarse_maps(),
            drawn_objects: self.drawn[0] as u64,
            drawn_specular: self.drawn[1] as u64,
            traced_pixels: traced_pixels.unwrap_or(0),
            samples: self.mean.as_ref().map_or(1, |mean| mean.count().max(1)),
            timed,
        }
    }

    /// Collects GPU times that have arrived, without waiting. Returns whether any have; [`counts`](Self::counts) then
    /// reports them. [`draw`](Self::draw) does this too, for the frames before its own.
    pub fn collect_times(&mut self, gpu: &Gpu) -> bool {
        self.timing.as_mut().is_some_and(|timing| timing.collect(gpu))
    }

    /// Whether GPU times of a frame are still pending.
    pub fn awaits_times(&self) -> bool {
        self.timing.as_ref().is_some_and(Timing::is_waiting)
    }

    /// Draws a frame into `target`, which has the size of `view` and the format given to [`new`](Self::new). Draws
    /// nothing for a size of 0, which a minimised window has.
    ///
    /// # Errors
    /// A frame larger than the device's textures.
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
        if let Some(mean) = &mut self.mean {
            mean.clear();
        }
        self.draw_radiance(gpu, encoder, view, exposure(view), Sample::CENTRE)?;
        if let Some(targets) = &self.targets {
            let marks = self
                .timing
                .as_ref()
                .map(|timing| timing.marks(timing::TONE_MAPPING));
            let exposed = Exposed {
                radiance: &targets.resolved_view,
                gain_stops: 0.0,
                tone_map: view.tone_map,
            };
            self.tone_mapping.draw(gpu, encoder, target, &exposed, marks);
        }
        let has_specular = self.drawn[1] > 0;
        if let Some(timing) = &mut self.timing {
            timing.finish(gpu, encoder, (has_specular, true), (self.quality, view.width));
        }
        self.drawn_view = Some(view.clone());
        Ok(())
    }

    /// Shows the last frame, or the mean of its view, under the exposure and the tone map of `view`, without drawing it
    /// anew. Returns false, and does nothing, if that frame is another view or its exposure too different.
    pub fn expose(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        view: &View,
    ) -> bool {
        let (Some(drawn), Some(targets)) = (self.drawn_as(view), &self.targets) else {
            return false;
        };
        let mean = self.mean.as_ref().filter(|mean| mean.count() > 0);
        let exposed = Exposed {
            radiance: mean.map_or(&targets.resolved_view, |mean| mean.picture().1),
            gain_stops: view.exposure_stops - drawn.exposure_stops,
            tone_map: view.tone_map,
        };
        self.tone_mapping.draw(gpu, encoder, target, &exposed, None);
        true
    }

    /// The view of the last frame, if that is `view` but for exposure and tone map.
    fn drawn_as(&self, view: &View) -> Option<&View> {
        let drawn = self.drawn_view.as_ref()?;
        let under_same = View {
            exposure_stops: drawn.exposure_stops,
            tone_map: drawn.tone_map,
            ..view.clone()
        };
        let gain_stops = view.exposure_stops - drawn.exposure_stops;
        (under_same == *drawn && gain_stops.abs() <= MAX_GAIN_STOPS).then_some(drawn)
    }

    /// Refines the last frame: draws the view again with a subpixel offset and shows the mean of all its frames. If
    /// another view was drawn last, draws this one for the first time.
    ///
    /// # Errors
    /// A frame larger than the device's textures.
    pub fn refine(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        view: &View,
    ) -> Result<()> {
        let Some(drawn) = self.drawn_as(view).cloned() else {
            return self.draw(gpu, encoder, target, view);
        };
        let mut mean = Mean::of_size(self.mean.take(), gpu, [view.width, view.height]);
        if mean.count() == 0
            && let Some(targets) = &self.targets
        {
            mean.add(gpu, encoder, &targets.resolved_view);
        }
        let sample = Sample::of_sequence(mean.count());
        self.draw_radiance(gpu, encoder, &drawn, exposure(&drawn), sample)?;
        if let Some(targets) = &self.targets {
            mean.add(gpu, encoder, &targets.resolved_view);
        }
        self.mean = Some(mean);
        self.drawn_view = Some(drawn);
        self.expose(gpu, encoder, target, view);
        Ok(())
    }

    /// Whether an environment is visible behind the surfaces.
    fn shows_sky(&self) -> bool {
        self.map_style == MapStyle::Lit && self.scene.environment.is_some()
    }

    fn draw_state(&self) -> DrawState {
        DrawState {
            style: self.map_style,
            has_chains: self.chains != EffectSwitch::Off && self.refusal.is_none(),
            flags: PipelineFlags {
                has_texture: self.objects.has_tinted_glass(),
                is_scaled: self.quality.traced_scale != 1.0,
                traces_lights: self.traces_lights
                    && self.map_style == MapStyle::Lit
                    && self.refusal.is_none(),
                has_bumps: self.objects.list.iter().any(|look| look.has_bumps),
                has_sky: self.shows_sky(),
                is_dispersive: self.dispersion != EffectSwitch::Off && !self.objects.glasses.is_empty(),
                has_lobes: (0..self.scene.objects.len())
                    .map(|object| self.scene.material_of(object))
                    .any(|material| material.is_rough() && material.is_specular()),
                has_mask: self.objects.list.iter().any(Appearance::has_mask),
                is_logarithmic: self.map_style.is_logarithmic(),
            },
        }
    }
}

/// Radiance is stored exposed, which puts what is displayed into the range of half floats.
fn exposure(view: &View) -> f64 {
    view.exposure_stops.exp2()
}
