//! `view`: a window; without a display, files instead.

use std::path::Path;

use nephroid::error::Result;
use nephroid::export::map_folder::MapFolder;
use nephroid::files;

use super::bake::{self, Clock, LoadedScene};
use super::job::{MapSource, PictureFormat, ViewJob};
use super::render;
use super::terminal::Interrupt;
use super::terminal::{self, Terminal};

/// Time of the light pass where neither quality nor time is asked for [s].
const HURRIED_S: f64 = 5.0;

/// Where files go when there is no display.
const HEADLESS_FOLDER: &str = "nephroid-out";

/// The picture's name in it.
const HEADLESS_PICTURE: &str = "picture.png";

/// Opens the window on the scene; where there is no display, bakes and makes a picture instead.
///
/// # Errors
/// Input that cannot be read; a window or files that failed.
pub fn run(job: ViewJob, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
    let clock = Clock::start();
    let loaded = bake::load(&job.scene, &clock, terminal)?;
    let why = window(&job, &loaded, terminal, interrupt)?;
    terminal.print_note(&format!(
        "{why}: writing maps and a picture to ./{HEADLESS_FOLDER}/ instead of opening a window"
    ));
    headless(&job, &loaded, &clock, terminal, interrupt)
}

/// Shows the window, and ends the process when that is closed; returns why it could not be opened.
#[cfg(feature = "viewer")]
fn window(
    job: &ViewJob,
    loaded: &LoadedScene,
    terminal: &Terminal,
    interrupt: &Interrupt,
) -> Result<&'static str> {
    use super::values::Exposure;
    use nephroid::{gpu, viewer};

    if !has_display() {
        return Ok("no display");
    }
    let maps = match &job.maps {
        MapSource::Bake(_) => None,
        MapSource::Folder(folder, _) => Some(render::read_maps(folder, loaded, terminal)?),
    };
    let camera = match &job.picture.camera {
        Some(_) => Some(render::choose_camera(&loaded.scene, &job.picture)?.name),
        None => None,
    };
    let options = viewer::ViewerOptions {
        scene: loaded.scene.clone(),
        settings: job.maps.settings().clone(),
        maps,
        size: job.picture.size,
        camera,
        exposure_stops: match job.picture.exposure {
            Exposure::Auto => None,
            Exposure::Stops(stops) => Some(stops),
        },
        stop: Some(interrupt.shared_control()),
        event_log: job.event_log.clone(),
        files: viewer::files::FilesOptions {
            load: job.scene.load_options(),
            watch: job.watch,
            config: viewer::files::config::ConfigFolder::of_user(),
            fresh: job.fresh,
            settings_given: job.settings_given,
        },
    };
    match viewer::run(options) {
        Ok(()) => interrupt.leave(),
        Err(error) if viewer::is_no_display(&error) => Ok("no display"),
        Err(error) if gpu::is_no_adapter(&error) => Ok("no graphics adapter"),
        Err(error) => Err(error),
    }
}

#[cfg(not(feature = "viewer"))]
fn window(_: &ViewJob, _: &LoadedScene, _: &Terminal, _: &Interrupt) -> Result<&'static str> {
    Ok("no display: this program was built without the viewer feature")
}

/// Whether the session has a screen to show windows on.
#[cfg(feature = "viewer")]
fn has_display() -> bool {
    if cfg!(any(target_os = "windows", target_os = "macos")) {
        return true;
    }
    ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"]
        .iter()
        .any(|name| std::env::var_os(name).is_some_and(|value| !value.is_empty()))
}

fn headless(
    job: &ViewJob,
    loaded: &LoadedScene,
    clock: &Clock,
    terminal: &Terminal,
    interrupt: &Interrupt,
) -> Result<()> {
    let path = Path::new(HEADLESS_FOLDER);
    let picture_path = path.join(HEADLESS_PICTURE);
    let location = picture_path.display().to_string();
    if let MapSource::Folder(folder, _) = &job.maps {
        let maps = render::read_maps(folder, loaded, terminal)?;
        let made = render::make(
            &loaded.scene,
            &maps,
            job.maps.settings(),
            &job.picture,
            terminal,
            interrupt,
        )?;
        let folder = files::OutputFolder::open(path)?;
        let bytes = made.encode(PictureFormat::Png, &location)?;
        files::write_atomically(&picture_path, |writer| writer.write_all(&bytes))?;
        return terminal::print(&folder.path().display().to_string());
    }
    let folder = MapFolder::open(path, job.force)?;
    let mut settings = job.maps.settings().clone();
    if job.hurries {
        settings.max_time_s = Some(HURRIED_S);
    }
    let settings = &settings;
    let result = bake::bake(loaded, settings, clock, terminal, interrupt)?;
    if !result.partial {
        let made = render::make(
            &loaded.scene,
            &result.maps,
            settings,
            &job.picture,
            terminal,
            interrupt,
        )?;
        let bytes = made.encode(PictureFormat::Png, &location)?;
        files::write_atomically(&picture_path, |writer| writer.write_all(&bytes))?;
    }
    folder.write(&loaded.scene, settings, &result)?;
    terminal::print(&format!("./{HEADLESS_FOLDER}/"))
}
