//! `study`: which there are, what accuracy costs, and references by brute force.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use nephroid::error::{Error, Result};
use nephroid::export::manifest::MapEntry;
use nephroid::export::map_folder::MapFolder;
use nephroid::files::{self, OutputFolder};
use nephroid::scene::Scene;
use nephroid::study::brute_force::{brute_force, relative_noise};
use nephroid::study::convergence::{self, Axis, Measurement, Price};
use nephroid::study::cost::{self, Cost};
use nephroid::study::pages::STUDIES as PAGES;
use nephroid::study::plot::convergence_svg;
use nephroid::study::references::Reference;
use nephroid::transport::Tracer;
use serde::Serialize;

use super::args::ALL_PAGES;
use super::compare::read_luminance;
use super::interrupt::Interrupt;
use super::progress_bar::StageBar;
use super::scene_input::SceneInput;
use super::study_jobs::{ConvergenceJob, ReferenceJob};
use super::terminal::Terminal;

/// Name and one line of each study that is no page.
const STUDIES: [(&str, &str); 6] = [
    (
        "convergence",
        "error against light rays and CPU time, for every estimator",
    ),
    (
        "reference",
        "maps by brute force, one texel per ray, with their noise",
    ),
    (
        "effects",
        "what each effect costs and what it is worth, by bakes with and without it",
    ),
    (
        "spectrum",
        "split and stochastic rays, few wavelengths, many and all: how right and how dear",
    ),
    (
        "stability",
        "hard cases, each with a law that must hold, how far off it is and its bound",
    ),
    (ALL_PAGES, "all that follow, each in a folder of its name"),
];

const CSV: &str = "convergence.csv";
const SVG: &str = "convergence.svg";
const REFERENCE: &str = "reference.json";

/// Names all studies.
///
/// # Errors
/// A stdout that cannot be written.
pub fn list(terminal: &Terminal) -> Result<()> {
    #[derive(Serialize)]
    struct Line {
        name: &'static str,
        what: &'static str,
    }
    let pages = PAGES.iter().map(|study| (study.name, study.what));
    let studies: Vec<(&'static str, &'static str)> = STUDIES.into_iter().chain(pages).collect();
    let lines: Vec<Line> = studies.iter().map(|&(name, what)| Line { name, what }).collect();
    let text: Vec<String> = studies
        .iter()
        .map(|(name, what)| format!("{name:<12} {what}"))
        .collect();
    terminal.print_result(&text.join("\n"), &lines)
}

/// Measures, writes the table and the plot, and says what errors cost.
///
/// # Errors
/// Input, output or a bake that failed; stopped before the end, which writes nothing.
pub fn convergence(job: &ConvergenceJob, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
    let scene = load(&job.scene, terminal)?;
    let folder = open_folder(&job.output, job.force, CSV)?;
    let bar = StageBar::new(terminal);
    let reference = match &job.reference {
        Some(path) => file_reference(path, job.surface.as_deref(), &scene)?,
        None => match Reference::analytic(&scene)? {
            Some(reference) => reference,
            None => convergence::self_reference(&scene, &job.ladder, &bar, interrupt.control())?,
        },
    };
    let measurements = convergence::measure(&scene, &job.ladder, &reference, &bar, interrupt.control())?;
    drop(bar);
    let title = format!("{} against {}", scene.source, reference.kind);
    let svg = convergence_svg(&measurements, &title)?;
    let csv = csv_of(CSV, &measurements)?;
    write(&folder, CSV, &csv)?;
    write(&folder, SVG, svg.as_bytes())?;
    let report = Report::new(&job.output, &reference, measurements);
    terminal.print_result(&report.text(), &report)
}

/// Traces, writes the maps, and says how noisy they are.
///
/// # Errors
/// Input, output or a run that failed; stopped before the end, which writes nothing.
pub fn reference(job: &ReferenceJob, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
    let scene = load(&job.scene, terminal)?;
    let folder = MapFolder::open(&job.output, job.force)?;
    interrupt.check(&scene.source)?;
    let tracer = Tracer::new(scene.clone());
    let bar = StageBar::new(terminal);
    let result = brute_force(&tracer, &job.settings, job.rays, &bar, interrupt.control())?;
    drop(bar);
    let document = ReferenceReport {
        method: "brute force: random rays, one per cell of two lattices; each arrival's flux into its texel",
        rays: result.counts.rays,
        noise: relative_noise(&result.maps),
        cpu_s: result.cpu_s.total,
        maps: folder.write(&scene, &job.settings, &result)?.maps,
    };
    let path = job.output.join(REFERENCE);
    let json = serde_json::to_vec_pretty(&document).map_err(|error| no_json(&path, &error))?;
    files::write_atomically(&path, |writer| writer.write_all(&json))?;
    terminal.print_result(&document.text(&job.output), &document)
}

/// Loads a scene and prints its warnings.
///
/// # Errors
/// A scene that cannot be read, or has no light where one is needed.
pub fn load(input: &SceneInput, terminal: &Terminal) -> Result<Arc<Scene>> {
    let scene = Arc::new(input.load()?);
    terminal.print_warnings(&scene.warnings);
    Ok(scene)
}

fn file_reference(path: &Path, surface: Option<&str>, scene: &Scene) -> Result<Reference> {
    let (grid, _) = read_luminance(path, None)?;
    Reference::of_surface(scene, surface, grid, format!("file {}", path.display()))
}

