//! The window's life: events in, frames out, and rest while nothing changes.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui_winit::accesskit_winit;
use glam::DVec2;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalPosition;
use winit::event::{
    DeviceEvent, DeviceId, ElementState, KeyEvent, MouseButton, MouseScrollDelta, StartCause, WindowEvent,
};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoopProxy};
use winit::keyboard::{ModifiersState, PhysicalKey};
use winit::window::{CursorGrabMode, WindowId};

use super::event_log::Event;
use super::frame_times::{FrameTimes, Made, sum_ms};
use super::graphics::{Graphics, RETRY_AFTER, Shown};
use super::input::{self, Shortcut};
use super::interface::Painting;
use super::model::Model;
use super::overlay;
use super::pace::Pace;
use super::panel::{Display, Facts, Quantity, Wishes};
use super::{ViewerOptions, error_view, eye_report, screenshot};
use crate::effect::{Effect, EffectSwitch};
use crate::error::{Error, Result};
use crate::eye_pass::renderer::{MapStyle, Uploaded};
use crate::eye_pass::{ToneMap, View};
use crate::optics::LinearSrgb;
use crate::progress::Control;
use crate::session::EffectReport;

/// What other threads tell the window.
#[derive(Debug)]
pub enum News {
    /// The baking thread moved on.
    Baker,
    /// Assistive technology asks for something.
    Accessibility(accesskit_winit::Event),
}

impl From<accesskit_winit::Event> for News {
    fn from(event: accesskit_winit::Event) -> Self {
        Self::Accessibility(event)
    }
}

/// A scroll of this many pixels counts as one notch of the wheel.
const PIXELS_PER_NOTCH: f64 = 40.0;
/// How often a window at rest looks whether it was asked to stop.
const LOOK_FOR_STOP: Duration = Duration::from_millis(200);
/// Time between frames that only show how a bake gets on.
const BAKING_FRAME: Duration = Duration::from_millis(100);
/// Time between a picture and the frame that tells what it took.
const REPORT_AFTER: Duration = Duration::from_millis(40);
/// A device that has not told in so many frames how long a picture took is not asked again until the next one.
const MOST_REPORTS: u32 = 25;
/// Longest time that one frame flies: after a stall the camera is not thrown through the scene.
const LONGEST_STEP: Duration = Duration::from_millis(500);
/// A device that was lost this often within [`LOSSES_WITHIN`] is given up.
const MOST_LOSSES: usize = 3;
const LOSSES_WITHIN: Duration = Duration::from_secs(60);
/// Radiance behind the scene [W/(m² sr)]: dark.
const BACKGROUND: LinearSrgb = LinearSrgb::BLACK;

/// The whole program behind one window.
pub struct App {
    model: Model,
    graphics: Option<Graphics>,
    proxy: EventLoopProxy<News>,
    stop: Option<Arc<Control>>,
    /// Inner size of the window to be opened [logical pixels].
    size: (u32, u32),
    /// Where the picture lies in the window [points].
    picture_rect: egui::Rect,
    /// Where the mouse was when it took the gaze [pixels].
    looking_from: Option<PhysicalPosition<f64>>,
    pointer: PhysicalPosition<f64>,
    /// Until when the camera has moved.
    moved_until: Instant,
    /// When the next frame is due though nothing happens.
    wake_at: Option<Instant>,
    must_measure_exposure: bool,
    /// The exposure that was measured last [stops], and how many layers the maps had then.
    measured: Option<(f64, usize)>,
    must_set_maps: bool,
    /// Whether direct light is traced, and not in the maps on the device.
    traces_lights: bool,
    pressed: Wishes,
    losses: Vec<Instant>,
    /// Chooses how well pictures are made.
    pace: Pace,
    /// Whether the picture is still to become better though nothing changes.
    is_refining: bool,
    /// Why there are no chains, as it was told.
    told_refusal: Option<String>,
    pictures: u64,
    frames: u64,
    /// Pictures at the last line of the log that told of rest.
    rested_at: u64,
    /// The eye's chains in the picture that is shown.
    chains: Option<EffectReport>,
    frame_times: FrameTimes,
    /// Frames that may still come only to tell what the last picture took.
    reports_due: u32,
    /// Told over the picture until the next key press.
    notice: Option<String>,
    /// Held now: Ctrl, Shift and the like.
    modifiers: ModifiersState,
    failure: Option<Error>,
}

