//! The event loop of the window: events in, frames out, idle while nothing changes.

mod drawing;
mod files;
mod input;

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec2;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalPosition;
use winit::event::{DeviceEvent, DeviceId, StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoopProxy};
use winit::keyboard::ModifiersState;
use winit::window::WindowId;

use self::drawing::WarmUp;
use super::background::Wake;
use super::command::Command;
use super::exposure::AutoExposure;
use super::files::{Choice, Dialog};
use super::gizmo::Gizmo;
use super::graphics::{FrameOutcome, Graphics, RETRY_AFTER};
use super::interface::{Painting, accessibility};
use super::lens::Viewport;
use super::model::{MapsShown, Model};
use super::overlay;
use super::pace::Pace;
use super::panel::Panel;
use super::timing::FrameTimes;
use super::{ViewerOptions, comparison_view, probe, sketching};
use crate::error::{Error, Result};
use crate::eye_pass::renderer::{GpuMs, MapStyle};
use crate::illumination::IlluminationMap;
use crate::progress::Control;
use serde_json::{Value, json};

/// Messages from other threads.
#[derive(Debug)]
pub enum UserEvent {
    /// News from a background thread.
    Baker,
    Accessibility(accessibility::Event),
}

impl From<accessibility::Event> for UserEvent {
    fn from(event: accessibility::Event) -> Self {
        Self::Accessibility(event)
    }
}

/// Scrolling by this many pixels counts as one wheel notch.
const PIXELS_PER_NOTCH: f64 = 40.0;
/// Interval at which an idle window checks whether it was asked to stop.
const STOP_POLL_INTERVAL: Duration = Duration::from_millis(100);
/// Interval between frames that only show the progress of a bake. It is longer on a software rasterizer, which takes
/// CPU time from the bake.
const BAKING_FRAME: Duration = Duration::from_millis(100);
const BAKING_FRAME_OF_SOFTWARE: Duration = Duration::from_millis(500);
/// On a software rasterizer, a bake pauses for this time after each frame of a moving camera.
const BAKE_WAITS: Duration = Duration::from_millis(500);
/// On a software rasterizer, the time between two levels of a bake that are handed out.
const LEVEL_OF_SOFTWARE: Duration = Duration::from_secs(3);
/// Delay between a picture and the frame that reports its GPU time.
const REPORT_AFTER: Duration = Duration::from_millis(40);
/// Limit of the frames that wait for the GPU time of one picture.
const MAX_REPORTS: u32 = 25;
/// Upper limit of the camera's time step: a stall must not throw the camera through the scene.
const LONGEST_STEP: Duration = Duration::from_millis(500);
/// After more than this many device losses within [`LOSSES_WITHIN`] the window gives up.
const MAX_LOSSES: usize = 3;
const LOSSES_WITHIN: Duration = Duration::from_secs(60);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct MapsOnDevice {
    shown: MapsShown,
    /// Whether direct light is traced per pixel and left out of the maps.
    traces_lights: bool,
}

/// The maps of the comparison's right part, and their display.
type BesideShown = (Arc<[IlluminationMap]>, MapStyle);

