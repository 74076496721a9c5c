//! The picture beside the panel: what it shows, at which quality, and the status text about it.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::json;

use super::{App, BesideShown, MAX_REPORTS, MapsOnDevice};
use crate::effect::{Effect, EffectSwitch};
use crate::error::Result;
use crate::eye_pass::renderer::{EyeQuality, GpuMs, Renderer, Uploaded};
use crate::eye_pass::{ToneMap, View, WhiteBalance};
use crate::gpu::Gpu;
use crate::optics::LinearSrgb;
use crate::optics::spectrum::xyz::Matrix3;
use crate::plan;
use crate::scene::Scene;
use crate::viewer::background::{Background, Wake};
use crate::viewer::graphics::{FORMAT, RenderOptions, SAMPLES, texture};
use crate::viewer::panel::{Display, Quantity};
use crate::viewer::timing::FrameStats;

impl App {
    /// Uploads what has changed and draws the picture if its view, maps or quality changed.
    pub(super) fn draw_picture(&mut self) -> Result<()> {
        // Shaders for mirrors and glass take seconds to compile; a thread does it, and until then the picture has none.
        let Some(mut view) = self.view() else {
            return Ok(());
        };
        let wanted = self.chains_switch();
        let chains = self.warm_up.switch(wanted);
        let white_balance = self.white_balance();
        let Some(graphics) = &mut self.graphics else {
            return Ok(());
        };

        // On a software rasterizer, shadow rays take longer than the next bake.
        let traces_lights = self.model.traces_lights() && !graphics.gpu.is_software();
        let wanted_maps = MapsOnDevice {
            shown: self.shown,
            traces_lights,
        };
        let before = self.on_device;
        if before.is_some_and(|before| before.traces_lights) != traces_lights {
            graphics.main.set_traces_lights(traces_lights);
        }

        // The scene precedes its maps: surfaces may have become receivers, and their maps are set again.
        let start = Instant::now();
        let mut uploaded = graphics.main.set_scene(&graphics.gpu, self.model.scene())?;
        let mut is_new = uploaded != Uploaded::default();
        let has_new_maps = before != Some(wanted_maps);
        self.on_device = Some(wanted_maps);
        if has_new_maps || is_new {
            let (maps, style) = self.model.maps_to_show(traces_lights);
            uploaded += graphics.main.set_maps(&graphics.gpu, &maps, style)?;
            is_new = true;
        } else {
            graphics.main.set_style(self.model.map_style());
        }

        // The log tells what it cost to show an edit or new maps.
        if is_new {
            let seconds = start.elapsed().as_secs_f64();
            self.model.log.write(
                "upload",
                json!({
                    "tiles": uploaded.tiles,
                    "tile_bytes": uploaded.tile_bytes,
                    "other_bytes": uploaded.other_bytes,
                    "upload_s": seconds,
                }),
            );
        }

        // The right part of a comparison shows the same quantity; its maps are uploaded only if something changed.
        let style = self.model.map_style();
        let reference = self.model.reference.as_ref();
        let beside = reference.map(|reference| (Arc::clone(&reference.maps), style));
        let is_same = |a: &BesideShown, b: &BesideShown| Arc::ptr_eq(&a.0, &b.0) && a.1 == b.1;
        let is_as_before = match (&self.beside, &beside) {
            (Some(before), Some(now)) => is_same(before, now) && !is_new,
            (before, now) => before.is_none() && now.is_none(),
        };
        self.beside = beside;
        if !is_as_before {
            let shown = self.model.reference_to_show();
            let shown = shown.as_ref().map(|(scene, maps)| (*scene, &maps[..], style));
            graphics.set_beside(shown)?;
        }

        // While shaders are compiled, grey mirrors stand in: black ones would look broken.
        let is_compiling = wanted != EffectSwitch::Off && chains == EffectSwitch::Off;
        graphics
            .main
            .renderer
            .set_stand_in(is_compiling && !self.model.maps().is_empty());
        let options = RenderOptions {
            chains,
            dispersion: self.model.choices.settings.effects.get(Effect::Dispersion),
            white_balance,
        };
        graphics.main.set_options(&graphics.gpu, options)?;

        // Must come before `expose` and drawing, which would collect the times without reporting them.
        if let Some(frame) = graphics.take_times() {
            self.pace.learn(&frame, view.width);
            self.tell_time(frame.ms);
        }

        // A measured exposure changes the view, and with it whether the picture shows it already.
        self.expose(&mut view, has_new_maps)?;
        let Some(graphics) = &mut self.graphics else {
            return Ok(());
        };

        // Once there is light, compilation begins, in the quality that a moving camera needs. A software rasterizer
        // compiles on the cores that bake, so that it comes after the first caustics unless these take long.
        if !self.model.maps().is_empty() {
            let is_first_look =
                self.model.state.is_working() && self.model.last.as_ref().is_some_and(|last| last.level == 1);
            let may_wait = graphics.gpu.is_software() && is_first_look;
            let quality = self.pace.walking().eye;
            self.warm_up.begin(self.model.scene(), (&view, quality), may_wait);
        }

        // A view that is shown already is refined; any other one is drawn at the quality that keeps the frame rate.
        if graphics.shows(&view) {
            return self.refine_picture(&view);
        }
        self.pace.moves();
        self.is_refining = true;
        let is_still = !self.model.is_moving() && self.pace.pause(Instant::now()).is_zero();
        let quality = if is_still && self.model.state.is_working() {
            self.pace.waiting()
        } else {
            self.pace.walking()
        };
        if graphics.draw_picture(&view, quality)? {
            self.pictures += 1;
            self.reports_due = MAX_REPORTS;
        }
        Ok(())
    }

