//! What is to be done, with everything checked that can be checked before it starts.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
#[cfg(feature = "gpu")]
use nephroid::effect::{Effect, EffectSwitch};
use nephroid::error::{Error, Result};
use nephroid::eye_pass::{ToneMap, WhiteBalance};
use nephroid::settings::{BakeSettings, Estimator, LayerKind, MapResolution};
use nephroid::study::brute_force;
use nephroid::study::convergence::{DEFAULT_DENSITIES, Ladder};
use nephroid::study::effects::EffectStudy;

use super::args::{
    Arguments, Backend, BakeArguments, Command, CompareArguments, ConvergenceArguments, EffectsArguments,
    InspectArguments, MapsOption, PictureOptions, ReferenceArguments, RenderArguments, RunOptions,
    SceneOptions, Study, StudyArguments, ViewArguments,
};
use super::bake_options::BakeOptions;
use super::compare::{self, LayerChoice};
use super::interrupt::Interrupt;
#[cfg(feature = "gpu")]
use super::render_path;
use super::scene_input::{MissingLight, SceneInput};
use super::terminal::Terminal;
use super::values::Exposure;
use super::{bake, inspect, render, study, study_effects, view};

/// Scene of `view` when none is named.
const DEFAULT_SCENE: &str = "builtin:showroom";

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
    Compare(CompareJob),
    ListStudies,
    Convergence(ConvergenceJob),
    Reference(ReferenceJob),
    Effects(EffectsJob),
}

/// `view`.
#[derive(Debug)]
pub struct ViewJob {
    pub scene: SceneInput,
    pub maps: MapSource,
    pub picture: PictureRequest,
    #[cfg(feature = "viewer")]
    pub event_log: Option<PathBuf>,
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

/// `render` of a camera's path.
#[cfg(feature = "gpu")]
#[derive(Debug)]
pub struct PathJob {
    pub scene: SceneInput,
    pub maps: MapSource,
    /// Of every frame; it names no camera.
    pub picture: PictureRequest,
    pub path: PathBuf,
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

/// `compare`.
#[derive(Debug)]
pub struct CompareJob {
    pub map: PathBuf,
    pub reference: PathBuf,
    pub layer: Option<LayerChoice>,
    pub difference: Option<PathBuf>,
    /// Largest relative RMSE [1].
    pub max_rmse: Option<f64>,
}

/// `study convergence`.
#[derive(Debug)]
pub struct ConvergenceJob {
    pub scene: SceneInput,
    pub ladder: Ladder,
    pub reference: Option<PathBuf>,
    pub surface: Option<String>,
    pub output: PathBuf,
    pub force: bool,
}

/// `study reference`.
#[derive(Debug)]
pub struct ReferenceJob {
    pub scene: SceneInput,
    pub settings: BakeSettings,
    pub rays: u64,
    pub output: PathBuf,
    pub force: bool,
}

/// `study effects`.
#[derive(Debug)]
pub struct EffectsJob {
    pub scene: SceneInput,
    pub study: EffectStudy,
    pub output: PathBuf,
    pub force: bool,
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
            Some(Command::Study(study)) => study_job(study),
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
            Self::ListStudies => study::list(terminal),
            Self::Convergence(job) => study::convergence(&job, terminal, interrupt),
            Self::Reference(job) => study::reference(&job, terminal, interrupt),
            Self::Effects(job) => study_effects::run(&job, terminal, interrupt),
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
    let scene = arguments.scene.unwrap_or_else(|| DEFAULT_SCENE.to_string());
    Ok(Job::View(ViewJob {
        scene: scene_input(scene, &arguments.scene_options, MissingLight::Add),
        maps: map_source(arguments.maps, &arguments.bake, &arguments.run)?,
        picture: PictureRequest {
            camera: arguments.picture.camera,
            size: arguments.picture.size.unwrap_or(DEFAULT_SIZE),
            exposure: arguments.picture.exposure.unwrap_or_default(),
            tone_map: ToneMap::default(),
            white_balance: WhiteBalance::default(),
            backend: None,
        },
        #[cfg(feature = "viewer")]
        event_log: arguments.event_log,
        force: arguments.force,
        hurries: !arguments.bake.names_quality(),
    }))
}

fn bake_job(arguments: BakeArguments) -> Result<Job> {
    Ok(Job::Bake(BakeJob {
        scene: scene_input(arguments.scene, &arguments.scene_options, MissingLight::Fail),
        settings: arguments
            .bake
            .settings(&[LayerKind::Caustic], threads(&arguments.run)?)?,
        output: arguments.output,
        force: arguments.force,
    }))
}

fn render_job(arguments: RenderArguments) -> Result<Job> {
    if let Some(path) = arguments.path.clone() {
        return path_job(arguments, path);
    }
    let Some(output) = arguments.output else {
        return Err(Error::usage(
            "--output",
            "no file for the picture is named",
            "add -o FILE.png or -o FILE.exr",
        ));
    };
    let format = picture_format(&output)?;
    let PictureOptions {
        camera,
        exposure,
        size,
    } = arguments.picture;
    if format == PictureFormat::Exr {
        let radiance_only = |option: &str| {
            Err(Error::usage(
                option,
                "an .exr picture holds radiance, which neither exposure nor white balance nor tone mapping changes",
                "leave it out or write a .png",
            ))
        };
        if exposure.is_some() {
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
        picture: PictureRequest {
            camera,
            size: size.unwrap_or(DEFAULT_SIZE),
            exposure: exposure.unwrap_or_default(),
            tone_map: arguments.tone_map.unwrap_or_default(),
            white_balance: arguments.white_balance.unwrap_or_default(),
            backend: arguments.backend,
        },
        output,
        format,
    }))
}

#[cfg(feature = "gpu")]
fn path_job(arguments: RenderArguments, path: PathBuf) -> Result<Job> {
    let RenderArguments { stats, output, .. } = arguments;
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
            "--path",
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
        picture: PictureRequest {
            camera: None,
            size: arguments.picture.size.unwrap_or(DEFAULT_SIZE),
            exposure: arguments.picture.exposure.unwrap_or_default(),
            tone_map: arguments.tone_map.unwrap_or_default(),
            white_balance: arguments.white_balance.unwrap_or_default(),
            backend: arguments.backend,
        },
        path,
        stats,
        output,
    }))
}

