//! `study`: lists and runs the studies.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::{ArgMatches, Args, FromArgMatches, Subcommand};
use nephroid::effect::Effect;
use nephroid::error::{Error, Result, Warning};
use nephroid::export::map_folder::MapFolder;
use nephroid::files::{self, OutputFolder};
use nephroid::illumination::map::estimated_relative_rmse;
use nephroid::scene::Scene;
use nephroid::settings::{BakeSettings, Estimator, LayerKind, MapResolution, Wavelengths};
use nephroid::study::brute_force::{RAYS, brute_force};
use nephroid::study::one_scene::{self, CONVERGENCE, EFFECTS, SPECTRUM};
use nephroid::study::references::Reference;
use nephroid::study::studies::STUDIES;
use nephroid::study::sweep::{Bench, Sweep};
use nephroid::transport::Tracer;
use serde_json::{Value, json};

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

/// Default width and height of maps [texels].
const SIDE: usize = 256;
const SPECTRUM_SIDE: usize = 1024;

/// Default number of bakes of each kind.
const REPEATS: usize = 5;

/// Densities of `convergence` [1/sr]; `--quick` leaves out the last.
const DENSITIES: [f64; 9] = [1e2, 3e2, 1e3, 3e3, 1e4, 3e4, 1e5, 3e5, 1e6];
const QUICK_DENSITIES: usize = 7;

/// Default density for thin beams [1/sr].
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

/// The named study, with the options that all studies share.
#[derive(Debug)]
struct Study {
    kind: Kind,
    common: Common,
}

#[derive(Debug)]
enum Kind {
    Convergence(ConvergenceArguments),
    Reference(ReferenceArguments),
    Effects(EffectsArguments),
    Spectrum(SpectrumArguments),
    /// A study of built-in scenes, by name.
    Built(String),
}

#[derive(Debug, Args)]
struct Common {
    /// Folder for the page (.md), table (.csv), plots and pictures
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Write into a folder that holds other files
    #[arg(long, hide_short_help = true)]
    force: bool,
    /// A coarse run with small maps
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    run: RunOptions,
}

#[derive(Debug, Args)]
struct ConvergenceArguments {
    /// .glb, .gltf or builtin:NAME
    #[arg(default_value = "builtin:ring")]
    scene: String,
    /// Estimators to measure [default: photon,splat]
    #[arg(long, value_parser = values::one_of::<Estimator>(), value_delimiter = ',', value_name = "ESTIMATOR,...")]
    estimators: Option<Vec<Estimator>>,
    /// Ray densities, ascending [default: 1e2 to 1e6]
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "RAYS_PER_SR,...",
        allow_negative_numbers = true
    )]
    densities: Option<Vec<f64>>,
    /// Map to measure against [default: shipped, or a denser bake]
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// Surface of the reference [default: floor]
    #[arg(long, value_name = "NAME", requires = "reference")]
    surface: Option<String>,
    #[command(flatten)]
    size: SizeOption,
    #[command(flatten)]
    repeat: RepeatOption,
    #[command(flatten)]
    scene_options: SceneOptions,
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
}

#[derive(Debug, Args)]
struct EffectsArguments {
    /// .glb, .gltf or builtin:NAME
    scene: String,
    #[command(flatten)]
    repeat: RepeatOption,
    #[command(flatten)]
    scene_options: SceneOptions,
    #[command(flatten)]
    bake: BakeOptions,
}

#[derive(Debug, Args)]
struct SpectrumArguments {
    /// .glb, .gltf or builtin:NAME; thin beams shine alone
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
    /// Rays per steradian [default: 1e8]
    #[arg(long, value_name = "RAYS_PER_SR", allow_negative_numbers = true)]
    density: Option<f64>,
    #[command(flatten)]
    size: SizeOption,
    #[command(flatten)]
    repeat: RepeatOption,
    #[command(flatten)]
    scene_options: SceneOptions,
}

#[derive(Debug, Args)]
struct SizeOption {
    /// Texels of each map [default: 256; spectrum 1024]
    #[arg(long, value_name = "N|WxH", value_parser = fixed_map_resolution, allow_hyphen_values = true)]
    map_resolution: Option<MapResolution>,
}

#[derive(Debug, Args)]
struct RepeatOption {
    /// Bakes for each median of CPU time [default: 5; quick 1]
    #[arg(long, value_name = "N", value_parser = values::within(1..=1000_usize, "bakes"), allow_negative_numbers = true)]
    repeat: Option<usize>,
}

