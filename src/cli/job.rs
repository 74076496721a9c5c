//! What is to be done, with everything checked that can be checked before it starts.

use std::path::{Path, PathBuf};

use super::args::{
    Arguments, Backend, BakeArguments, Command, CompareArguments, InspectArguments, MapsOption,
    MergeArguments, PictureOptions, RenderArguments, RunOptions, SceneOptions, ViewArguments,
};
use super::bake_options::BakeOptions;
use super::export::{self, ExportJob};
use super::study::{self, StudyArguments};
use super::terminal::Interrupt;
use super::terminal::Terminal;
use super::values::Exposure;
use super::{bake, compare, inspect, merge, render, shard, view};
use nephroid::error::{Error, Result};
use nephroid::eye_pass::{ToneMap, WhiteBalance};
use nephroid::light_pass::share::Share;
use nephroid::scene::{self, LoadOptions, Scene};
use nephroid::settings::{BakeSettings, LayerKind};

#[cfg(feature = "gpu")]
use nephroid::effect::{Effect, EffectSwitch};

#[cfg(feature = "gpu")]
use super::render_path;

/// Scene of `view` when none is named.
const DEFAULT_SCENE: &str = "builtin:gallery";

/// Pixels of pictures and of the window when no size is given.
const DEFAULT_SIZE: (u32, u32) = (1280, 720);

/// Most worker threads.
const MAX_THREADS: usize = 1024;

/// One command, ready to run.
#[derive(Debug)]
pub enum Job {
    View(ViewJob),
    Bake(BakeJob),
    Render(RenderJob),
    #[cfg(feature = "gpu")]
    RenderPath(PathJob),
    Inspect(InspectJob),
    Compare(CompareArguments),
    Shard(BakeJob, Share),
    Merge(MergeArguments, usize),
    Export(ExportJob),
    Study(StudyArguments),
}

/// `view`.
#[derive(Debug)]
pub struct ViewJob {
    pub scene: SceneInput,
    pub maps: MapSource,
    pub picture: PictureRequest,
    #[cfg(feature = "viewer")]
    pub event_log: Option<PathBuf>,
    /// The scene is read again when its files change.
    #[cfg(feature = "viewer")]
    pub watch: bool,
    /// What was kept of the scene is left alone.
    #[cfg(feature = "viewer")]
    pub fresh: bool,
    /// The bake's settings are those of the command line, not kept ones.
    #[cfg(feature = "viewer")]
    pub settings_given: bool,
    pub force: bool,
    /// No option says how good the maps are to be: without a window nobody should wait long for them.
    pub hurries: bool,
}

/// `bake`.
#[derive(Debug)]
pub struct BakeJob {
    pub scene: SceneInput,
    pub settings: BakeSettings,
    pub output: PathBuf,
    pub force: bool,
}

/// `render`.
#[derive(Debug)]
pub struct RenderJob {
    pub scene: SceneInput,
    pub maps: MapSource,
    pub picture: PictureRequest,
    pub output: PathBuf,
    pub format: PictureFormat,
}

/// How the camera moves from frame to frame.
#[cfg(feature = "gpu")]
#[derive(Debug)]
pub enum Motion {
    /// As a file says.
    Path(PathBuf),
    /// Once around the scene, in so many frames.
    Turntable(usize),
}

/// `render` of a camera's path.
#[cfg(feature = "gpu")]
#[derive(Debug)]
pub struct PathJob {
    pub scene: SceneInput,
    pub maps: MapSource,
    /// Of every frame; its camera is where a turntable begins.
    pub picture: PictureRequest,
    pub motion: Motion,
    /// Whether frames are timed with and without chains.
    pub stats: bool,
    /// Folder for the frames.
    pub output: Option<PathBuf>,
}

/// `inspect`.
#[derive(Debug)]
pub struct InspectJob {
    pub scene: SceneInput,
    pub settings: BakeSettings,
}

/// Where illumination comes from.
#[derive(Debug)]
pub enum MapSource {
    /// A bake with these settings.
    Bake(BakeSettings),
    /// A folder that was baked before; the settings are those of a re-bake in the window.
    Folder(PathBuf, BakeSettings),
}