    /// Refines the picture while the camera rests; while a bake runs, only if it is coarser than it has to be.
    pub(super) fn refine_picture(&mut self, view: &View) -> Result<()> {
        let is_moving = self.model.navigator.is_moving();
        let Some(graphics) = self.graphics.as_mut().filter(|_| !is_moving) else {
            self.is_refining = false;
            return Ok(());
        };
        let now = Instant::now();
        let is_paused = !self.pace.pause(now).is_zero();
        let shown = graphics.main.quality();
        let (wanted, is_wanting) = if self.model.state.is_working() {
            let waiting = self.pace.waiting();
            (waiting, shown.scale < waiting.scale)
        } else {
            let resting = self.pace.resting();
            let samples = if shown == resting {
                graphics.main.renderer.counts().samples
            } else {
                0
            };
            (resting, is_paused || self.pace.refines(samples, now))
        };
        self.is_refining = is_wanting;
        if is_wanting && !is_paused {
            graphics.refine_picture(view, wanted)?;
        }
        Ok(())
    }

    /// Measures and adjusts the exposure. The maps of the first bake may change it until the user does.
    fn expose(&mut self, view: &mut View, has_new_maps: bool) -> Result<()> {
        let (model, mut shown) = (&mut self.model, view.exposure_stops);
        let since = std::mem::replace(&mut self.exposed, Instant::now()).elapsed();
        if model.quantity() != Quantity::Light || model.maps().is_empty() {
            return Ok(());
        }
        let is_first = model.last.as_ref().is_some_and(|last| model.is_first(last));
        if self.exposure.wants(has_new_maps && is_first, shown)
            && let Some(graphics) = &mut self.graphics
        {
            let stops = graphics.measure_exposure(view)?;
            shown = self.exposure.take(stops, shown);
            let goal = self.exposure.goal();
            model
                .log
                .write("exposure", json!({"stops": stops, "exposure_stops": goal}));
        }
        view.exposure_stops = self.exposure.next(shown, since);
        model.choices.display.exposure_stops = view.exposure_stops;
        Ok(())
    }

    pub(super) fn is_exposing(&self) -> bool {
        self.exposure.is_moving(self.model.choices.display.exposure_stops)
    }

    /// The view that the picture is to show; `None` while the picture has no area.
    pub(super) fn view(&self) -> Option<View> {
        let graphics = self.graphics.as_ref()?;
        let scale = graphics.window().scale_factor() as f32;
        let pixels = |points: f32| (points * scale).round();
        let size = self.picture_rect.size();
        let (width, height) = (pixels(size.x), pixels(size.y));
        let display = match self.model.quantity() {
            Quantity::Light => self.model.choices.display,
            // False colours must be shown unchanged to match their legend.
            _ => Display {
                exposure_stops: 0.0,
                tone_map: ToneMap::None,
                ..self.model.choices.display
            },
        };
        (width >= 1.0 && height >= 1.0).then(|| View {
            camera: self.model.navigator.camera_for(f64::from(width / height)),
            width: width as u32,
            height: height as u32,
            exposure_stops: display.exposure_stops,
            tone_map: display.tone_map,
            background: LinearSrgb::BLACK,
        })
    }

    /// Reports whether chains are drawn, and collects GPU times.
    pub(super) fn report_chains(&mut self) {
        let (Some(view), switch) = (self.view(), self.chains_switch()) else {
            return;
        };
        let Some(graphics) = &mut self.graphics else {
            return;
        };
        let times = graphics.take_times();
        let is_complete = !graphics.main.renderer.awaits_times();
        if let Some(frame) = times {
            self.tell_time(frame.ms);
        }
        let aspect = f64::from(view.width) / f64::from(view.height);
        let chains = plan::chains(self.model.scene(), Some((&view.camera, aspect)), switch);
        self.model.picture.chains = Some(chains);
        self.reports_due = if is_complete {
            0
        } else {
            self.reports_due.saturating_sub(1)
        };
    }