impl SizeOption {
    fn or_square(&self, side: usize) -> MapResolution {
        self.map_resolution.unwrap_or(MapResolution::Fixed {
            width: side,
            height: side,
        })
    }
}

/// Parses `N` (square) or `WxH` [texels].
fn fixed_map_resolution(text: &str) -> std::result::Result<MapResolution, String> {
    match text.parse() {
        Ok(fixed @ MapResolution::Fixed { .. }) => Ok(fixed),
        _ => Err("give N or WxH in texels, such as 512 or 512x256".to_string()),
    }
}

/// Parses a number of rays, `250000` or `2.5e5`.
fn ray_count(text: &str) -> std::result::Result<u64, String> {
    let rays = text.parse().ok().map(|rays: f64| rays as u64);
    let (least, most) = (RAYS.start(), *RAYS.end() as f64);
    rays.filter(|rays| RAYS.contains(rays))
        .ok_or_else(|| format!("give a number of rays from {least} to {most:e}, such as 1e8"))
}

impl Subcommand for Study {
    fn augment_subcommands(command: clap::Command) -> clap::Command {
        type Augment = fn(clap::Command) -> clap::Command;
        let own: [(_, Augment); 5] = [
            (CONVERGENCE, ConvergenceArguments::augment_args),
            (REFERENCE, ReferenceArguments::augment_args),
            (EFFECTS, EffectsArguments::augment_args),
            (SPECTRUM, SpectrumArguments::augment_args),
            (ALL, |command| command),
        ];
        let built = STUDIES.iter().map(|study| ((study.name, study.what), own[4].1));
        own.into_iter()
            .chain(built)
            .fold(command, |command, ((name, what), augment)| {
                command.subcommand(Common::augment_args(augment(
                    clap::Command::new(name).about(what),
                )))
            })
    }

    fn augment_subcommands_for_update(command: clap::Command) -> clap::Command {
        Self::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        all_studies().any(|(known, _)| known == name)
    }
}