impl MapSource {
    /// Settings of the bake, or of a later one.
    pub fn settings(&self) -> &BakeSettings {
        match self {
            Self::Bake(settings) | Self::Folder(_, settings) => settings,
        }
    }
}

/// What a picture should be.
#[derive(Clone, Debug)]
pub struct PictureRequest {
    /// Name or index.
    pub camera: Option<String>,
    /// Across and down [pixels].
    pub size: (u32, u32),
    pub exposure: Exposure,
    pub tone_map: ToneMap,
    pub white_balance: WhiteBalance,
    /// `None`: gpu where there is one, else cpu.
    pub backend: Option<Backend>,
}

/// What a picture file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// Display colours.
    Png,
    /// Radiance [W/(m² sr)].
    Exr,
}

impl Job {
    /// Checks the arguments.
    ///
    /// # Errors
    /// Values outside their ranges, options that do not apply.
    pub fn from_arguments(arguments: Arguments) -> Result<Self> {
        match arguments.command {
            None => view_job(arguments.view),
            Some(Command::View(view)) => view_job(view),
            Some(Command::Bake(bake)) => bake_job(bake),
            Some(Command::Render(render)) => render_job(render),
            Some(Command::Inspect(inspect)) => inspect_job(inspect),
            Some(Command::Compare(compare)) => compare_job(compare),
            Some(Command::Merge(merge)) => {
                let threads = threads(&merge.run)?;
                Ok(Job::Merge(merge, threads))
            }
            Some(Command::Export(export)) => Ok(Job::Export(ExportJob::new(export)?)),
            Some(Command::Study(study)) => Ok(Job::Study(study)),
        }
    }

    /// Does it.
    ///
    /// # Errors
    /// Whatever failed, as one sentence.
    pub fn run(self, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
        match self {
            Self::View(job) => view::run(job, terminal, interrupt),
            Self::Bake(job) => bake::run(&job, terminal, interrupt),
            Self::Render(job) => render::run(&job, terminal, interrupt),
            #[cfg(feature = "gpu")]
            Self::RenderPath(job) => render_path::run(&job, terminal, interrupt),
            Self::Inspect(job) => inspect::run(&job, terminal, interrupt),
            Self::Compare(job) => compare::run(&job, terminal),
            Self::Shard(job, share) => shard::run(&job, share, terminal, interrupt),
            Self::Merge(merge, threads) => merge::run(&merge, threads, terminal, interrupt),
            Self::Export(job) => export::run(&job, terminal, interrupt),
            Self::Study(arguments) => study::run(&arguments, terminal, interrupt),
        }
    }
}

fn view_job(arguments: ViewArguments) -> Result<Job> {
    if arguments.run.json {
        return Err(Error::usage(
            "--json",
            "a window has no result to print",
            "use bake, render or inspect with --json",
        ));
    }
    let bake = match &arguments.scene {
        Some(_) => arguments.bake.clone(),
        None => arguments.bake.clone().for_a_first_look(),
    };
    let scene = arguments.scene.unwrap_or_else(|| DEFAULT_SCENE.to_string());
    Ok(Job::View(ViewJob {
        scene: scene_input(scene, &arguments.scene_options, MissingLight::Add),
        maps: map_source(arguments.maps, &bake, &arguments.run)?,
        picture: picture_request(arguments.picture, (None, None, None)),
        #[cfg(feature = "viewer")]
        event_log: arguments.event_log,
        #[cfg(feature = "viewer")]
        watch: arguments.watch,
        #[cfg(feature = "viewer")]
        fresh: arguments.fresh,
        #[cfg(feature = "viewer")]
        settings_given: arguments.bake.names_any() || arguments.run.threads.is_some(),
        force: arguments.force,
        hurries: !arguments.bake.names_quality(),
    }))
}