impl App {
    /// Starts baking; the window comes with the first event.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn new(options: &ViewerOptions, proxy: EventLoopProxy<News>) -> Result<Self> {
        let of_baker = proxy.clone();
        let wake = move || {
            // Fails only when the window is gone, and then nobody waits for it.
            let _ = of_baker.send_event(News::Baker);
        };
        Ok(Self {
            model: Model::new(options, wake)?,
            graphics: None,
            proxy,
            stop: options.stop.clone(),
            size: options.size,
            picture_rect: egui::Rect::NOTHING,
            looking_from: None,
            pointer: PhysicalPosition::default(),
            moved_until: Instant::now(),
            wake_at: None,
            must_measure_exposure: options.exposure_stops.is_none(),
            measured: None,
            must_set_maps: true,
            traces_lights: false,
            pressed: Wishes::default(),
            losses: Vec::new(),
            pace: Pace::default(),
            is_refining: false,
            told_refusal: None,
            pictures: 0,
            frames: 0,
            rested_at: 0,
            chains: None,
            frame_times: FrameTimes::default(),
            reports_due: 0,
            notice: None,
            modifiers: ModifiersState::empty(),
            failure: None,
        })
    }

    /// What ended the window, if it was not the user.
    pub fn failure(self) -> Option<Error> {
        self.failure
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) {
        match Graphics::new(event_loop, self.proxy.clone(), self.model.scene(), self.size) {
            Ok(graphics) => {
                let adapter = graphics.gpu().adapter_name();
                let scene = Arc::clone(self.model.scene());
                self.model.log.write(&Event::Started {
                    scene: &scene.name,
                    adapter: &adapter,
                });
                graphics.window().request_redraw();
                self.pace = if graphics.gpu().is_software() {
                    Pace::of_software()
                } else {
                    Pace::default()
                };
                self.graphics = Some(graphics);
                self.traces_lights = false;
                self.must_set_maps = true;
            }
            Err(error) => self.fail(event_loop, error),
        }
    }

    fn close(&mut self, event_loop: &ActiveEventLoop) {
        self.model.log.write(&Event::Closing);
        event_loop.exit();
    }

    fn fail(&mut self, event_loop: &ActiveEventLoop, error: Error) {
        self.failure = Some(error);
        event_loop.exit();
    }

    /// Throws window and device away and makes them anew, unless that was tried too often.
    fn recover(&mut self, event_loop: &ActiveEventLoop) {
        let reason = self
            .graphics
            .as_ref()
            .and_then(|graphics| graphics.gpu().take_error())
            .unwrap_or_else(|| {
                Error::failure(
                    "window",
                    "its surface was lost",
                    "update the graphics driver, or use `render`",
                )
            });
        self.model.log.write(&Event::DeviceLost(&reason.to_string()));
        log::warn!("{reason}");
        if let Some(graphics) = self.graphics.take() {
            let window = graphics.window();
            let size = window.inner_size().to_logical(window.scale_factor());
            self.size = (size.width, size.height);
        }
        self.stop_looking();
        self.model.navigator.stop();
        let now = Instant::now();
        self.losses
            .retain(|loss| now.duration_since(*loss) < LOSSES_WITHIN);
        self.losses.push(now);
        if self.losses.len() > MOST_LOSSES {
            self.fail(event_loop, reason);
            return;
        }
        self.open(event_loop);
        if self.graphics.is_some() {
            self.notice = Some(format!("The graphics device was lost and came back: {reason}"));
            self.model.log.write(&Event::DeviceRecovered);
        }
    }

    fn request_redraw(&self) {
        if let Some(graphics) = &self.graphics {
            graphics.window().request_redraw();
        }
    }

    /// Flies up to now: called before keys change and before each frame.
    fn fly(&mut self) {
        let now = Instant::now();
        let step = now.duration_since(self.moved_until).min(LONGEST_STEP);
        if self.model.navigator.is_moving() {
            self.model.navigator.advance(step.as_secs_f64());
        }
        self.moved_until = now;
    }

    /// One frame.
    fn redraw(&mut self, event_loop: &ActiveEventLoop) {
        self.fly();
        let quantity = self.model.quantity();
        self.must_set_maps |= self.model.poll();
        self.report_chains();
        let layer = self.model.panel.display.layer;
        let mut wishes = std::mem::take(&mut self.pressed);
        let Some(mut painting) = self.run_interface(&mut wishes) else {
            return;
        };
        self.model.act(&wishes, Instant::now());
        self.must_set_maps |= layer != self.model.panel.display.layer;
        if quantity != self.model.quantity() {
            self.must_set_maps = true;
            self.model.log.write(&Event::Shows(self.model.quantity().name()));
        }
        self.must_measure_exposure |= wishes.measure_exposure;
        if let Err(error) = self.draw_picture() {
            self.notice = Some(error.to_string());
        }
        self.report_making();
        let Some(graphics) = &mut self.graphics else {
            return;
        };
        let shown = graphics.show(&mut painting);
        // What breaks the window is told when it is mended.
        if shown != Shown::Broken
            && let Some(error) = graphics.gpu().take_error()
        {
            self.notice = Some(error.to_string());
        }
        if wishes.save_picture {
            self.save_picture();
        }
        self.schedule(event_loop, shown, painting.repaint_after);
    }

    /// Writes the picture to files in the working folder, and tells where over the picture.
    fn save_picture(&mut self) {
        let outcome = self.written_picture();
        let notice = match &outcome {
            Ok(files) => {
                self.model.log.write(&Event::Saved(files));
                screenshot::told(files)
            }
            Err(error) => {
                let sentence = error.to_string();
                self.model.log.write(&Event::NotSaved(&sentence));
                sentence
            }
        };
        self.notice = Some(notice);
        self.request_redraw();
    }

    fn written_picture(&mut self) -> Result<Vec<PathBuf>> {
        let (Some(view), Some(graphics)) = (self.view(), &mut self.graphics) else {
            return Err(Error::failure(
                "picture",
                "the window has no room for it",
                "make the window larger",
            ));
        };
        let picture = graphics.radiance(&view)?;
        // Said in full where the system knows it: the window does not show where it was started.
        let folder = std::env::current_dir().unwrap_or_else(|_| PathBuf::from("."));
        // False colours are no radiance.
        let has_radiance = self.model.quantity() == Quantity::Light;
        screenshot::save(&folder, &self.model.scene().name, &picture, &view, has_radiance)
    }

    /// Looks what the picture that is shown takes.
    fn report_chains(&mut self) {
        let (Some(view), switch) = (self.view(), self.chains_switch()) else {
            return;
        };
        let Some(graphics) = &mut self.graphics else {
            return;
        };
        if let Some(ms) = graphics.take_times() {
            self.frame_times.push(ms);
        }
        let counts = graphics.counts();
        self.chains = Some(eye_report::chains(self.model.scene(), &view, switch, &counts));
        let is_complete = !graphics.awaits_times();
        self.reports_due = if is_complete {
            0
        } else {
            self.reports_due.saturating_sub(1)
        };
    }

    /// Tells the panel how the picture was made, and the user once where chains cannot be had.
    fn report_making(&mut self) {
        let Some(graphics) = &self.graphics else { return };
        let (counts, quality) = (graphics.counts(), graphics.quality());
        self.frame_times.set_made(Made {
            traced_scale: (counts.drawn_specular > 0).then_some(quality.traced_scale),
            samples: counts.samples,
        });
        let refusal = graphics.chain_refusal().map(ToString::to_string);
        if refusal.is_some() && refusal != self.told_refusal {
            self.notice.clone_from(&refusal);
            self.told_refusal = refusal;
        }
    }

    fn chains_switch(&self) -> EffectSwitch {
        self.model.panel.settings.effects.get(Effect::Chains)
    }

    /// Shows panel and picture to egui.
    fn run_interface(&mut self, wishes: &mut Wishes) -> Option<Painting> {
        let Self {
            model,
            graphics,
            picture_rect,
            chains,
            frame_times,
            notice,
            ..
        } = self;
        let graphics = graphics.as_mut()?;
        let (state, layers, adapter) = (
            model.state().clone(),
            model.layers(),
            graphics.gpu().adapter_name(),
        );
        let (window, picture) = (Arc::clone(graphics.window()), graphics.picture_id());
        let tells_times = graphics.tells_times();
        let speed_m_per_s = model.navigator.speed_m_per_s();
        let edits = model.edits();
        let (scene, loaded) = (Arc::clone(edits.scene()), Arc::clone(edits.loaded()));
        let undoable = edits.undoable();
        let (has_errors, quantity) = (error_view::is_available(model.maps()), model.quantity());
        let Model {
            panel,
            last,
            worth,
            refusal,
            ..
        } = model;
        let facts = Facts {
            scene: &scene,
            loaded: &loaded,
            undoable,
            refusal: refusal.as_deref(),
            state: &state,
            last: last.as_deref(),
            worth: worth.as_ref(),
            layers: &layers,
            has_errors,
            chains: chains.as_ref(),
            frame_times: tells_times.then_some(&*frame_times),
            speed_m_per_s,
            adapter: &adapter,
        };
        Some(graphics.interface().run(&window, |ui| {
            *wishes = std::mem::take(wishes).and(panel.show(ui, &facts));
            *picture_rect = overlay::show(ui, picture, &facts, quantity, notice.as_deref());
        }))
    }

    /// Draws what changed of the picture: maps, exposure, view.
    fn draw_picture(&mut self) -> Result<()> {
        let Some(mut view) = self.view() else {
            return Ok(());
        };
        let (wants_exposure, chains) = (self.wants_exposure(), self.chains_switch());
        let Some(graphics) = &mut self.graphics else {
            return Ok(());
        };
        // Played by the processor, shadow rays take longer than the next bake.
        let traces_lights = self.model.traces_lights() && !graphics.gpu().is_software();
        if traces_lights != self.traces_lights {
            self.traces_lights = traces_lights;
            self.must_set_maps = true;
            graphics.set_traces_lights(traces_lights);
        }
        let start = Instant::now();
        let mut uploaded = graphics.set_scene(self.model.scene())?;
        let mut is_new = uploaded != Uploaded::default();
        if std::mem::take(&mut self.must_set_maps) || is_new {
            let style = match self.model.quantity() {
                Quantity::Light => MapStyle::Lit,
                Quantity::Error | Quantity::Difference => MapStyle::AsItIs,
            };
            uploaded += if traces_lights {
                graphics.set_maps(&self.model.maps_without_direct(), style)?
            } else {
                graphics.set_maps(&self.model.shown_maps(), style)?
            };
            is_new = true;
        }
        if is_new {
            let seconds = start.elapsed().as_secs_f64();
            self.model.log.write(&Event::Uploaded { uploaded, seconds });
        }
        graphics.set_chains(chains)?;
        if wants_exposure {
            self.must_measure_exposure = false;
            view.exposure_stops = graphics.measure_exposure(&view)?;
            self.model.panel.display.exposure_stops = view.exposure_stops;
            self.measured = Some((view.exposure_stops, self.model.layers().len()));
            self.model.log.write(&Event::Exposure(view.exposure_stops));
        }
        // Drawing would take them in without a word.
        if let Some(ms) = graphics.take_times() {
            if let Some(quality) = graphics.counts().timed_quality {
                self.pace.learn(ms, quality);
            }
            self.frame_times.push(ms);
        }
        if graphics.shows(&view) {
            return self.refine_picture(&view);
        }
        self.pace.moves();
        self.is_refining = true;
        if graphics.draw_picture(&view, self.pace.walking())? {
            self.pictures += 1;
            self.reports_due = MOST_REPORTS;
        }
        Ok(())
    }

    /// Makes the picture of a view at rest better, as long as nothing else is to be done.
    fn refine_picture(&mut self, view: &View) -> Result<()> {
        let is_busy = self.model.state().is_working() || self.model.navigator.is_moving();
        let Some(graphics) = self.graphics.as_mut().filter(|_| !is_busy) else {
            self.is_refining = false;
            return Ok(());
        };
        let samples = if graphics.quality() == self.pace.resting() {
            graphics.counts().samples
        } else {
            0
        };
        self.is_refining = self.pace.refines(samples, Instant::now());
        if self.is_refining {
            graphics.refine_picture(view, self.pace.resting())?;
        }
        Ok(())
    }

    /// Whether the exposure is to be measured: because it was asked for, or because the first bake has brought a layer
    /// since it was measured and nobody changed it. The very first maps come without direct light, and the exposure
    /// that suits them does not suit the scene.
    fn wants_exposure(&self) -> bool {
        let (model, now_stops) = (&self.model, self.model.panel.display.exposure_stops);
        let is_first = model.last.as_ref().is_some_and(|last| last.serial == 1);
        let is_outdated = self.measured.is_some_and(|(measured_stops, layers)| {
            measured_stops == now_stops && layers < model.layers().len()
        });
        let shows_light = model.quantity() == Quantity::Light && !model.maps().is_empty();
        shows_light && (self.must_measure_exposure || (is_first && is_outdated))
    }

    /// Decides when the next frame comes.
    fn schedule(&mut self, event_loop: &ActiveEventLoop, shown: Shown, repaint_after: Duration) {
        let now = Instant::now();
        let wait = match shown {
            Shown::Broken => {
                self.recover(event_loop);
                return;
            }
            Shown::Hidden => Duration::MAX,
            Shown::Later => RETRY_AFTER,
            Shown::Yes if self.model.navigator.is_moving() || self.is_refining => Duration::ZERO,
            Shown::Yes if self.model.state().is_working() => repaint_after.min(BAKING_FRAME),
            Shown::Yes => repaint_after,
        };
        let is_report_due = self.reports_due > 0 && shown == Shown::Yes;
        let wait = if is_report_due {
            wait.min(REPORT_AFTER)
        } else {
            wait
        };
        self.frames += u64::from(shown == Shown::Yes);
        if wait.is_zero() {
            self.wake_at = None;
            self.request_redraw();
            return;
        }
        self.wake_at = [now.checked_add(wait), self.model.due()]
            .into_iter()
            .flatten()
            .min();
        if self.rested_at != self.pictures && !self.model.state().is_working() && !is_report_due {
            self.rested_at = self.pictures;
            let (pictures, frames) = (self.pictures, self.frames);
            let position = self.model.navigator.camera().position.to_array();
            self.model.log.write(&Event::AtRest {
                pictures,
                frames,
                position,
                device_ms: self.frame_times.newest().copied().map(sum_ms),
            });
        }
    }

    /// What the picture is to show; `None` while it has no area.
    fn view(&self) -> Option<View> {
        let graphics = self.graphics.as_ref()?;
        let scale = graphics.window().scale_factor() as f32;
        let pixels = |points: f32| (points * scale).round();
        let (width, height) = (
            pixels(self.picture_rect.width()),
            pixels(self.picture_rect.height()),
        );
        let display = match self.model.quantity() {
            Quantity::Light => self.model.panel.display,
            // Colours of a legend are shown as they are.
            Quantity::Error | Quantity::Difference => Display {
                exposure_stops: 0.0,
                tone_map: ToneMap::None,
                ..self.model.panel.display
            },
        };
        (width >= 1.0 && height >= 1.0).then(|| View {
            camera: self.model.navigator.camera_for(f64::from(width / height)),
            width: width as u32,
            height: height as u32,
            exposure_stops: display.exposure_stops,
            tone_map: display.tone_map,
            background: BACKGROUND,
        })
    }

    fn on_key(&mut self, event: &KeyEvent) {
        let is_typing = self
            .graphics
            .as_mut()
            .is_some_and(|graphics| graphics.interface().context().text_edit_focused());
        if is_typing && event.state.is_pressed() {
            return;
        }
        self.fly();
        if self.modifiers.control_key() || self.modifiers.super_key() {
            // Nothing flies or bakes by a chord.
            self.pressed.undo |= event.state.is_pressed() && input::is_undo(&event.logical_key);
            if event.state.is_pressed() {
                return;
            }
        }
        if let PhysicalKey::Code(code) = event.physical_key
            && input::hold(&mut self.model.navigator.keys, code, event.state)
        {
            return;
        }
        if event.state.is_pressed() && !event.repeat {
            self.notice = None;
            match input::shortcut(&event.logical_key) {
                Some(Shortcut::NextCamera) => drop(self.model.navigator.next_camera().map(str::to_owned)),
                Some(Shortcut::Frame) => {
                    let aspect = self.picture_rect.aspect_ratio();
                    self.model.navigator.frame(f64::from(aspect));
                }
                Some(Shortcut::Rebake) => self.pressed.rebake = true,
                Some(Shortcut::SavePicture) => self.pressed.save_picture = true,
                Some(Shortcut::Help) => self.model.panel.help_open = !self.model.panel.help_open,
                Some(Shortcut::LetGo) if self.looking_from.is_some() => self.stop_looking(),
                Some(Shortcut::LetGo) => self.pressed.cancel = true,
                None => {}
            }
        }
    }

    fn on_mouse_button(&mut self, button: MouseButton, state: ElementState) {
        if button == MouseButton::Right {
            match state {
                ElementState::Pressed if self.is_over_picture() => self.start_looking(),
                ElementState::Pressed => {}
                ElementState::Released => self.stop_looking(),
            }
        }
    }

    fn on_wheel(&mut self, delta: MouseScrollDelta) {
        if self.is_over_picture() {
            self.model.navigator.wheel(match delta {
                MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
                MouseScrollDelta::PixelDelta(pixels) => pixels.y / PIXELS_PER_NOTCH,
            });
        }
    }

    /// Whether the pointer is on the picture and not on a list or text that lies over it.
    fn is_over_picture(&mut self) -> bool {
        let Some(graphics) = &mut self.graphics else {
            return false;
        };
        let scale = graphics.window().scale_factor();
        let pointer: PhysicalPosition<f64> = self.pointer;
        let points = egui::pos2((pointer.x / scale) as f32, (pointer.y / scale) as f32);
        let is_background = |layer: egui::LayerId| layer.order == egui::Order::Background;
        let layer = graphics.interface().context().layer_id_at(points);
        self.picture_rect.contains(points) && layer.is_none_or(is_background)
    }

    fn start_looking(&mut self) {
        self.looking_from = Some(self.pointer);
        if let Some(graphics) = &self.graphics {
            let window = graphics.window();
            // Where neither is to be had, the movements still come; the pointer just leaves the window.
            let _ = window
                .set_cursor_grab(CursorGrabMode::Locked)
                .or_else(|_| window.set_cursor_grab(CursorGrabMode::Confined));
            window.set_cursor_visible(false);
        }
    }

    fn stop_looking(&mut self) {
        if let Some(from) = self.looking_from.take()
            && let Some(graphics) = &self.graphics
        {
            let window = graphics.window();
            // A convenience, which not every system offers: the pointer comes back to where it was.
            let _ = window.set_cursor_position(from);
            let _ = window.set_cursor_grab(CursorGrabMode::None);
            window.set_cursor_visible(true);
        }
    }
}