/// The application: model, panel and window.
pub struct App {
    model: Model,
    panel: Panel,
    graphics: Option<Graphics>,
    proxy: EventLoopProxy<UserEvent>,
    stop: Option<Arc<Control>>,
    /// Initial inner size of the window [logical pixels].
    size: (u32, u32),
    /// Rectangle of the picture in the window [points].
    picture_rect: egui::Rect,
    /// Position of the pointer when it began to turn the camera [pixels]; `None` if it does not.
    looking_from: Option<PhysicalPosition<f64>>,
    pointer: PhysicalPosition<f64>,
    gizmo: Gizmo,
    /// Where the left button was pressed on the picture, until the press becomes a drag [pixels].
    clicks_at: Option<PhysicalPosition<f64>>,
    /// Time up to which the camera has been advanced.
    moved_until: Instant,
    /// When the next frame is due without any event.
    wake_at: Option<Instant>,
    /// Compiles the shaders for chains in advance.
    warm_up: WarmUp,
    exposure: AutoExposure,
    /// When the exposure was last updated.
    exposed: Instant,
    /// The maps shown in the last frame.
    shown: MapsShown,
    /// The maps on the device; `None` if everything has to be uploaded.
    on_device: Option<MapsOnDevice>,
    beside: Option<BesideShown>,
    /// Position of the divider between the two parts of a comparison, as a fraction of the picture's width.
    divider: f32,
    /// Commands by keys since the last frame.
    pressed: Vec<Command>,
    losses: Vec<Instant>,
    pace: Pace,
    /// Whether the picture is still being refined although nothing changes.
    is_refining: bool,
    /// Last reason for missing chains that was shown to the user.
    shown_refusal: Option<String>,
    pictures: u64,
    frames: u64,
    /// Number of pictures when the log last reported an idle window.
    rested_at: u64,
    /// Number of further frames that may be drawn only to report the GPU time of the last picture.
    reports_due: u32,
    /// Message over the picture until the next key press.
    notice: Option<String>,
    /// Modifier keys held.
    modifiers: ModifiersState,
    dialog: Dialog,
    failure: Option<Error>,
}

impl App {
    /// Starts baking. The window is opened by the first event.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn new(options: &ViewerOptions, proxy: EventLoopProxy<UserEvent>) -> Result<Self> {
        // Threads wake the event loop, which otherwise sleeps until there is input.
        let of_baker = proxy.clone();
        let wake = &Wake::new(move || {
            // Fails only once the event loop has ended.
            let _ = of_baker.send_event(UserEvent::Baker);
        });
        let model = Model::new(options, wake)?;