fn bake_job(arguments: BakeArguments) -> Result<Job> {
    let threads = threads(&arguments.run)?;
    let job = BakeJob {
        scene: scene_input(arguments.scene, &arguments.scene_options, MissingLight::Fail),
        settings: arguments.bake.settings(&[LayerKind::Caustic], threads)?,
        output: arguments.output,
        force: arguments.force,
    };
    let Some(share) = arguments.shard else {
        return Ok(Job::Bake(job));
    };
    nephroid::session::shards::check(&job.settings)?;
    Ok(Job::Shard(job, share))
}

fn render_job(arguments: RenderArguments) -> Result<Job> {
    if arguments.path.is_some() || arguments.turntable.is_some() {
        return path_job(arguments);
    }
    let Some(output) = arguments.output else {
        return Err(Error::usage(
            "--output",
            "no file for the picture is named",
            "add -o FILE.png or -o FILE.exr",
        ));
    };
    let format = picture_format(&output)?;
    let eye = (arguments.tone_map, arguments.white_balance, arguments.backend);
    if format == PictureFormat::Exr {
        let radiance_only = |option: &str| {
            Err(Error::usage(
                option,
                "an .exr picture holds radiance, which neither exposure nor white balance nor tone mapping changes",
                "leave it out or write a .png",
            ))
        };
        if arguments.picture.exposure.is_some() {
            return radiance_only("--exposure");
        }
        if arguments.tone_map.is_some() {
            return radiance_only("--tone-map");
        }
        if arguments.white_balance.is_some() {
            return radiance_only("--white-balance");
        }
    }
    Ok(Job::Render(RenderJob {
        scene: scene_input(arguments.scene, &arguments.scene_options, MissingLight::Add),
        maps: map_source(arguments.maps, &arguments.bake, &arguments.run)?,
        picture: picture_request(arguments.picture, eye),
        output,
        format,
    }))
}

#[cfg(feature = "gpu")]
fn path_job(arguments: RenderArguments) -> Result<Job> {
    let RenderArguments { stats, output, .. } = arguments;
    let motion = match (arguments.path, arguments.turntable) {
        (Some(path), _) => Motion::Path(path),
        (None, frames) => Motion::Turntable(frames.unwrap_or(1)),
    };
    let refused = |option: &str, what: &str, remedy: &str| Err(Error::usage(option, what, remedy));
    if arguments.backend == Some(Backend::Cpu) {
        return refused(
            "--backend cpu",
            "frames of a path are drawn by the graphics card",
            "leave it out, or render single pictures",
        );
    }
    if !stats && output.is_none() {
        return refused(
            match motion {
                Motion::Path(_) => "--path",
                Motion::Turntable(_) => "--turntable",
            },
            "nothing is wanted of its frames",
            "add --stats to time them, or -o DIR to keep them",
        );
    }
    let maps = map_source(arguments.maps, &arguments.bake, &arguments.run)?;
    if stats && maps.settings().effects.get(Effect::Chains) == EffectSwitch::Off {
        return refused(
            "--effects chains=off",
            "--stats times frames with and without chains",
            "leave one of the two out",
        );
    }
    Ok(Job::RenderPath(PathJob {
        scene: scene_input(arguments.scene, &arguments.scene_options, MissingLight::Add),
        maps,
        picture: picture_request(
            arguments.picture,
            (arguments.tone_map, arguments.white_balance, arguments.backend),
        ),
        motion,
        stats,
        output,
    }))
}

#[cfg(not(feature = "gpu"))]
fn path_job(arguments: RenderArguments) -> Result<Job> {
    let option = match arguments.path {
        Some(_) => "--path",
        None => "--turntable",
    };
    Err(Error::usage(
        option,
        "this program was built without the gpu feature, which draws the frames",
        "render single pictures",
    ))
}

fn inspect_job(arguments: InspectArguments) -> Result<Job> {
    Ok(Job::Inspect(InspectJob {
        scene: scene_input(arguments.scene, &arguments.scene_options, MissingLight::Keep),
        settings: arguments
            .bake
            .settings(&[LayerKind::Caustic], threads(&arguments.run)?)?,
    }))
}