/// A folder that is empty, holds the `table` of an earlier study, or is taken by force.
///
/// # Errors
/// A place that cannot be written; other people's files in it.
pub fn open_folder(path: &Path, force: bool, table: &str) -> Result<OutputFolder> {
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

/// Writes a file of that name in the folder.
///
/// # Errors
/// A disk that is full, a place that cannot be written any more.
pub fn write(folder: &OutputFolder, name: &str, bytes: &[u8]) -> Result<()> {
    files::write_atomically(&folder.path().join(name), |writer| writer.write_all(bytes))
}

/// A table with a header; `name` is named in errors.
///
/// # Errors
/// Rows that no table can hold.
pub fn csv_of(name: &str, rows: impl IntoIterator<Item = impl Serialize>) -> Result<Vec<u8>> {
    let unwritten = |reason: String| {
        Error::failure(
            name,
            format!("the table cannot be written ({reason})"),
            "report this",
        )
    };
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer
            .serialize(row)
            .map_err(|error| unwritten(error.to_string()))?;
    }
    writer.into_inner().map_err(|error| unwritten(error.to_string()))
}

fn no_json(path: &Path, error: &serde_json::Error) -> Error {
    Error::failure(
        path.display().to_string(),
        format!("it is not valid JSON ({error})"),
        "report this",
    )
}

/// The result of `study convergence`, as `--json` prints it.
#[derive(Serialize)]
struct Report {
    folder: String,
    reference: String,
    measurements: Vec<Measurement>,
    costs: Vec<CostLine>,
    /// d ln(error) / d ln(rays) over the whole ladder, by estimator.
    slopes: Vec<(String, Option<f64>)>,
}

/// One line of the table.
#[derive(Serialize)]
struct CostLine {
    estimator: String,
    relative_rmse: f64,
    rays: Option<String>,
    cpu_s: Option<String>,
}

impl Report {
    fn new(folder: &Path, reference: &Reference, measurements: Vec<Measurement>) -> Self {
        let costs = convergence::prices(&measurements).into_iter().map(CostLine::from);
        let costs = costs.collect();
        let slopes = convergence::estimators(&measurements)
            .into_iter()
            .map(|estimator| {
                let curve = convergence::curve(&measurements, estimator, Axis::Rays);
                (estimator.to_string(), cost::slope(&curve))
            })
            .collect();
        Self {
            folder: folder.display().to_string(),
            reference: reference.kind.clone(),
            measurements,
            costs,
            slopes,
        }
    }

    fn text(&self) -> String {
        let mut text = format!(
            "folder {}: {CSV}, {SVG}\nreference {}\n\n",
            self.folder, self.reference
        );
        let _ = writeln!(
            text,
            "{:<10} {:>9} {:>10} {:>10} {:>9} {:>9} {:>8}",
            "estimator", "density", "rays", "CPU s", "RMSE", "ARD", "flux"
        );
        for row in &self.measurements {
            let _ = writeln!(
                text,
                "{:<10} {:>9.2e} {:>10} {:>10.4} {:>7.3} % {:>7.3} % {:>8.5}",
                row.estimator,
                row.density,
                row.rays,
                row.cpu_light_pass_s,
                100.0 * row.relative_rmse,
                100.0 * row.ard,
                row.flux_ratio
            );
        }
        let _ = writeln!(
            text,
            "\n{:<10} {:>6} {:>10} {:>10}",
            "estimator", "RMSE", "rays", "CPU s"
        );
        let never = |cost: &Option<String>| cost.clone().unwrap_or_else(|| "never".into());
        for line in &self.costs {
            let _ = writeln!(
                text,
                "{:<10} {:>4} % {:>10} {:>10}",
                line.estimator,
                100.0 * line.relative_rmse,
                never(&line.rays),
                never(&line.cpu_s)
            );
        }
        for (estimator, slope) in &self.slopes {
            let slope = slope.map_or("undefined".into(), |slope| format!("{slope:.2}"));
            let _ = writeln!(text, "{estimator}: error ~ rays^{slope}");
        }
        text + "~ extrapolated, < already at the first density"
    }
}

impl From<Price> for CostLine {
    fn from(price: Price) -> Self {
        let text = |cost: Option<Cost>| cost.map(|cost| cost.to_string());
        Self {
            estimator: price.estimator,
            relative_rmse: price.target,
            rays: text(price.rays),
            cpu_s: text(price.cpu_s),
        }
    }
}

/// `reference.json`.
#[derive(Serialize)]
struct ReferenceReport {
    method: &'static str,
    rays: u64,
    /// Standard error over the mean, over all maps.
    noise: Option<f64>,
    cpu_s: f64,
    maps: Vec<MapEntry>,
}

impl ReferenceReport {
    fn text(&self, folder: &Path) -> String {
        let mut text = format!("folder {}\n", folder.display());
        for map in &self.maps {
            let noise = map.estimated_relative_rmse.unwrap_or(0.0);
            let _ = writeln!(
                text,
                "map {} of {}, noise {:.3} %",
                map.file,
                map.surface,
                100.0 * noise
            );
        }
        let noise = self.noise.map_or("nothing arrived".into(), |noise| {
            format!("noise {:.3} % of the mean over all maps", 100.0 * noise)
        });
        text + &format!("{} rays, {:.2} s of CPU, {noise}", self.rays, self.cpu_s)
    }
}
