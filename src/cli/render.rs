//! `render`: a picture, or the frames of a film.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use nephroid::MapSet;
#[cfg(feature = "gpu")]
use nephroid::effect::{Effect, EffectSwitch};
use nephroid::error::{Error, Result};
use nephroid::export::frame_folder::FrameFolder;
use nephroid::export::sequence::FrameTimes;
use nephroid::files;
#[cfg(feature = "gpu")]
use nephroid::scene::CameraPath;
use nephroid::scene::camera_path::MAX_FRAMES;
use nephroid::settings::{BakeSettings, LayerKind};
use serde_json::json;

use super::bake_options::BakeOptions;
use super::console::Console;
use super::loaded::{LoadedScene, within_reach};
use super::moments::MomentOptions;
use super::options::{MapsOption, PictureOptions, RunOptions, SceneOptions};
use super::picture::{self, Backend, EyeOptions};
#[cfg(feature = "gpu")]
use super::render_path::Film;
use super::values::{self, Exposure};

#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("camera_motion").args(["path", "turntable"]))]
pub struct RenderArguments {
    /// .glb, .gltf or builtin:NAME
    scene: String,
    /// .png, or .exr of radiance; a folder for the frames of a film
    #[arg(short, long, value_name = "FILE", required_unless_present_any = ["path", "turntable"])]
    output: Option<PathBuf>,
    /// Draw a film along the camera path of a JSON file
    #[arg(long, value_name = "FILE", conflicts_with = "camera")]
    path: Option<PathBuf>,
    /// Draw a film once around the scene, starting at --camera
    #[arg(long, value_name = "FRAMES", conflicts_with = "path", value_parser = values::within(1..=MAX_FRAMES, "frames"))]
    turntable: Option<usize>,
    /// Time every frame of a film, with and without mirrors and glass
    #[arg(long, requires = "camera_motion", hide_short_help = true)]
    stats: bool,
    #[command(flatten)]
    moment: MomentOptions,
    #[command(flatten)]
    maps: MapsOption,
    #[command(flatten)]
    eye: EyeOptions,
    #[command(flatten)]
    picture: PictureOptions,
    #[command(flatten)]
    scene_options: SceneOptions,
    #[command(flatten)]
    bake: BakeOptions,
    #[command(flatten)]
    pub run: RunOptions,
}

impl RenderArguments {
    /// Loads, bakes or reads maps, renders the picture or the frames, and writes them.
    ///
    /// # Errors
    /// Bad usage; input, output, a bake or a picture that fails.
    pub fn run(&self, console: &Console) -> Result<()> {
        // The scene is loaded only when the options are known to fit each other.
        let settings = self.bake.settings(&LayerKind::ALL, self.run.threads())?;
        let options = self.scene_options.load_options(true);
        let moment = (&self.moment, &settings.effects);
        let load = || LoadedScene::load_at(&self.scene, &options, false, moment, console);

        // A camera that moves makes a film, a scene that moves a folder of frames, and neither a single picture.
        let Some(output) = self.output.as_ref().filter(|_| !self.moves()) else {
            return self.film(&settings, load, console);
        };
        if let Some(times) = self.moment.sequence() {
            return self.draw_moments(output, times, &settings, &load()?, console);
        }

        // Format and place of the picture are checked before the bake, the longest step.
        self.refuse_what_radiance_has_not(picture::holds_radiance(output)?)?;
        let loaded = load()?;
        files::check_output_file(output)?;
        let maps = picture::maps(self.maps.maps.as_deref(), &settings, &loaded, console)?;
        let look = (&self.picture, &self.eye);
        let made = picture::make(&loaded.scene, &maps, &settings.effects, look, output, console)?;

        // The automatic exposure is stated, so that other pictures can be made at the same one.
        let (view, made_by, seconds) = (&made.view, &made.made_by, loaded.seconds().0);
        let text = format!(
            "picture   {} ({}x{}, camera {}, {} maps, exposure {:+.2} stops, by {made_by})\nseconds   {seconds:.2}",
            output.display(),
            view.width,
            view.height,
            view.camera.name,
            maps.len(),
            view.exposure_stops,
        );
        let report = json!({
            "picture": output.display().to_string(),
            "width": view.width,
            "height": view.height,
            "camera": view.camera.name,
            "exposure_stops": view.exposure_stops,
            "made_by": made_by,
            "maps": maps.len(),
            "seconds": seconds,
        });
        console.print_result(&text, &report)
    }