fn compare_job(arguments: CompareArguments) -> Result<Job> {
    if let Some(percent) = arguments.max_rmse
        && !(percent.is_finite() && percent >= 0.0)
    {
        return Err(Error::usage(
            "--max-rmse",
            format!("{percent} is no limit"),
            "give a percentage of 0 or more",
        ));
    }
    if let Some(path) = &arguments.difference
        && picture_format(path)? != PictureFormat::Png
    {
        return Err(Error::usage(
            "--difference",
            format!("{} is no .png file", path.display()),
            "name a file that ends in .png",
        ));
    }
    Ok(Job::Compare(arguments))
}

fn picture_request(
    options: PictureOptions,
    (tone_map, white_balance, backend): (Option<ToneMap>, Option<WhiteBalance>, Option<Backend>),
) -> PictureRequest {
    PictureRequest {
        camera: options.camera,
        size: options.size.unwrap_or(DEFAULT_SIZE),
        exposure: options.exposure.unwrap_or_default(),
        tone_map: tone_map.unwrap_or_default(),
        white_balance: white_balance.unwrap_or_default(),
        backend,
    }
}

pub(super) fn scene_input(source: String, options: &SceneOptions, otherwise: MissingLight) -> SceneInput {
    SceneInput {
        source,
        missing_light: if options.default_light {
            MissingLight::Add
        } else {
            otherwise
        },
        solid_glass: options.solid_glass,
        environment: options.environment.clone(),
    }
}

/// Pictures need both layers, since they show all light.
fn map_source(option: MapsOption, bake: &BakeOptions, run: &RunOptions) -> Result<MapSource> {
    let settings = bake.settings(&[LayerKind::Caustic, LayerKind::Direct], threads(run)?)?;
    Ok(match option.maps {
        Some(folder) => MapSource::Folder(folder, settings),
        None => MapSource::Bake(settings),
    })
}

/// Threads asked for; 0 = one per core.
pub(super) fn threads(run: &RunOptions) -> Result<usize> {
    match run.threads {
        None => Ok(0),
        Some(threads) if (1..=MAX_THREADS).contains(&threads) => Ok(threads),
        Some(threads) => Err(Error::usage(
            "--threads",
            format!("{threads} is outside 1 to {MAX_THREADS}"),
            "give a number in that range",
        )),
    }
}

fn picture_format(path: &Path) -> Result<PictureFormat> {
    let extension = path
        .extension()
        .map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("png") => Ok(PictureFormat::Png),
        Some("exr") => Ok(PictureFormat::Exr),
        _ => Err(Error::usage(
            path.display().to_string(),
            "a picture's name has to say its format",
            "name a file that ends in .png or .exr",
        )),
    }
}

/// What to do with a scene without light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MissingLight {
    /// Refuse, and name the flag that adds one.
    Fail,
    /// Leave it dark.
    Keep,
    /// Add a sun, with a warning.
    Add,
}

/// A scene as the user named it.
#[derive(Clone, Debug)]
pub struct SceneInput {
    /// A path, or `builtin:NAME`.
    pub source: String,
    pub missing_light: MissingLight,
    pub solid_glass: bool,
    /// Image that lies around the scene.
    pub environment: Option<PathBuf>,
}

impl SceneInput {
    /// How its file is read.
    pub fn load_options(&self) -> LoadOptions {
        LoadOptions {
            solid_glass: self.solid_glass,
            default_light: self.missing_light == MissingLight::Add,
            environment: self.environment.clone(),
            ..LoadOptions::default()
        }
    }

    /// The scene, with a light where one was missing and is to be added.
    ///
    /// # Errors
    /// A scene that cannot be read, is unknown, or has no light where one is needed.
    pub fn load(&self) -> Result<Scene> {
        let scene = scene::load(&self.source, &self.load_options())?;
        if scene.lights.is_empty() && self.missing_light == MissingLight::Fail {
            return Err(Error::failure(
                &self.source,
                "the scene has no light",
                "add one to the file, a sun with --default-light or a sky with --environment",
            ));
        }
        Ok(scene)
    }
}