        // Window and device follow with the first event, as windows can be opened only while the event loop runs.
        Ok(Self {
            exposure: AutoExposure::new(options.exposure_stops.is_none() && !model.exposure_is_kept),
            exposed: Instant::now(),
            warm_up: WarmUp::new(wake),
            notice: files::dark_notice(&model),
            shown: model.maps_shown(),
            model,
            panel: Panel::default(),
            graphics: None,
            proxy,
            stop: options.stop.clone(),
            size: options.size,
            picture_rect: egui::Rect::NOTHING,
            looking_from: None,
            pointer: PhysicalPosition::default(),
            gizmo: Gizmo::default(),
            clicks_at: None,
            moved_until: Instant::now(),
            wake_at: None,
            on_device: None,
            beside: None,
            divider: 0.5,
            pressed: Vec::new(),
            losses: Vec::new(),
            pace: Pace::default(),
            is_refining: false,
            shown_refusal: None,
            pictures: 0,
            frames: 0,
            rested_at: 0,
            reports_due: 0,
            modifiers: ModifiersState::empty(),
            dialog: Dialog::new(wake),
            failure: None,
        })
    }

    /// The error that ended the window, if any.
    pub fn failure(self) -> Option<Error> {
        self.failure
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) {
        match Graphics::new(event_loop, self.proxy.clone(), self.model.scene(), self.size) {
            Ok(mut graphics) => {
                if self.model.log.is_kept() {
                    graphics.interface.watch_controls();
                }
                let adapter = graphics.gpu.adapter_name();
                let started = json!({"scene": self.model.scene().name, "adapter": adapter});
                self.model.log.write("started", started);
                let report = &mut self.model.picture;
                report.adapter = adapter;
                report.frame_times = graphics
                    .gpu
                    .tells_times()
                    .then(|| report.frame_times.take().unwrap_or_default());
                graphics.window().request_redraw();
                self.pace = if graphics.gpu.is_software() {
                    Pace::of_software()
                } else {
                    Pace::default()
                };
                self.graphics = Some(graphics);
                (self.on_device, self.beside) = (None, None);
            }
            Err(error) => self.fail(event_loop, error),
        }
    }

    fn close(&mut self, event_loop: &ActiveEventLoop) {
        self.closing();
        event_loop.exit();
    }

    /// Leaks the graphics: the window no longer exists, so its objects must not be used, not even dropped.
    pub fn lose_window(&mut self) {
        std::mem::forget(self.graphics.take());
        self.closing();
    }

    fn closing(&mut self) {
        self.model.log.write("closing", Value::Null);
    }

    fn fail(&mut self, event_loop: &ActiveEventLoop, error: Error) {
        self.failure = Some(error);
        event_loop.exit();
    }

    /// Recreates window and device, unless they were lost too often.
    fn recover(&mut self, event_loop: &ActiveEventLoop) {
        // A lost device tells its reason, a lost surface does not.
        let reason = self
            .graphics
            .as_ref()
            .and_then(|graphics| graphics.gpu.take_error())
            .unwrap_or_else(|| {
                Error::failure(
                    "window",
                    "its surface was lost",
                    "update the graphics driver, or use `render`",
                )
            });
        self.model
            .log
            .write("device_lost", json!({"reason": reason.to_string()}));
        log::warn!("{reason}");

        // The new window has the size of the old one; keys and mouse that were held there count as released.
        if let Some(graphics) = self.graphics.take() {
            let window = graphics.window();
            let size = window.inner_size().to_logical(window.scale_factor());
            self.size = (size.width, size.height);
        }
        self.stop_looking();
        self.model.navigator.stop();

        // A driver that fails again and again would reopen the window without end.
        let now = Instant::now();
        self.losses
            .retain(|loss| now.duration_since(*loss) < LOSSES_WITHIN);
        self.losses.push(now);
        if self.losses.len() > MAX_LOSSES {
            self.fail(event_loop, reason);
            return;
        }

        // Nothing of the old device survives, so that everything is uploaded anew.
        self.open(event_loop);
        if self.graphics.is_some() {
            self.notice = Some(format!("The graphics device was lost and came back: {reason}"));
            self.model.log.write("device_recovered", Value::Null);
        }
    }

    fn request_redraw(&self) {
        if let Some(graphics) = &self.graphics {
            graphics.window().request_redraw();
        }
    }

    /// Advances the camera up to now. Must be called before held keys change and before each frame.
    fn fly(&mut self) {
        let now = Instant::now();
        let step = now.duration_since(self.moved_until).min(LONGEST_STEP);
        self.model.advance(step.as_secs_f64());
        self.moved_until = now;
    }

    /// Handles input, draws and presents one frame.
    fn redraw(&mut self, event_loop: &ActiveEventLoop) {
        // News of all threads comes first, so that the frame shows the newest camera, scene and maps.
        self.fly();
        self.poll_files();
        if self.model.poll() && self.is_software() {
            self.model.worker.look_away(LEVEL_OF_SOFTWARE);
        }
        self.report_chains();

        // The panel runs before the picture is drawn: a dragged slider changes the picture of the same frame.
        let Some((mut painting, commands)) = self.run_interface() else {
            return;
        };
        if commands
            .iter()
            .any(|command| matches!(command, Command::Choose(_)))
        {
            // Handles and legends were laid out before this change.
            self.request_redraw();
        }

        // Commands are applied before drawing; file dialogs and saved pictures wait until the frame is shown.
        let of_window = self.model.act(commands, Instant::now());
        let before = std::mem::replace(&mut self.shown, self.model.maps_shown());
        if before.quantity != self.shown.quantity {
            let what = self.shown.quantity.name();
            self.model.log.write("shows", json!({"what": what}));
            self.request_redraw();
        }
        if of_window.contains(&Command::MeasureExposure) {
            self.exposure.ask();
        }

        // A picture that cannot be drawn leaves a notice, and the panel stays usable.
        if let Err(error) = self.draw_picture() {
            self.tell_fault(&error);
        }
        self.report_making();
        let Some(graphics) = &mut self.graphics else {
            return;
        };
        let shown = graphics.show(&mut painting);
        // The error of a lost device is reported by `recover`.
        if shown != FrameOutcome::Broken
            && let Some(error) = graphics.gpu.take_error()
        {
            self.tell_fault(&error);
        }

        for command in of_window {
            match command {
                Command::Browse => self.ask_for_file(Choice::Open),
                Command::SaveScene => self.ask_for_file(Choice::SaveScene),
                Command::SavePicture => self.save_picture(),
                _ => {}
            }
        }
        self.schedule(event_loop, shown, painting.repaint_after);
    }

    /// Shows an error of the graphics device over the picture.
    fn tell_fault(&mut self, error: &Error) {
        let sentence = error.to_string();
        self.model.log.write("fault", json!({"sentence": sentence}));
        self.notice = Some(sentence);
    }

    /// Runs panel and overlays in egui. Returns the commands of both and of keys; [`Model::act`] orders them.
    fn run_interface(&mut self) -> Option<(Painting, Vec<Command>)> {
        // The panel tells of a lost device for a while. A light that the mouse drags is an edit, as typed numbers are.
        let lost = self.losses.last();
        self.model.picture.lost_device = lost.is_some_and(|loss| loss.elapsed() < LOSSES_WITHIN);
        let mut commands: Vec<Command> = self.model.placed().map(Command::Edit).into_iter().collect();

        // The panel takes its width, the picture what is left, and marks are drawn over the picture.
        let graphics = self.graphics.as_mut()?;
        let (window, picture) = (Arc::clone(graphics.window()), graphics.main.id);
        let beside = graphics.beside.as_ref().map(|beside| beside.id);
        let model = &self.model;
        let painting = graphics.interface.run(&window, |ui| {
            commands.extend(self.panel.show(ui, model));
            let rect = overlay::show(ui, picture, model, self.notice.as_deref());
            self.picture_rect = rect;
            if let Some((beside, reference)) = beside.zip(model.reference.as_ref()) {
                comparison_view::show(ui, rect, &mut self.divider, (beside, reference));
            }
            let camera = model.navigator.camera_for(f64::from(rect.aspect_ratio()));
            let lens = Viewport {
                camera: &camera,
                picture: rect,
            };
            if let Some(sketch) = model.sketch() {
                sketching::draw(ui.painter(), &lens, sketch, model.choices.sketched);
            }
            if let Some(probed) = model.probed() {
                probe::draw(ui.painter(), &lens, probed);
            }
            let held = model.choices.selection.held();
            let pulled = self.gizmo.show(ui, &lens, held, model.scene());
            commands.extend(pulled.map(Command::Edit));
        });
        commands.append(&mut self.pressed);

        // The log tells where controls are, so that scripts can click them.
        if let Some(controls) = &painting.moved_controls {
            let control = |c: &super::interface::Control| json!({"role": c.role, "name": c.name, "rect_pixels": c.rect});
            let controls: Vec<Value> = controls.iter().map(control).collect();
            self.model.log.write("controls", json!({"controls": controls}));
        }
        Some((painting, commands))
    }

    fn is_software(&self) -> bool {
        let graphics = self.graphics.as_ref();
        graphics.is_some_and(|graphics| graphics.gpu.is_software())
    }

    /// Schedules the next frame.
    fn schedule(&mut self, event_loop: &ActiveEventLoop, shown: FrameOutcome, repaint_after: Duration) {
        // A software rasterizer shares the cores with the bake, which pauses while the camera moves.
        let now = Instant::now();
        if self.is_software() && (self.model.is_moving() || self.looking_from.is_some()) {
            self.model.worker.hold(BAKE_WAITS);
        }

        // A moving picture is followed by the next one at once; the window sleeps as long as nothing changes.
        let wait = match shown {
            FrameOutcome::Broken => {
                self.recover(event_loop);
                return;
            }
            FrameOutcome::Hidden => Duration::MAX,
            FrameOutcome::Later => RETRY_AFTER,
            FrameOutcome::Yes if self.model.is_moving() || self.is_exposing() => Duration::ZERO,
            // The panel keeps scrolling while refinement pauses after input.
            FrameOutcome::Yes if self.is_refining => self.pace.pause(now).min(repaint_after),
            FrameOutcome::Yes if self.model.state.is_working() && self.is_software() => {
                repaint_after.min(BAKING_FRAME_OF_SOFTWARE)
            }
            FrameOutcome::Yes if self.model.state.is_working() => repaint_after.min(BAKING_FRAME),
            FrameOutcome::Yes => repaint_after,
        };

        // The GPU time of a picture arrives after it, and needs another frame to be shown.
        let is_report_due = self.reports_due > 0 && shown == FrameOutcome::Yes;
        let wait = if is_report_due {
            wait.min(REPORT_AFTER)
        } else {
            wait
        };
        if shown == FrameOutcome::Yes {
            self.frames += 1;
        }

        // The event loop wakes the window when the next frame or the next task of the model is due.
        if wait.is_zero() {
            self.wake_at = None;
            self.request_redraw();
            return;
        }
        self.wake_at = [now.checked_add(wait), self.model.due()]
            .into_iter()
            .flatten()
            .min();

        // A frame that could not be presented is not idle.
        let is_working = self.model.state.is_working() || self.is_refining || is_report_due;
        let is_coming = self.is_exposing() || self.warm_up.is_coming();
        let is_working = is_working || shown == FrameOutcome::Later || self.model.is_moving() || is_coming;

        // The log tells once per picture that the window has come to rest.
        if self.rested_at != self.pictures && !is_working {
            self.rested_at = self.pictures;
            let (pictures, frames) = (self.pictures, self.frames);
            let position = self.model.navigator.camera().position.to_array();
            let newest = self
                .model
                .picture
                .frame_times
                .as_ref()
                .and_then(FrameTimes::newest);
            self.model.log.write(
                "rest",
                json!({
                    "pictures": pictures,
                    "frames": frames,
                    "position_m": position,
                    "exposure_stops": self.model.choices.display.exposure_stops,
                    "device_ms": newest.map(GpuMs::sum),
                }),
            );
        }
    }
}

