//! `view`: a window; without a display, files instead.

use std::path::Path;

use clap::Args;
use nephroid::error::{Error, Result};
use nephroid::export::map_folder::MapFolder;
use nephroid::files;
use nephroid::settings::{BakeSettings, LayerKind};

use super::bake_options::BakeOptions;
use super::console::{self, Console};
use super::loaded::LoadedScene;
use super::options::{MapsOption, PictureOptions, RunOptions, SceneOptions};
use super::picture::{self, EyeOptions};

const DEFAULT_SCENE: &str = "builtin:gallery";

/// Time limit of the light pass without a display, if neither quality nor time is given [s].
const HURRIED_S: f64 = 5.0;

/// Output folder without a display.
const HEADLESS_FOLDER: &str = "nephroid-out";

/// Name of the picture in that folder.
const HEADLESS_PICTURE: &str = "picture.png";

#[derive(Debug, Args)]
pub struct ViewArguments {
    /// .glb, .gltf or builtin:NAME [default: builtin:gallery]
    scene: Option<String>,
    /// Write a JSON line for each change of state of the window
    #[cfg(feature = "viewer")]
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    event_log: Option<std::path::PathBuf>,
    /// Read the scene again whenever its files change
    #[cfg(feature = "viewer")]
    #[arg(long)]
    watch: bool,
    /// Ignore the camera, settings and edits kept from last time
    #[cfg(feature = "viewer")]
    #[arg(long)]
    fresh: bool,
    /// Without a display: write into a folder that holds other files
    #[arg(long, hide_short_help = true)]
    force: bool,
    #[command(flatten)]
    maps: MapsOption,
    #[command(flatten)]
    picture: PictureOptions,
    #[command(flatten)]
    scene_options: SceneOptions,
    #[command(flatten)]
    bake: BakeOptions,
    #[command(flatten)]
    pub run: RunOptions,
}

impl ViewArguments {
    /// Opens a window on the scene; without a display, bakes and renders a picture instead.
    ///
    /// # Errors
    /// Bad usage; input that cannot be read; a window or output that fails.
    pub fn run(&self, console: &Console) -> Result<()> {
        if console.json {
            return Err(Error::usage(
                "--json",
                "a window has no result to print",
                "use bake, render or inspect with --json",
            ));
        }
        let bake = match &self.scene {
            Some(_) => self.bake.clone(),
            None => self.bake.clone().for_a_first_look(),
        };
        let settings = bake.settings(&LayerKind::ALL, self.run.threads())?;
        let source = self.scene.as_deref().unwrap_or(DEFAULT_SCENE);
        let loaded = LoadedScene::load(source, &self.scene_options.load_options(true), false, console)?;
        let why = self.window(&settings, &loaded, console)?;
        console.note(&format!(
            "{why}: writing maps and a picture to ./{HEADLESS_FOLDER}/ instead of opening a window"
        ));
        self.headless(settings, &loaded, console)
    }

    /// Shows the window and ends the process when it is closed; returns the reason if it cannot be opened.
    #[cfg(feature = "viewer")]
    fn window(
        &self,
        settings: &BakeSettings,
        loaded: &LoadedScene,
        console: &Console,
    ) -> Result<&'static str> {
        use super::values::Exposure;
        use nephroid::{gpu, viewer};

        // Without a screen there is nothing to open, and the caller writes files.
        if !has_display() {
            return Ok("no display");
        }

        // Maps and camera are read first, so that a wrong name is an error on the terminal.
        let read = |folder| picture::maps(Some(folder), settings, loaded, console);
        let maps = self.maps.maps.as_deref().map(read).transpose()?;
        let camera = match &self.picture.camera {
            Some(_) => Some(picture::choose_camera(&loaded.scene, &self.picture)?.name),
            None => None,
        };

        let options = viewer::ViewerOptions {
            scene: loaded.scene.clone(),
            settings: settings.clone(),
            maps,
            size: self.picture.size,
            camera,
            exposure_stops: match self.picture.exposure {
                Some(Exposure::Stops(stops)) => Some(stops),
                _ => None,
            },
            stop: Some(console.control().clone()),
            event_log: self.event_log.clone(),
            files: viewer::files::FilesOptions {
                load: self.scene_options.load_options(true),
                watch: self.watch,
                config: viewer::files::config::ConfigFolder::of_user(),
                fresh: self.fresh,
                settings_given: self.bake.names_any() || self.run.threads.is_some(),
            },
        };

        // A window that was closed ends the process; a missing display or adapter is no error, as files can be written.
        match viewer::run(options) {
            Ok(()) => console.leave(),
            Err(error) if viewer::is_no_display(&error) => Ok("no display"),
            Err(error) if gpu::is_no_adapter(&error) => Ok("no graphics adapter"),
            Err(error) => Err(error),
        }
    }

    #[cfg(not(feature = "viewer"))]
    fn window(&self, _: &BakeSettings, _: &LoadedScene, _: &Console) -> Result<&'static str> {
        Ok("no display: this program was built without the viewer feature")
    }

    fn headless(&self, mut settings: BakeSettings, loaded: &LoadedScene, console: &Console) -> Result<()> {
        let folder = Path::new(HEADLESS_FOLDER);
        let make = |maps: &[_], effects| {
            let look = (&self.picture, &EyeOptions::default());
            picture::make(
                &loaded.scene,
                maps,
                effects,
                look,
                &folder.join(HEADLESS_PICTURE),
                console,
            )
        };
        if let Some(baked) = &self.maps.maps {
            let maps = picture::maps(Some(baked), &settings, loaded, console)?;
            files::OutputFolder::open(folder)?;
            make(&maps, &settings.effects)?;
            return console::print(HEADLESS_FOLDER);
        }
        let folder = MapFolder::open(folder, self.force)?;
        if !self.bake.names_quality() {
            settings.max_time_s = Some(HURRIED_S);
        }
        let result = loaded.bake(&settings, console)?;
        if !result.partial {
            make(&result.maps, &settings.effects)?;
        }
        folder.write(&loaded.scene, &settings, &result)?;
        console::print(&format!("./{HEADLESS_FOLDER}/"))
    }
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