    /// Renders the frames of a moving scene, all at the exposure of the first.
    fn draw_moments(
        &self,
        output: &Path,
        times: FrameTimes,
        settings: &BakeSettings,
        loaded: &LoadedScene,
        console: &Console,
    ) -> Result<()> {
        let folder = FrameFolder::open(output)?;
        let (mut options, mut eye) = (self.picture.clone(), self.eye.clone());
        let affordable = within_reach(settings, console);

        // One baker keeps what stays the same between frames; maps of a folder take its place.
        loaded.session(console, |session, bar, control| {
            for frame in 0..times.frames {
                let scene = Arc::new(loaded.scene.at(times.time_s(frame)));
                let maps = match &self.maps.maps {
                    Some(maps) => {
                        let set = MapSet::open_frame(maps, &scene, frame)?;
                        console.warn(&set.warnings());
                        set.read_all()?
                    }
                    None => {
                        session.set_scene(scene.clone())?;
                        let result = session.bake(&affordable, bar, control)?;
                        console.check(&loaded.scene.source)?;
                        console.warn(&result.warnings);
                        result.maps
                    }
                };

                // The exposure of the first picture holds for all: an automatic one for each would flicker.
                let (look, path) = ((&options, &eye), folder.file(frame));
                let made = picture::make(&scene, &maps, &settings.effects, look, &path, console)?;
                options.exposure = Some(Exposure::Stops(made.view.exposure_stops));

                // Where there is no graphics card, it is neither looked for nor missed again.
                if made.made_by == picture::CPU {
                    eye.backend = Some(Backend::Cpu);
                }
            }
            Ok(())
        })?;

        let seconds = loaded.seconds().0;
        let text = format!(
            "frames    {} in {}\nseconds   {seconds:.2}",
            times.frames,
            output.display()
        );
        let report =
            json!({"frames": times.frames, "folder": output.display().to_string(), "seconds": seconds});
        console.print_result(&text, &report)
    }

    fn moves(&self) -> bool {
        self.path.is_some() || self.turntable.is_some()
    }

    #[cfg(feature = "gpu")]
    fn film(
        &self,
        settings: &BakeSettings,
        load: impl FnOnce() -> Result<LoadedScene>,
        console: &Console,
    ) -> Result<()> {
        // Options that contradict each other are refused before the scene is loaded.
        let refused = |option: &str, what: &str, remedy: &str| Err(Error::usage(option, what, remedy));
        if self.moment.sequence().is_some() {
            return refused(
                "--frames",
                "the camera moves or the scene, not both",
                "leave --frames, or --path and --turntable, out",
            );
        }
        if self.eye.backend == Some(Backend::Cpu) {
            return refused(
                "--backend cpu",
                "frames of a path are drawn by the graphics card",
                "leave it out, or render single pictures",
            );
        }
        if !self.stats && self.output.is_none() {
            return refused(
                if self.path.is_some() {
                    "--path"
                } else {
                    "--turntable"
                },
                "its frames would go nowhere",
                "add --stats to time them, or -o DIR to keep them",
            );
        }
        if self.stats && settings.effects.get(Effect::Chains) == EffectSwitch::Off {
            return refused(
                "--effects chains=off",
                "--stats times frames with and without chains",
                "leave one of the two out",
            );
        }

        // A path brings its own number of frames, and leaves that of the orbit unused.
        let film = Film {
            // Read before the bake, so that a damaged file fails early.
            path: self.path.as_deref().map(CameraPath::read).transpose()?,
            turntable: self.turntable.unwrap_or(1),
            stats: self.stats,
            output: self.output.as_deref(),
            maps: self.maps.maps.as_deref(),
            look: (&self.picture, &self.eye),
        };

        let name = self
            .path
            .as_ref()
            .map_or("turntable".into(), |file| file.display().to_string());
        film.draw(&name, settings, &load()?, console)
    }

    #[cfg(not(feature = "gpu"))]
    fn film(&self, _: &BakeSettings, _: impl FnOnce() -> Result<LoadedScene>, _: &Console) -> Result<()> {
        Err(Error::usage(
            if self.path.is_some() {
                "--path"
            } else {
                "--turntable"
            },
            "this program was built without the gpu feature, which draws the frames",
            "render single pictures",
        ))
    }

    fn refuse_what_radiance_has_not(&self, is_radiance: bool) -> Result<()> {
        let given = [
            ("--exposure", self.picture.exposure.is_some()),
            ("--tone-map", self.eye.tone_map.is_some()),
            ("--white-balance", self.eye.white_balance.is_some()),
        ];
        match given.iter().find(|(_, is_given)| is_radiance && *is_given) {
            None => Ok(()),
            Some((option, _)) => Err(Error::usage(
                *option,
                "an .exr picture holds radiance, which neither exposure nor white balance nor tone mapping changes",
                "leave it out or write a .png",
            )),
        }
    }
}