impl FromArgMatches for Study {
    fn from_arg_matches(matches: &ArgMatches) -> std::result::Result<Self, clap::Error> {
        let missing = || clap::Error::new(clap::error::ErrorKind::MissingSubcommand);
        let (name, matches) = matches.subcommand().ok_or_else(missing)?;
        Ok(Self {
            kind: match name {
                _ if name == CONVERGENCE.0 => Kind::Convergence(FromArgMatches::from_arg_matches(matches)?),
                _ if name == REFERENCE.0 => Kind::Reference(FromArgMatches::from_arg_matches(matches)?),
                _ if name == EFFECTS.0 => Kind::Effects(FromArgMatches::from_arg_matches(matches)?),
                _ if name == SPECTRUM.0 => Kind::Spectrum(FromArgMatches::from_arg_matches(matches)?),
                _ => Kind::Built(name.into()),
            },
            common: Common::from_arg_matches(matches)?,
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> std::result::Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Name and description of every study.
fn all_studies() -> impl Iterator<Item = (&'static str, &'static str)> {
    let built = STUDIES.iter().map(|study| (study.name, study.what));
    [CONVERGENCE, REFERENCE, EFFECTS, SPECTRUM, ALL]
        .into_iter()
        .chain(built)
}

impl StudyArguments {
    pub fn run_options(&self) -> &RunOptions {
        self.study.as_ref().map_or(&self.run, |study| &study.common.run)
    }

    /// Checks the arguments, measures, writes, and prints the results.
    ///
    /// # Errors
    /// No study is named; a value outside its range; input, output or a bake that fails; cancellation, which discards
    /// the study in progress.
    pub fn run(&self, console: &Console) -> Result<()> {
        let Some(Study { kind, common }) = &self.study else {
            return match self.list {
                true => list(console),
                false => Err(Error::usage(
                    "study",
                    "no study is named",
                    "name one, or use --list to see which there are",
                )),
            };
        };
        let run = StudyRun { common, console };
        match kind {
            Kind::Convergence(study) => run.convergence(study),
            Kind::Reference(study) => run.reference(study),
            Kind::Effects(study) => run.effects(study),
            Kind::Spectrum(study) => run.spectrum(study),
            Kind::Built(name) => run.built(name),
        }
    }
}

fn list(console: &Console) -> Result<()> {
    let lines: Vec<String> = all_studies()
        .map(|(name, what)| format!("{name:<12} {what}"))
        .collect();
    let studies: Vec<Value> = all_studies()
        .map(|(name, what)| json!({"name": name, "what": what}))
        .collect();
    console.print_result(&lines.join("\n"), &studies)
}

/// Result of a study: text, the document for `--json`, and names of files.
struct FinishedStudy {
    text: String,
    report: Value,
    files: Vec<String>,
}

/// Options and console of a study.
#[derive(Clone, Copy)]
struct StudyRun<'a> {
    common: &'a Common,
    console: &'a Console,
}

impl StudyRun<'_> {
    fn convergence(self, study: &ConvergenceArguments) -> Result<()> {
        // Every rung of the ladder is checked before the first bake: the last one may come hours later.
        let settings = self.settings(&study.size, SIDE)?;
        let few = if self.common.quick {
            QUICK_DENSITIES
        } else {
            DENSITIES.len()
        };
        let densities = study.densities.as_deref().unwrap_or(&DENSITIES[..few]);
        check_ladder(densities, &settings)?;

        // Photons are measured beside the splats of the paper unless others are named.
        let usual = || vec![Estimator::Photon, Estimator::Splat];
        let mut estimators = study.estimators.clone().unwrap_or_else(usual);
        estimators.dedup();

        // The error is that against a stated file or the analytic map of the scene, or else a denser bake.
        let scene = self.load(&study.scene, &study.scene_options)?;
        self.one_scene(CONVERGENCE.0, &study.repeat, || {
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
            Ok(one_scene::convergence(
                &scene,
                &settings,
                &estimators,
                densities,
                reference,
            ))
        })?;
        Ok(())
    }

    fn effects(self, study: &EffectsArguments) -> Result<()> {
        let threads = self.common.run.threads();
        let settings = study.bake.settings(&[LayerKind::Caustic], threads)?;
        if settings.max_time_s.is_some() {
            return Err(Error::usage(
                "--max-time",
                "bakes that end by time differ by more than their effects",
                "leave it out, or use --max-error or --density",
            ));
        }
        let scene = self.load(&study.scene, &study.scene_options)?;
        let written = self.one_scene(EFFECTS.0, &study.repeat, || one_scene::effects(&scene, &settings))?;
        for effect in Effect::ALL {
            let picture = format!("difference_{}.png", effect.name());
            if !written.contains(&picture) {
                // An earlier study in this folder may have had the effect.
                files::remove_file(&self.common.output.join(picture))?;
            }
        }
        Ok(())
    }

    fn spectrum(self, study: &SpectrumArguments) -> Result<()> {
        let settings = BakeSettings {
            density_per_sr: study.density.unwrap_or(BEAM_DENSITY_PER_SR),
            ..self.settings(&study.size, SPECTRUM_SIDE)?
        };
        for &count in &study.wavelengths {
            let way = BakeSettings {
                wavelengths: Wavelengths::Fixed(count),
                ..settings.clone()
            };
            way.validate()?;
        }
        let scene = self.load(&study.scene, &study.scene_options)?;
        self.one_scene(SPECTRUM.0, &study.repeat, || {
            one_scene::spectrum(&scene, &settings, &study.wavelengths)
        })?;
        Ok(())
    }

    /// Runs one study or all. Each is printed as soon as it is done; JSON is one document at the end.
    fn built(self, name: &str) -> Result<()> {
        let is_all = name == ALL.0;
        let mut reports = Vec::new();
        for study in STUDIES.iter().filter(|study| is_all || study.name == name) {
            let output = match is_all {
                true => self.common.output.join(study.name),
                false => self.common.output.clone(),
            };
            let done = self.study(study.name, &output, |bench| study.sweep(bench))?;
            if !(is_all && self.console.json) {
                self.console.print_result(&done.text, &done.report)?;
            }
            reports.push(done.report);
        }
        match is_all && self.console.json {
            true => self.console.print_result("", &reports),
            false => Ok(()),
        }
    }

    /// Runs a study, writes and prints it; returns the names of its files.
    fn one_scene(
        self,
        name: &'static str,
        repeat: &RepeatOption,
        make: impl FnOnce() -> Result<Sweep>,
    ) -> Result<Vec<String>> {
        let usual = if self.common.quick { 1 } else { REPEATS };
        let repeats = repeat.repeat.unwrap_or(usual);
        let make = |_: &Bench| Ok(Sweep { repeats, ..make()? });
        let study = self.study(name, &self.common.output, make)?;
        self.console.print_result(&study.text, &study.report)?;
        Ok(study.files)
    }

    /// Runs a study and writes its files.
    fn study(
        self,
        name: &'static str,
        output: &Path,
        make: impl FnOnce(&Bench) -> Result<Sweep>,
    ) -> Result<FinishedStudy> {
        // The folder is opened first, since a study that took hours must not fail for its place.
        let folder = open_folder(output, self.common.force, &format!("{name}.csv"))?;
        let bar = self.console.bar();
        let bench = Bench {
            quick: self.common.quick,
            threads: self.common.run.threads(),
            progress: &bar,
            control: self.console.control(),
        };
        let outcome = make(&bench)?.run(&bench)?;
        drop(bar);

        // Nothing is written before all is measured, so that a cancelled study leaves an earlier one whole.
        let mut files = Vec::new();
        for (file, bytes) in outcome.files()? {
            files::write_atomically(&folder.path().join(&file), |writer| writer.write_all(&bytes))?;
            files.push(file);
        }

        let (folder, tables) = (output.display().to_string(), outcome.tables());
        let text = format!("folder {folder}: {}\n\n{tables}", files.join(", "));
        let report = json!({
            "study": name,
            "folder": folder,
            "files": files,
            "table": outcome.table,
            "costs": outcome.costs,
        });
        Ok(FinishedStudy { text, report, files })
    }

    /// Traces by brute force, writes the maps, and prints their noise.
    fn reference(self, study: &ReferenceArguments) -> Result<()> {
        let settings = BakeSettings {
            seed: study.seed,
            ..self.settings(&study.size, SIDE)?
        };
        settings.validate()?;
        let scene = self.load(&study.scene, &study.scene_options)?;

        // Brute force traces one index of refraction: its maps are no reference for spectra.
        if (0..scene.objects.len()).any(|object| scene.material_of(object).is_dispersive()) {
            self.console.warn(&[Warning::new(
                &scene.source,
                "brute force refracts all wavelengths as at 587.56 nm",
                "compare its maps with those of a bake with --effects dispersion=off",
            )]);
        }

        // Two lattices of random rays each carry half of the flux; their difference tells the noise of the sum.
        let output = &self.common.output;
        let folder = MapFolder::open(output, self.common.force)?;
        self.console.check(&scene.source)?;
        let tracer = Tracer::new(scene.clone());
        let (bar, control) = (self.console.bar(), self.console.control());
        let result = brute_force(&tracer, &settings, study.rays, &bar, control)?;
        drop(bar);

        // The noise is part of the result, since no bake can be measured below it.
        let maps = folder.write(&scene, &settings, &result)?.maps;
        let (rays, cpu_s) = (result.counts.rays, result.cpu_s.total);
        let noise = estimated_relative_rmse(&result.maps);
        let lines = maps.iter().map(|map| {
            let noise = 100.0 * map.estimated_relative_rmse.unwrap_or(0.0);
            format!("map {} of {}, noise {noise:.3} %\n", map.file, map.surface)
        });
        let lines: String = lines.collect();
        let noise_text = noise.map_or("nothing arrived".into(), |noise| {
            format!("noise {:.3} % of the mean over all maps", 100.0 * noise)
        });
        let text = format!(
            "folder {}\n{lines}{rays} rays, {cpu_s:.2} s of CPU, {noise_text}",
            output.display()
        );
        let report = json!({
            "method": "brute force: random rays, one per cell of two lattices; each arrival's flux into its texel",
            "rays": rays,
            "noise": noise,
            "cpu_s": cpu_s,
            "maps": maps,
        });

        // Method and noise are kept beside the maps for those who compare with them later.
        let path = output.join("reference.json");
        let json = files::to_json(&report, &path.display().to_string())?;
        files::write_atomically(&path, |writer| writer.write_all(&json))?;
        self.console.print_result(&text, &report)
    }

    fn settings(self, size: &SizeOption, side: usize) -> Result<BakeSettings> {
        Ok(BakeSettings {
            map_resolution: size.or_square(side),
            threads: self.common.run.threads(),
            ..BakeSettings::default()
        })
    }

    fn load(self, source: &str, options: &SceneOptions) -> Result<Arc<Scene>> {
        Ok(LoadedScene::load(source, &options.load_options(false), true, self.console)?.scene)
    }
}

fn check_ladder(densities: &[f64], settings: &BakeSettings) -> Result<()> {
    if densities.is_empty() || !densities.is_sorted_by(|a, b| a < b) {
        return Err(Error::usage(
            "--densities",
            "they are not in ascending order, each once",
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

/// Opens a folder that is empty or holds the `table` of an earlier study; any folder with `force`.
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
