//! `study`: which there are, what they take, and one way to run them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::{ArgMatches, Args, FromArgMatches, Subcommand};
use nephroid::effect::Effect;
use nephroid::error::{Error, Result, Warning};
use nephroid::export::map_folder::MapFolder;
use nephroid::files::{self, OutputFolder};
use nephroid::scene::Scene;
use nephroid::settings::{BakeSettings, Estimator, LayerKind, MapResolution, Wavelengths};
use nephroid::study::brute_force::{brute_force, check_rays, relative_noise};
use nephroid::study::one_scene::{self, CONVERGENCE, EFFECTS, SPECTRUM};
use nephroid::study::references::Reference;
use nephroid::study::studies;
use nephroid::study::sweep::{Bench, Outcome, Sweep};
use nephroid::study::table::Table;
use nephroid::transport::Tracer;
use serde::Serialize;
use serde_json::json;

use super::bake_options::BakeOptions;
use super::compare::read_luminance;
use super::console::Console;
use super::loaded::LoadedScene;
use super::options::{RunOptions, SceneOptions};
use super::values;

const REFERENCE: (&str, &str) = (
    "reference",
    "maps by brute force, one texel per ray, with their noise",
);
const ALL: (&str, &str) = ("pages", "all that follow, each in a folder of its name");

/// Texels across and down where none are asked for.
const SIDE: usize = 256;
const SPECTRUM_SIDE: usize = 1024;

/// Bakes of each kind where no number is asked for, and the most.
const REPEATS: usize = 5;
const MAX_REPEATS: usize = 1000;

/// Densities of `convergence` [1/sr]; `--quick` leaves out the last.
const DENSITIES: [f64; 9] = [1e2, 3e2, 1e3, 3e3, 1e4, 3e4, 1e5, 3e5, 1e6];
const QUICK_DENSITIES: usize = 7;

/// Of thin beams [1/sr].
const BEAM_DENSITY_PER_SR: f64 = 1e8;

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct StudyArguments {
    /// Name all studies
    #[arg(long)]
    list: bool,
    #[command(subcommand)]
    study: Option<Study>,
    #[command(flatten)]
    run: RunOptions,
}

#[derive(Debug, Subcommand)]
enum Study {
    #[command(about = CONVERGENCE.1)]
    Convergence(ConvergenceArguments),
    #[command(about = REFERENCE.1)]
    Reference(ReferenceArguments),
    #[command(about = EFFECTS.1)]
    Effects(EffectsArguments),
    #[command(about = SPECTRUM.1)]
    Spectrum(SpectrumArguments),
    #[command(flatten)]
    Built(BuiltStudy),
}

/// What every study takes.
#[derive(Debug, Args)]
struct Common {
    /// Folder for what it finds: NAME.md, NAME.csv, plots (.svg) and pictures (.png)
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Write into the folder even if it holds other files
    #[arg(long)]
    force: bool,
    /// Small maps and few of everything, to see that it works
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    run: RunOptions,
}

/// Of a scene that is named.
#[derive(Debug, Args)]
struct BakesOptions {
    /// Bakes of each kind, whose median CPU time counts [default: 5; 1 with --quick]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    repeat: Option<usize>,
    #[command(flatten)]
    scene_options: SceneOptions,
}

#[derive(Debug, Args)]
struct SizeOption {
    /// Texels of every map: N by N, or W by H [default: 256, of spectrum 1024]
    #[arg(long, value_name = "N|WxH", value_parser = fixed_map_resolution, allow_hyphen_values = true)]
    map_resolution: Option<MapResolution>,
}

impl SizeOption {
    fn or_square(&self, side: usize) -> MapResolution {
        self.map_resolution.unwrap_or(MapResolution::Fixed {
            width: side,
            height: side,
        })
    }
}

/// Studies of built-in scenes, by name.
#[derive(Debug)]
struct BuiltStudy {
    name: String,
    common: Common,
}

#[derive(Debug, Args)]
struct ConvergenceArguments {
    /// .glb, .gltf or builtin:NAME
    #[arg(default_value = "builtin:ring")]
    scene: String,
    /// Estimators to measure [default: all]
    #[arg(long, value_parser = values::one_of::<Estimator>(), value_delimiter = ',', value_name = "ESTIMATOR,...")]
    estimators: Option<Vec<Estimator>>,
    /// Ascending light rays per steradian [default: 1e2 to 1e6, two a decade]
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "RAYS_PER_SR,...",
        allow_negative_numbers = true
    )]
    densities: Option<Vec<f64>>,
    /// Map to measure against, .exr or .pfm [default: the shipped one of a built-in scene, else a much denser bake]
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// Surface of the reference [default: floor, or the only one that takes light]
    #[arg(long, value_name = "NAME", requires = "reference")]
    surface: Option<String>,
    #[command(flatten)]
    size: SizeOption,
    #[command(flatten)]
    bakes: BakesOptions,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Args)]