impl ApplicationHandler<News> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.graphics.is_none() {
            self.open(event_loop);
        }
    }

    fn new_events(&mut self, event_loop: &ActiveEventLoop, _: StartCause) {
        if self.stop.as_ref().is_some_and(|stop| stop.is_cancelled()) {
            self.close(event_loop);
        } else if self.wake_at.is_some_and(|due| Instant::now() >= due) {
            self.wake_at = None;
            self.request_redraw();
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, news: News) {
        if let (News::Accessibility(event), Some(graphics)) = (news, &mut self.graphics)
            && event.window_id == graphics.window().id()
        {
            graphics.interface().on_accessibility(event.window_event);
        }
        self.request_redraw();
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, id: WindowId, event: WindowEvent) {
        let Some(graphics) = &mut self.graphics else {
            return;
        };
        let window = Arc::clone(graphics.window());
        if window.id() != id {
            return;
        }
        // Egui counts each frame as one that needs another; the schedule knows better.
        if graphics.interface().on_event(&window, &event) && event != WindowEvent::RedrawRequested {
            window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => self.close(event_loop),
            WindowEvent::RedrawRequested => self.redraw(event_loop),
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => {
                graphics.resize();
                window.request_redraw();
            }
            WindowEvent::Occluded(false) => window.request_redraw(),
            WindowEvent::Focused(false) => {
                self.stop_looking();
                self.model.navigator.stop();
            }
            WindowEvent::CursorMoved { position, .. } => self.pointer = position,
            WindowEvent::MouseInput { button, state, .. } => self.on_mouse_button(button, state),
            WindowEvent::MouseWheel { delta, .. } => self.on_wheel(delta),
            WindowEvent::ModifiersChanged(modifiers) => self.modifiers = modifiers.state(),
            WindowEvent::KeyboardInput { event, .. } => self.on_key(&event),
            _ => {}
        }
    }

    fn device_event(&mut self, _: &ActiveEventLoop, _: DeviceId, event: DeviceEvent) {
        if let DeviceEvent::MouseMotion { delta: (x, y) } = event
            && self.looking_from.is_some()
        {
            self.model.navigator.look(DVec2::new(x, y));
            self.request_redraw();
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let look = self.stop.as_ref().map(|_| Instant::now() + LOOK_FOR_STOP);
        let until = [self.wake_at, look].into_iter().flatten().min();
        event_loop.set_control_flow(until.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }
}
