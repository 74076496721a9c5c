//! The window: fly through a scene, change a setting, see it baked anew.

mod accessibility;
mod app;
mod background;
pub mod beside;
pub mod brightest;
pub mod debounce;
pub mod difference_view;
pub mod edits;
pub mod error_view;
pub mod event_log;
pub mod exporting;
pub mod exposure;
pub mod files;
pub mod filming;
pub mod flat_map;
pub mod frame_times;
pub mod gizmo;
mod graphics;
mod input;
mod interface;
pub mod latency;
pub mod lens;
pub mod model;
pub mod navigation;
pub mod new_light;
mod orphaned;
mod overlay;
pub mod pace;
pub mod panel;
pub mod probe;
pub mod screenshot;
pub mod sketching;
pub mod solid;
pub mod time_left;
pub mod views;
pub mod walking;
mod warm_up;
pub mod wavelength_view;
pub mod worker;

pub use orphaned::is_orphaned;

use std::path::PathBuf;
use std::sync::Arc;

use winit::event_loop::EventLoop;

use self::app::{App, News};
use self::files::FilesOptions;
use crate::error::{Error, Result};
use crate::illumination::IlluminationMap;
use crate::progress::Control;
use crate::scene::Scene;
use crate::settings::BakeSettings;

/// What the window starts with.
#[derive(Clone, Debug)]
pub struct ViewerOptions {
    /// The scene; lights added for it (`--default-light`) are already in it.
    pub scene: Arc<Scene>,
    /// First settings; the panel changes them.
    pub settings: BakeSettings,
    /// Maps that were baked before; `None` bakes on start.
    pub maps: Option<Vec<IlluminationMap>>,
    /// Inner size of the window [logical pixels], each > 0.
    pub size: (u32, u32),
    /// Name of the file's camera to start from; `None` takes the first, or frames the scene where there is none.
    pub camera: Option<String>,
    /// Exposure [stops]; `None` chooses it from the first picture.
    pub exposure_stops: Option<f64>,
    /// Closes the window soon after it is cancelled; `None` where only the user closes it.
    pub stop: Option<Arc<Control>>,
    /// One JSON line per change of state is written here: for support and for tests.
    pub event_log: Option<PathBuf>,
    /// How scenes are opened in the window.
    pub files: FilesOptions,
}

/// Location of the error that [`run`] returns where there is no display.
const DISPLAY: &str = "display";

/// Opens the window and returns when it is closed.
///
/// # Errors
/// No display (see [`is_no_display`]); no graphics adapter; a device that was lost and did not come back.
pub fn run(options: ViewerOptions) -> Result<()> {
    let event_loop = event_loop()?;
    let mut app = App::new(&options, event_loop.create_proxy())?;
    match orphaned::run(|| event_loop.run_app(&mut app)) {
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

fn event_loop() -> Result<EventLoop<News>> {
    // Where a library of the window system is missing, winit panics instead of telling.
    let built = std::panic::catch_unwind(|| EventLoop::<News>::with_user_event().build());
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

/// Whether [`run`] failed because there is no display to open a window on.
pub fn is_no_display(error: &Error) -> bool {
    error.location == DISPLAY
}