struct ReferenceArguments {
    /// .glb, .gltf or builtin:NAME
    scene: String,
    /// Light rays, such as 1e8
    #[arg(long, value_name = "N", value_parser = ray_count, allow_hyphen_values = true)]
    rays: u64,
    #[command(flatten)]
    size: SizeOption,
    /// Seed of the rays
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    scene_options: SceneOptions,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Args)]
struct EffectsArguments {
    /// .glb, .gltf or builtin:NAME
    scene: String,
    #[command(flatten)]
    bakes: BakesOptions,
    #[command(flatten)]
    bake: BakeOptions,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Args)]
struct SpectrumArguments {
    /// .glb, .gltf or builtin:NAME; of a scene with thin beams, those alone shine
    #[arg(default_value = "builtin:spectrum")]
    scene: String,
    /// Numbers of wavelengths
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "N,...",
        default_value = "1,4,7,13",
        allow_negative_numbers = true
    )]
    wavelengths: Vec<u32>,
    /// Light rays per steradian; beams are thin [default: 1e8]
    #[arg(long, value_name = "RAYS_PER_SR", allow_negative_numbers = true)]
    density: Option<f64>,
    #[command(flatten)]
    size: SizeOption,
    #[command(flatten)]
    bakes: BakesOptions,
    #[command(flatten)]
    common: Common,
}

/// `N` (square) or `WxH` [texels].
fn fixed_map_resolution(text: &str) -> std::result::Result<MapResolution, String> {
    match text.parse() {
        Ok(fixed @ MapResolution::Fixed { .. }) => Ok(fixed),
        _ => Err("give N or WxH in texels, such as 512 or 512x256".to_string()),
    }
}

/// A number of rays, `250000` or `2.5e5`.
fn ray_count(text: &str) -> std::result::Result<u64, String> {
    let rays = text.parse::<f64>().ok().filter(|rays| (1.0..1e18).contains(rays));
    rays.map(|rays| rays as u64)
        .ok_or_else(|| "give a number of rays, such as 1e8".to_string())
}

impl Subcommand for BuiltStudy {
    fn augment_subcommands(command: clap::Command) -> clap::Command {
        let names = studies::STUDIES.iter().map(|study| (study.name, study.what));
        names.chain([ALL]).fold(command, |command, (name, what)| {
            command.subcommand(Common::augment_args(clap::Command::new(name).about(what)))
        })
    }

    fn augment_subcommands_for_update(command: clap::Command) -> clap::Command {
        Self::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        name == ALL.0 || studies::STUDIES.iter().any(|study| study.name == name)
    }
}