#[cfg(not(feature = "gpu"))]
fn path_job(_: RenderArguments, _: PathBuf) -> Result<Job> {
    Err(Error::usage(
        "--path",
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
    Ok(Job::Compare(CompareJob {
        map: arguments.map,
        reference: arguments.reference,
        layer: arguments.layer,
        difference: arguments.difference,
        max_rmse: arguments.max_rmse.map(|percent| percent / 100.0),
    }))
}

fn study_job(arguments: StudyArguments) -> Result<Job> {
    match arguments.study {
        Some(Study::Convergence(convergence)) => convergence_job(convergence),
        Some(Study::Reference(reference)) => reference_job(reference),
        Some(Study::Effects(effects)) => effects_job(effects),
        None if arguments.list => Ok(Job::ListStudies),
        None => Err(Error::usage(
            "study",
            "no study is named",
            "name one, or use --list to see which there are",
        )),
    }
}

/// Texels across and down of a study's maps where none are asked for.
const STUDY_RESOLUTION: MapResolution = MapResolution::Fixed {
    width: 256,
    height: 256,
};

/// Bakes of each kind where no number is asked for.
const DEFAULT_REPEATS: usize = 5;

/// Most bakes of each kind.
const MAX_REPEATS: usize = 1000;

/// Densest lattice of `--quick` [1/sr].
const QUICK_DENSITY: f64 = 1e5;

fn convergence_job(arguments: ConvergenceArguments) -> Result<Job> {
    let settings = BakeSettings {
        map_resolution: arguments.map_resolution.unwrap_or(STUDY_RESOLUTION),
        threads: threads(&arguments.run)?,
        ..BakeSettings::default()
    };
    let densities = arguments.densities.unwrap_or_else(|| {
        let wanted = |density: &f64| !arguments.quick || *density <= QUICK_DENSITY;
        DEFAULT_DENSITIES.into_iter().filter(wanted).collect()
    });
    check_ladder(&densities, &settings)?;
    let mut estimators: Vec<Estimator> = Vec::new();
    for estimator in arguments
        .estimators
        .unwrap_or_else(|| Estimator::value_variants().to_vec())
    {
        if !estimators.contains(&estimator) {
            estimators.push(estimator);
        }
    }
    let repeats = match arguments.repeat {
        None if arguments.quick => 1,
        asked => repeats(asked)?,
    };
    let scene = arguments.scene.unwrap_or_else(|| "builtin:ring".to_string());
    Ok(Job::Convergence(ConvergenceJob {
        scene: scene_input(scene, &arguments.scene_options, MissingLight::Fail),
        ladder: Ladder {
            estimators,
            densities,
            repeats,
            settings,
        },
        reference: arguments.reference,
        surface: arguments.surface,
        output: arguments.output,
        force: arguments.force,
    }))
}

/// Bakes of each kind.
fn repeats(asked: Option<usize>) -> Result<usize> {
    match asked {
        None => Ok(DEFAULT_REPEATS),
        Some(repeats) if (1..=MAX_REPEATS).contains(&repeats) => Ok(repeats),
        Some(repeats) => Err(Error::usage(
            "--repeat",
            format!("{repeats} is outside 1 to {MAX_REPEATS}"),
            "give a number in that range",
        )),
    }
}

fn check_ladder(densities: &[f64], settings: &BakeSettings) -> Result<()> {
    if densities.is_empty() || !densities.is_sorted_by(|a, b| a < b) {
        return Err(Error::usage(
            "--densities",
            "they have to be in ascending order, each once",
            "give numbers such as 1e3,1e4,1e5",
        ));
    }
    for &density_per_sr in densities {
        let rung = BakeSettings {
            density_per_sr,
            ..settings.clone()
        };
        rung.validate().map_err(|error| Error {
            location: "--densities".into(),
            ..error
        })?;
    }
    Ok(())
}

fn reference_job(arguments: ReferenceArguments) -> Result<Job> {
    let settings = BakeSettings {
        map_resolution: arguments.map_resolution.unwrap_or(STUDY_RESOLUTION),
        seed: arguments.seed.unwrap_or(0),
        threads: threads(&arguments.run)?,
        ..BakeSettings::default()
    };
    settings.validate()?;
    brute_force::check_rays(arguments.rays)?;
    Ok(Job::Reference(ReferenceJob {
        scene: scene_input(arguments.scene, &arguments.scene_options, MissingLight::Fail),
        settings,
        rays: arguments.rays,
        output: arguments.output,
        force: arguments.force,
    }))
}

fn effects_job(arguments: EffectsArguments) -> Result<Job> {
    let settings = arguments
        .bake
        .settings(&[LayerKind::Caustic], threads(&arguments.run)?)?;
    if settings.max_time_s.is_some() {
        return Err(Error::usage(
            "--max-time",
            "bakes that a clock ends do not differ by their effects alone",
            "leave it out, or use --max-error or --density",
        ));
    }
    Ok(Job::Effects(EffectsJob {
        scene: scene_input(arguments.scene, &arguments.scene_options, MissingLight::Fail),
        study: EffectStudy {
            settings,
            repeats: repeats(arguments.repeat)?,
        },
        output: arguments.output,
        force: arguments.force,
    }))
}

fn scene_input(source: String, options: &SceneOptions, otherwise: MissingLight) -> SceneInput {
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
fn threads(run: &RunOptions) -> Result<usize> {
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
