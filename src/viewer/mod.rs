//! The window: fly through a scene, change a setting, watch it bake again.

mod app;
pub mod background;
pub mod brightest;
pub mod command;
pub mod comparison_view;
pub mod edits;
pub mod event_log;
pub mod exporting;
pub mod exposure;
pub mod false_colours;
pub mod files;
pub mod filming;
pub mod flat_map;
pub mod gizmo;
mod graphics;
mod interface;
pub mod lens;
pub mod model;
pub mod navigation;
pub mod new_light;
mod overlay;
pub mod pace;
pub mod panel;
pub mod playback;
pub mod probe;
pub mod sketching;
pub mod time_left;
pub mod timing;
pub mod views;
pub mod walking;
pub mod worker;

use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use winit::event_loop::EventLoop;

use self::app::{App, UserEvent};
use self::files::FilesOptions;
use crate::error::{Error, Result};
use crate::illumination::IlluminationMap;
use crate::progress::Control;
use crate::scene::Scene;
use crate::settings::BakeSettings;

/// Options of the viewer at its start.
#[derive(Clone, Debug)]
pub struct ViewerOptions {
    /// Already contains the lights that `--default-light` adds.
    pub scene: Arc<Scene>,
    /// Initial settings; the panel changes them.
    pub settings: BakeSettings,
    /// Maps of an earlier bake; `None` bakes on start.
    pub maps: Option<Vec<IlluminationMap>>,
    /// Inner size of the window [logical pixels], each > 0.
    pub size: (u32, u32),
    /// Name of the scene's camera to start from. `None` takes its first camera, or frames the scene if it has none.
    pub camera: Option<String>,
    /// Exposure [stops]; `None` measures it on the first picture.
    pub exposure_stops: Option<f64>,
    /// Closes the window soon after this is cancelled; `None` if only the user closes it.
    pub stop: Option<Arc<Control>>,
    /// Receives one JSON line per change of state, for support and for tests.
    pub event_log: Option<PathBuf>,
    /// How the window opens scenes.
    pub files: FilesOptions,
}

/// Location of the error that [`run`] returns if there is no display.
const DISPLAY: &str = "display";

/// Opens the window and returns when it is closed.
///
/// # Errors
/// No display (see [`is_no_display`]); no graphics adapter; a graphics device that was lost and could not be
/// recreated.
pub fn run(options: ViewerOptions) -> Result<()> {
    let event_loop = event_loop()?;
    let mut app = App::new(&options, event_loop.create_proxy())?;
    match unless_orphaned(|| event_loop.run_app(&mut app)) {
        Some(outcome) => outcome.map_err(|error| {
            Error::failure(
                "window",
                format!("the system ended it ({error})"),
                "check the display and start again",
            )
        })?,
        None => app.lose_window(),
    }
    app.failure().map_or(Ok(()), Err)
}

fn event_loop() -> Result<EventLoop<UserEvent>> {
    // winit panics instead of returning an error if a library of the window system is missing.
    let built = panic::catch_unwind(|| EventLoop::<UserEvent>::with_user_event().build());
    let reason = match built {
        Ok(Ok(event_loop)) => return Ok(event_loop),
        Ok(Err(error)) => error.to_string(),
        Err(_) => "a library of the window system is missing".into(),
    };
    Err(Error::failure(
        DISPLAY,
        format!("no window can be opened on one ({reason})"),
        "set DISPLAY or WAYLAND_DISPLAY, or use `bake` and `render`, which need no window",
    ))
}

/// Whether [`run`] failed because there is no display.
pub fn is_no_display(error: &Error) -> bool {
    error.location == DISPLAY
}

/// Whether winit has panicked. It does so when another program destroys its window, as `xdotool windowclose` does,
/// because it assumes that the X server still knows the window.
static IS_ORPHANED: AtomicBool = AtomicBool::new(false);

/// Records a panic and returns whether it came from winit. If so, the window is gone and [`run`] ends as if it had
/// been closed. To be called by the program's panic hook, which need not report such a panic; without that call the
/// panic propagates.
pub fn is_orphaned(info: &PanicHookInfo<'_>) -> bool {
    let is_of_winit = info
        .location()
        .is_some_and(|place| place.file().contains("/winit-") || place.file().contains("\\winit-"));
    IS_ORPHANED.fetch_or(is_of_winit, Ordering::Relaxed);
    is_of_winit
}

/// Runs the event loop; `None` if winit panicked.
fn unless_orphaned<T>(window: impl FnOnce() -> T) -> Option<T> {
    match panic::catch_unwind(AssertUnwindSafe(window)) {
        Ok(outcome) => Some(outcome),
        Err(_) if IS_ORPHANED.load(Ordering::Relaxed) => None,
        Err(panic) => panic::resume_unwind(panic),
    }
}