impl ApplicationHandler<UserEvent> for App {
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

    fn user_event(&mut self, _: &ActiveEventLoop, news: UserEvent) {
        if let (UserEvent::Accessibility(event), Some(graphics)) = (news, &mut self.graphics) {
            graphics.interface.on_accessibility(event);
        }
        self.request_redraw();
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, id: WindowId, event: WindowEvent) {
        // A window that was replaced after the loss of its device may still send events.
        let Some(graphics) = &mut self.graphics else {
            return;
        };
        let window = Arc::clone(graphics.window());
        if window.id() != id {
            return;
        }

        // Input pauses the refinement of the picture: the response does not wait for a long frame.
        if is_by_hand(&event) {
            self.pace.touch(Instant::now());
        }

        // egui asks for another frame after each frame; `schedule` decides that here.
        if graphics.interface.on_event(&window, &event) && event != WindowEvent::RedrawRequested {
            window.request_redraw();
        }

        // Handlers of keys and pointer check that no widget takes the event.
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => self.close(event_loop),
            WindowEvent::RedrawRequested if event_loop.exiting() => {}
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
            WindowEvent::DroppedFile(path) => self.drop_file(&path),
            WindowEvent::HoveredFile(path) => {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                self.notice = Some(format!("Let go to open {name}."));
            }
            WindowEvent::HoveredFileCancelled => self.notice = None,
            WindowEvent::CursorMoved { position, .. } => self.on_pointer(position),
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
        let look = self.stop.as_ref().map(|_| Instant::now() + STOP_POLL_INTERVAL);
        let until = [self.wake_at, look].into_iter().flatten().min();
        event_loop.set_control_flow(until.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }
}

/// Whether an event is keyboard or mouse input.
fn is_by_hand(event: &WindowEvent) -> bool {
    matches!(
        event,
        WindowEvent::KeyboardInput { .. }
            | WindowEvent::CursorMoved { .. }
            | WindowEvent::MouseInput { .. }
            | WindowEvent::MouseWheel { .. }
            | WindowEvent::ModifiersChanged(_)
    )
}