    /// Reports how the picture was rendered, and tells the user once if chains are not available.
    pub(super) fn report_making(&mut self) {
        let Some(graphics) = &self.graphics else { return };
        let (counts, quality) = (graphics.main.renderer.counts(), graphics.main.quality());
        if let Some(times) = &mut self.model.picture.frame_times {
            times.made = Some(FrameStats {
                traced_scale: (counts.drawn_specular > 0).then_some(quality.scale * quality.eye.traced_scale),
                samples: counts.samples,
            });
        }
        let refusal = graphics.main.renderer.chain_refusal().map(ToString::to_string);
        if refusal.is_some() && refusal != self.shown_refusal {
            self.notice.clone_from(&refusal);
            self.shown_refusal = refusal;
        }
    }

    fn tell_time(&mut self, ms: GpuMs) {
        if let Some(times) = &mut self.model.picture.frame_times {
            times.push(ms);
        }
    }

    /// White balance of the picture; false colours must be shown unchanged to match their legend.
    pub(super) fn white_balance(&self) -> Matrix3 {
        let chosen = match self.model.quantity() {
            Quantity::Light => self.model.choices.display.white_balance,
            _ => WhiteBalance::None,
        };
        chosen.matrix(self.model.scene())
    }

    pub(super) fn chains_switch(&self) -> EffectSwitch {
        self.model.choices.settings.effects.get(Effect::Chains)
    }
}

/// How long a software rasterizer leaves all cores to the first caustics of a scene: the gallery's take two seconds on two
/// cores.
const CAUSTICS_WITHIN: Duration = Duration::from_secs(3);
/// Width of the picture that shaders are compiled with [pixels].
const WARM_UP_WIDTH: u32 = 64;

/// Compiles the shaders for chains on a thread, because that can take seconds if the driver has not cached them. A
/// device of its own draws the view once at a small size, which forces compilation; drivers share their cache between
/// devices. Until then the window draws no chains.
#[derive(Debug)]
pub struct WarmUp {
    work: Background<(), Result<()>>,
    /// When the first lit picture came.
    lit: Option<Instant>,
    is_done: bool,
}

impl WarmUp {
    /// Nothing is compiled yet. `wake` is called when it is.
    pub fn new(wake: &Wake) -> Self {
        Self {
            work: Background::new("shaders", wake),
            lit: None,
            is_done: false,
        }
    }

    /// Starts with the second lit picture, so that the first one does not wait; with `may_wait`, not before
    /// [`CAUSTICS_WITHIN`] of the first.
    pub fn begin(&mut self, scene: &Arc<Scene>, (view, quality): (&View, EyeQuality), may_wait: bool) {
        let Some(lit) = self.lit else {
            self.lit = Some(Instant::now());
            return;
        };
        let waits = may_wait && lit.elapsed() < CAUSTICS_WITHIN;
        if waits || self.is_done || self.is_coming() {
            return;
        }
        let scene = Arc::clone(scene);
        let view = View {
            width: WARM_UP_WIDTH,
            height: (WARM_UP_WIDTH * view.height).div_ceil(view.width),
            ..view.clone()
        };
        let started = self.work.start((), move |_| draw_once(&scene, &view, quality));
        self.is_done = started.is_err();
    }

    pub fn is_coming(&self) -> bool {
        self.work.of().is_some()
    }

    /// The switch for chains to use now if `wanted` is set: off until the shaders are compiled.
    pub fn switch(&mut self, wanted: EffectSwitch) -> EffectSwitch {
        if let Some((_, outcome)) = self.work.take() {
            self.is_done = true;
            if let Some(Err(error)) = outcome {
                log::warn!("shaders could not be compiled beside the window: {error}");
            }
        }
        if self.is_done { wanted } else { EffectSwitch::Off }
    }
}

fn draw_once(scene: &Scene, view: &View, quality: EyeQuality) -> Result<()> {
    let gpu = Gpu::headless()?;
    let mut renderer = Renderer::new(&gpu, scene, FORMAT, SAMPLES)?;
    renderer.set_quality(quality);
    let target = texture(&gpu.device, [view.width, view.height]);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    renderer.draw(&gpu, &mut encoder, &target, view)?;
    gpu.queue.submit([encoder.finish()]);
    gpu.wait()
}