impl FromArgMatches for BuiltStudy {
    fn from_arg_matches(matches: &ArgMatches) -> std::result::Result<Self, clap::Error> {
        let missing = || clap::Error::new(clap::error::ErrorKind::MissingSubcommand);
        let (name, matches) = matches.subcommand().ok_or_else(missing)?;
        Ok(Self {
            name: name.into(),
            common: Common::from_arg_matches(matches)?,
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> std::result::Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl StudyArguments {
    pub fn run_options(&self) -> &RunOptions {
        match &self.study {
            None => &self.run,
            Some(Study::Convergence(study)) => &study.common.run,
            Some(Study::Reference(study)) => &study.common.run,
            Some(Study::Effects(study)) => &study.common.run,
            Some(Study::Spectrum(study)) => &study.common.run,
            Some(Study::Built(study)) => &study.common.run,
        }
    }

    /// Checks the arguments, measures, writes, and prints what was found.
    ///
    /// # Errors
    /// No study is named; a value outside its range; input, output or a bake that failed; stopped before the end, which
    /// writes nothing of the study that it was at.
    pub fn run(&self, console: &Console) -> Result<()> {
        let desk = Desk { console };
        match &self.study {
            None if self.list => list(console),
            None => Err(Error::usage(
                "study",
                "no study is named",
                "name one, or use --list to see which there are",
            )),
            Some(Study::Convergence(study)) => desk.convergence(study),
            Some(Study::Reference(study)) => desk.reference(study),
            Some(Study::Effects(study)) => desk.effects(study),
            Some(Study::Spectrum(study)) => desk.spectrum(study),
            Some(Study::Built(study)) if study.name == ALL.0 => desk.all(&study.common),
            Some(Study::Built(study)) => desk.built(study),
        }
    }
}

fn list(console: &Console) -> Result<()> {
    let own = [CONVERGENCE, REFERENCE, EFFECTS, SPECTRUM, ALL].into_iter();
    let built = studies::STUDIES.iter().map(|study| (study.name, study.what));
    let all: Vec<_> = own.chain(built).collect();
    let text: String = all
        .iter()
        .map(|(name, what)| format!("{name:<12} {what}\n"))
        .collect();
    let lines: Vec<_> = all
        .iter()
        .map(|(name, what)| json!({"name": name, "what": what}))
        .collect();
    console.print_result(&text, &lines)
}

/// Where studies are told of and stopped.
#[derive(Clone, Copy)]
struct Desk<'a> {
    console: &'a Console,
}

/// The result of a study, as `--json` prints it.
#[derive(Serialize)]
struct Report {
    study: &'static str,
    folder: String,
    files: Vec<String>,
    table: Table,
    costs: Table,
}

impl Desk<'_> {
    fn convergence(self, study: &ConvergenceArguments) -> Result<()> {
        let settings = BakeSettings {
            map_resolution: study.size.or_square(SIDE),
            threads: study.common.run.threads()?,
            ..BakeSettings::of(Estimator::Wavefront)
        };
        let few = if study.common.quick {
            QUICK_DENSITIES
        } else {
            DENSITIES.len()
        };
        let densities = study.densities.as_deref().unwrap_or(&DENSITIES[..few]);
        check_ladder(densities, &settings)?;
        let mut estimators = study
            .estimators
            .clone()
            .unwrap_or_else(|| vec![Estimator::Wavefront, Estimator::Splat]);
        estimators.dedup();
        let repeats = repeats(study.bakes.repeat, &study.common)?;
        let scene = self.load(&study.scene, &study.bakes.scene_options)?;
        let make = || {
            let reference = match &study.reference {
                None => Reference::analytic(&scene)?,
                Some(path) => {
                    let (grid, _) = read_luminance(path, None)?;
                    let kind = format!("file {}", path.display());
                    Some(Reference::of_surface(
                        &scene,
                        study.surface.as_deref(),
                        grid,
                        kind,
                    )?)
                }
            };
            let sweep = one_scene::convergence(&scene, &settings, &estimators, densities, reference);
            Ok(Sweep { repeats, ..sweep })
        };
        self.tell(&self.study(CONVERGENCE.0, &study.common, &study.common.output, |_| make())?)
    }

    fn effects(self, study: &EffectsArguments) -> Result<()> {
        let settings = study
            .bake
            .settings(&[LayerKind::Caustic], study.common.run.threads()?)?;
        if settings.max_time_s.is_some() {
            return Err(Error::usage(
                "--max-time",
                "bakes that a clock ends do not differ by their effects alone",
                "leave it out, or use --max-error or --density",
            ));
        }
        let repeats = repeats(study.bakes.repeat, &study.common)?;
        let scene = self.load(&study.scene, &study.bakes.scene_options)?;
        let make = |_: &Bench| {
            let sweep = one_scene::effects(&scene, &settings)?;
            Ok(Sweep { repeats, ..sweep })
        };
        let told = self.study(EFFECTS.0, &study.common, &study.common.output, make)?;
        for effect in Effect::ALL {
            let picture = format!("difference_{}.png", effect.name());
            if !told.1.files.contains(&picture) {
                // An earlier study of this folder may have had the effect.
                files::remove_file(&study.common.output.join(picture))?;
            }
        }
        self.tell(&told)
    }

    fn spectrum(self, study: &SpectrumArguments) -> Result<()> {
        let settings = BakeSettings {
            map_resolution: study.size.or_square(SPECTRUM_SIDE),
            density_per_sr: study.density.unwrap_or(BEAM_DENSITY_PER_SR),
            threads: study.common.run.threads()?,
            ..BakeSettings::of(Estimator::Wavefront)
        };
        for &count in &study.wavelengths {
            let way = BakeSettings {
                wavelengths: Wavelengths::Fixed(count),
                ..settings.clone()
            };
            way.validate()?;
        }
        let repeats = repeats(study.bakes.repeat, &study.common)?;
        let scene = self.load(&study.scene, &study.bakes.scene_options)?;
        let make = |_: &Bench| {
            let sweep = one_scene::spectrum(&scene, &settings, &study.wavelengths)?;
            Ok(Sweep { repeats, ..sweep })
        };
        self.tell(&self.study(SPECTRUM.0, &study.common, &study.common.output, make)?)
    }

    fn built(self, study: &BuiltStudy) -> Result<()> {
        let found = studies::STUDIES.iter().find(|known| known.name == study.name);
        let found = found.ok_or_else(|| Error::usage("study", "there is no such study", "use --list"))?;
        let make = |bench: &Bench| found.sweep(bench);
        self.tell(&self.study(found.name, &study.common, &study.common.output, make)?)
    }

    /// Each is told as soon as it is done, but for JSON, which is one document.
    fn all(self, common: &Common) -> Result<()> {
        let mut reports = Vec::new();
        for study in &studies::STUDIES {
            let folder = common.output.join(study.name);
            let told = self.study(study.name, common, &folder, |bench| study.sweep(bench))?;
            if !self.console.json {
                self.tell(&told)?;
            }
            reports.push(told.1);
        }
        match self.console.json {
            true => self.console.print_result("", &reports),
            false => Ok(()),
        }
    }

    /// Runs it and writes its files.
    fn study(
        self,
        name: &'static str,
        common: &Common,
        output: &Path,
        make: impl FnOnce(&Bench) -> Result<Sweep>,
    ) -> Result<(String, Report)> {
        let folder = open_folder(output, common.force, &format!("{name}.csv"))?;
        let bar = self.console.bar();
        let bench = Bench {
            quick: common.quick,
            threads: common.run.threads()?,
            progress: &bar,
            control: self.console.control(),
        };
        let outcome: Outcome = make(&bench)?.run(&bench)?;
        drop(bar);
        let mut report = Report {
            study: name,
            folder: output.display().to_string(),
            files: Vec::new(),
            table: outcome.table.clone(),
            costs: outcome.costs.clone(),
        };
        for (file, bytes) in outcome.files()? {
            files::write_atomically(&folder.path().join(&file), |writer| writer.write_all(&bytes))?;
            report.files.push(file);
        }
        let files = report.files.join(", ");
        Ok((
            format!("folder {}: {files}\n\n{}", report.folder, outcome.tables()),
            report,
        ))
    }

    fn tell(self, (text, report): &(String, Report)) -> Result<()> {
        self.console.print_result(text, report)
    }

    /// Traces, writes the maps, and says how noisy they are.
    fn reference(self, study: &ReferenceArguments) -> Result<()> {
        let settings = BakeSettings {
            map_resolution: study.size.or_square(SIDE),
            seed: study.seed,
            threads: study.common.run.threads()?,
            ..BakeSettings::default()
        };
        settings.validate()?;
        check_rays(study.rays)?;
        let scene = self.load(&study.scene, &study.scene_options)?;
        if (0..scene.objects.len()).any(|object| scene.material_of(object).is_dispersive()) {
            self.console.warn(&[Warning::new(
                &scene.source,
                "brute force bends light of all wavelengths alike, as at 587.56 nm",
                "compare its maps with those of a bake with --effects dispersion=off",
            )]);
        }
        let output = &study.common.output;
        let folder = MapFolder::open(output, study.common.force)?;
        self.console.check(&scene.source)?;
        let tracer = Tracer::new(scene.clone());
        let (bar, control) = (self.console.bar(), self.console.control());
        let result = brute_force(&tracer, &settings, study.rays, &bar, control)?;
        drop(bar);
        let maps = folder.write(&scene, &settings, &result)?.maps;
        let (rays, cpu_s, noise) = (
            result.counts.rays,
            result.cpu_s.total,
            relative_noise(&result.maps),
        );
        let mut text = format!("folder {}\n", output.display());
        for map in &maps {
            let noise = 100.0 * map.estimated_relative_rmse.unwrap_or(0.0);
            let _ = writeln!(text, "map {} of {}, noise {noise:.3} %", map.file, map.surface);
        }
        let told = noise.map_or("nothing arrived".into(), |noise| {
            format!("noise {:.3} % of the mean over all maps", 100.0 * noise)
        });
        text += &format!("{rays} rays, {cpu_s:.2} s of CPU, {told}");
        let report = json!({
            "method": "brute force: random rays, one per cell of two lattices; each arrival's flux into its texel",
            "rays": rays,
            "noise": noise,
            "cpu_s": cpu_s,
            "maps": maps,
        });
        let path = output.join("reference.json");
        let json = files::to_json(&report, &path.display().to_string())?;
        files::write_atomically(&path, |writer| writer.write_all(&json))?;
        self.console.print_result(&text, &report)
    }

    fn load(self, source: &str, options: &SceneOptions) -> Result<Arc<Scene>> {
        Ok(LoadedScene::load(source, &options.load_options(false), true, self.console)?.scene)
    }
}

fn repeats(asked: Option<usize>, common: &Common) -> Result<usize> {
    match asked {
        None => Ok(if common.quick { 1 } else { REPEATS }),
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

/// A folder that is empty, holds the `table` of an earlier study, or is taken by force.
///
/// # Errors
/// A place that cannot be written; other people's files in it.
fn open_folder(path: &Path, force: bool, table: &str) -> Result<OutputFolder> {
    let folder = OutputFolder::open(path)?;
    if force || path.join(table).is_file() || folder.is_empty()? {
        return Ok(folder);
    }
    Err(Error::failure(
        path.display().to_string(),
        "the folder holds files that are not from a study",
        "choose another folder or add --force",
    ))
}
