//! A study as data, and its runner: bakes, references, a table, plots and pictures.

use std::sync::Arc;

use super::cost::{cost_of, slope};
use super::picture::{self, Image, Picture};
use super::plot::{Curve, Plot};
use super::references::{Reference, Truth, lit_side};
use super::table::{Cell, Table};
use crate::bake::{Bake, Baker};
use crate::error::{Error, Result};
use crate::export::picture::encode;
use crate::illumination::compare::{Agreement, TexelPair};
use crate::illumination::difference::{self, Difference};
use crate::progress::{Control, Progress};
use crate::scene::{Camera, Scene};
use crate::settings::{BakeSettings, MapResolution};

/// Errors whose costs are tabulated.
const TARGETS: [(&str, f64); 3] = [("5 %", 0.05), ("2 %", 0.02), ("1 %", 0.01)];

/// How a study is run.
#[derive(Clone, Copy)]
pub struct Bench<'a> {
    /// Small maps and few variants: checks that the study runs, not what it finds.
    pub quick: bool,
    /// Worker threads; 0 = one per core.
    pub threads: usize,
    pub progress: &'a dyn Progress,
    pub control: &'a Control,
}

#[derive(Clone, Debug, Default)]
pub struct Sweep {
    /// Name on the command line and of its files.
    pub name: &'static str,
    /// Purpose, in one line.
    pub what: &'static str,
    /// Description: what is measured, on which scenes, with which settings.
    pub note: String,
    /// Columns that identify a variant.
    pub labels: &'static [&'static str],
    /// Columns that are measured.
    pub columns: &'static [Column],
    /// In row order.
    pub groups: Vec<Group>,
    /// Bakes per variant; the median of their CPU times counts. 0 means 1.
    pub repeats: usize,
    /// Each plots two columns.
    pub plots: &'static [Plot],
    /// Maps per row of a sheet.
    pub sheet_columns: usize,
}

/// Variants that share a reference.
#[derive(Clone, Debug)]
pub struct Group {
    pub against: Against,
    /// At least one.
    pub variants: Vec<Variant>,
}

/// Source of a reference.
#[derive(Clone, Debug)]
pub enum Against {
    Nothing,
    /// A known map.
    Known(Reference),
    /// All maps of another bake. If that has a target error and stops before it is met, there is no reference.
    Bake(Arc<Scene>, Box<BakeSettings>),
}

/// One row of the table.
#[derive(Clone, Debug)]
pub struct Variant {
    /// One per label of the sweep.
    pub labels: Vec<Cell>,
    pub scene: Arc<Scene>,
    pub settings: BakeSettings,
    /// Transforms the bake before it is measured.
    pub estimate: Option<fn(&Variant, Bake) -> Bake>,
    /// Views of the baked scene: file name without `.png`, and camera.
    pub views: Vec<(String, Camera)>,
    /// Sheet that its map is added to; each sheet starts with the reference.
    pub sheet: Option<String>,
    /// File of the picture that shows where the reference has more and less light.
    pub difference: Option<String>,
}

impl Variant {
    /// A bake without pictures.
    pub fn new(labels: Vec<Cell>, scene: &Arc<Scene>, settings: BakeSettings) -> Self {
        Self {
            labels,
            scene: Arc::clone(scene),
            settings,
            estimate: None,
            views: Vec::new(),
            sheet: None,
            difference: None,
        }
    }

    /// Adds its map to a sheet.
    #[must_use]
    pub fn in_sheet(self, file: impl Into<String>) -> Self {
        let sheet = Some(file.into());
        Self { sheet, ..self }
    }

    /// Adds a view of the baked scene.
    #[must_use]
    pub fn seen(mut self, file: impl Into<String>, camera: &Camera) -> Self {
        self.views.push((file.into(), camera.clone()));
        self
    }

    fn caption(&self) -> String {
        let words: Vec<String> = self.labels.iter().map(Cell::rounded).collect();
        words.join(", ")
    }
}

#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Includes the unit, if there is one.
    pub name: &'static str,
    /// Its value for one variant.
    pub value: fn(&Measured) -> Cell,
}

/// A bake and its reference.
pub struct Measured<'a> {
    pub variant: &'a Variant,
    /// The first of its bakes.
    pub result: &'a Bake,
    pub reference: Option<&'a Reference>,
    /// Texels paired with those of the reference, if they can be.
    pub pairs: &'a [TexelPair],
    /// Agreement of the pairs.
    pub agreement: Option<Agreement>,
    /// CPU time of the light pass [s], the median over all bakes.
    pub cpu_s: f64,
    /// CPU time of the views [s].
    pub eye_pass_cpu_s: Option<f64>,
}

impl Measured<'_> {
    /// Light that the reference has more, over all layers, if it was baked.
    pub fn difference(&self) -> Option<Difference> {
        match &self.reference?.truth {
            Truth::Maps(maps) => difference::difference(maps, &self.result.maps).ok(),
            Truth::Surface { .. } => None,
        }
    }

    fn agreed(&self, value: fn(&Agreement) -> Cell) -> Cell {
        self.agreement.as_ref().map_or(Cell::Empty, value)
    }
}

/// A number, or an empty cell.
pub fn number(value: Option<f64>) -> Cell {
    value.map_or(Cell::Empty, Cell::Number)
}

/// A share, or an empty cell.
pub fn share(value: Option<f64>) -> Cell {
    value.map_or(Cell::Empty, Cell::Share)
}

pub const fn column(name: &'static str, value: fn(&Measured) -> Cell) -> Column {
    Column { name, value }
}

/// Light rays traced.
pub const RAYS: Column = column("rays", |m| m.result.counts.rays.into());
/// Kernels deposited.
pub const SPLATS: Column = column("splats", |m| m.result.counts.splats.into());
/// Squares whose bundles were deposited.
pub const CELLS: Column = column("cells", |m| m.result.counts.cells.into());
/// CPU time of item buffers, tracing and depositing: the light pass without the hierarchy.
pub const CPU_S: Column = column("cpu_s", |m| m.cpu_s.into());
/// The same in wall-clock time.
pub const WALL_S: Column = column("wall_s", |m| {
    let times = &m.result.timings_s;
    (times.plan + times.trace + times.deposit).into()
});
/// CPU time of the views, traced on the CPU.
pub const EYE_PASS_CPU_S: Column = column("eye_pass_cpu_s", |m| number(m.eye_pass_cpu_s));
/// Memory of maps, rays and bundles.
pub const MEMORY_MB: Column = column("memory_mb", |m| {
    number(m.result.course.last().map(|point| point.bytes as f64 / 1e6))
});
/// sqrt(mean((I − R)²)) / mean(R).
pub const RELATIVE_RMSE: Column = column("relative_rmse", |m| m.agreed(|a| Cell::Share(a.relative_rmse)));
/// mean(|I − R| / R) over texels with R > 1 % of mean(R).
pub const ARD: Column = column("ard", |m| {
    m.agreed(|a| Cell::Share(a.average_relative_difference))
});
/// max(I) / max(R).
pub const PEAK_RATIO: Column = column("peak_ratio", |m| m.agreed(|a| (a.peak / a.reference_peak).into()));
/// mean(I) / mean(R).
pub const FLUX_RATIO: Column = column("flux_ratio", |m| m.agreed(|a| a.flux_ratio.into()));
/// Kind of the reference R.
pub const REFERENCE: Column = column("reference", |m| {
    m.reference
        .map_or(Cell::Empty, |reference| reference.kind.clone().into())
});

impl Bench<'_> {
    /// Map side [texels]: that of the shipped references, or less for a quick run.
    pub fn side(&self) -> usize {
        if self.quick { 64 } else { 256 }
    }

    /// All values or, for a quick run, the first few.
    pub fn some<'v, T>(&self, values: &'v [T], few: usize) -> &'v [T] {
        &values[..if self.quick {
            few.min(values.len())
        } else {
            values.len()
        }]
    }

    /// Settings with maps of the given side.
    pub fn at(&self, settings: BakeSettings, side: usize) -> BakeSettings {
        BakeSettings {
            map_resolution: MapResolution::Fixed {
                width: side,
                height: side,
            },
            ..settings
        }
    }

    /// Bakes in a new session, so that no bake reuses the work of another.
    fn bake(&self, scene: &Arc<Scene>, settings: &BakeSettings) -> Result<Bake> {
        let threads = if settings.threads == 0 {
            self.threads
        } else {
            settings.threads
        };
        let settings = BakeSettings {
            threads,
            ..settings.clone()
        };
        let result = Baker::new(Arc::clone(scene))?.bake(&settings, self.progress, self.control)?;
        if result.partial {
            return Err(Error::cancelled(&scene.source));
        }
        Ok(result)
    }
}

impl Against {
    fn reference(&self, bench: &Bench) -> Result<Option<Reference>> {
        match self {
            Self::Nothing => Ok(None),
            Self::Known(reference) => Ok(Some(reference.clone())),
            Self::Bake(scene, settings) => {
                let result = bench.bake(scene, settings)?;
                let is_met = |target| {
                    result
                        .estimated_relative_rmse
                        .is_some_and(|error| error <= target)
                };
                if !settings.max_error.is_none_or(is_met) {
                    return Ok(None);
                }
                let estimator: &str = settings.estimator.into();
                Ok(Some(Reference {
                    kind: format!("a bake by {estimator}, {} rays", result.counts.rays),
                    truth: Truth::Maps(result.maps),
                }))
            }
        }
    }
}

/// CPU time of the light pass without the hierarchy [s].
fn light_pass_cpu_s(result: &Bake) -> f64 {
    result.cpu_s.plan + result.cpu_s.trace + result.cpu_s.deposit
}

#[derive(Clone, Debug)]
pub struct StudyResult {
    pub name: &'static str,
    what: &'static str,
    note: String,
    threads: usize,
    /// One row per variant.
    pub table: Table,
    /// Costs of errors, curve by curve; empty if no error is plotted.
    pub costs: Table,
    plots: Vec<(&'static Plot, Vec<Curve>)>,
    pictures: Vec<Picture>,
}

impl Sweep {
    /// Bakes and measures every variant.
    ///
    /// # Errors
    /// Errors of a bake; a reference that does not fit; cancellation.
    pub fn run(&self, bench: &Bench) -> Result<StudyResult> {
        // Labels of variants come before what is measured on them.
        let mut table = Table {
            columns: self.labels.to_vec(),
            rows: Vec::new(),
        };
        table
            .columns
            .extend(self.columns.iter().map(|column| column.name));

        // A reference may be a long bake, so that the variants of a group share it.
        let (mut pictures, mut sheets) = (Vec::new(), Vec::new());
        for group in &self.groups {
            let reference = group.against.reference(bench)?;
            for variant in &group.variants {
                let row = self.row(bench, variant, reference.as_ref(), &mut pictures, &mut sheets)?;
                table.rows.push(row);
            }
        }

        // Sheets compare maps of several variants, so that they are drawn once all are baked.
        for (file, images, captions) in sheets {
            let captions = format!("In rows of {}: {captions}.", self.sheet_columns);
            pictures.extend(picture::sheet(file, captions, &images, self.sheet_columns));
        }

        // A curve connects rows, so that plots need the whole table.
        let curves = |plot: &'static Plot| (plot, plot.curves(&table));
        let plots: Vec<_> = self.plots.iter().map(curves).collect();
        Ok(StudyResult {
            name: self.name,
            what: self.what,
            note: self.note.clone(),
            threads: bench.threads,
            costs: costs(&plots),
            table,
            plots,
            pictures,
        })
    }

    fn row(
        &self,
        bench: &Bench,
        variant: &Variant,
        reference: Option<&Reference>,
        pictures: &mut Vec<Picture>,
        sheets: &mut Vec<Sheet>,
    ) -> Result<Vec<Cell>> {
        // The median of several bakes is robust against other work of the machine.
        let mut result = bench.bake(&variant.scene, &variant.settings)?;
        let mut cpu_s = vec![light_pass_cpu_s(&result)];
        for _ in 1..self.repeats {
            cpu_s.push(light_pass_cpu_s(&bench.bake(&variant.scene, &variant.settings)?));
        }
        cpu_s.sort_by(f64::total_cmp);
        if let Some(estimate) = variant.estimate {
            result = estimate(variant, result);
        }

        // Views show the maps that are measured.
        let mut eye_pass_cpu_s = None;
        for (file, camera) in &variant.views {
            let request = (file.clone(), variant.caption());
            let (picture, cpu_s) = picture::view(bench, request, (&variant.scene, &result.maps), camera)?;
            pictures.push(picture);
            *eye_pass_cpu_s.get_or_insert(0.0) += cpu_s;
        }

        // A variant may transform its maps, so that it is compared after that.
        let pairs = pairs(reference, &result)?;
        let measured = Measured {
            variant,
            result: &result,
            reference,
            pairs: &pairs,
            agreement: Agreement::of(&pairs),
            // The lower median of an even number.
            cpu_s: cpu_s[(cpu_s.len() - 1) / 2],
            eye_pass_cpu_s,
        };

        // Pictures of differences stand alone, maps are collected in sheets.
        if let Some((file, found)) = variant.difference.clone().zip(measured.difference()) {
            pictures.extend(picture::difference(file, variant.caption(), &found));
        }
        if let Some(file) = &variant.sheet {
            show(sheets, file, variant, reference, &result);
        }
        let labels = variant.labels.iter().cloned();
        Ok(labels
            .chain(self.columns.iter().map(|column| (column.value)(&measured)))
            .collect())
    }
}

/// File, maps and captions of a sheet.
type Sheet = (String, Vec<Image>, String);

/// Adds the map of the reference's surface to a sheet; a new sheet starts with the reference.
fn show(
    sheets: &mut Vec<Sheet>,
    file: &String,
    variant: &Variant,
    reference: Option<&Reference>,
    result: &Bake,
) {
    let Some((object, truth)) = reference.and_then(Image::of_reference) else {
        return;
    };
    if !sheets.iter().any(|sheet| sheet.0 == *file) {
        sheets.push((file.clone(), vec![truth], "the reference".into()));
    }
    let sheet = sheets.iter_mut().find(|sheet| sheet.0 == *file);
    if let Some((sheet, map)) = sheet.zip(lit_side(&result.maps, object)) {
        sheet.1.push(Image::of_map(map));
        sheet.2 += &format!("; {}", variant.caption());
    }
}

/// Pairs texels with those of the reference. Maps of another bake may differ in size, and then have no pairs.
fn pairs(reference: Option<&Reference>, result: &Bake) -> Result<Vec<TexelPair>> {
    let Some(reference) = reference else {
        return Ok(Vec::new());
    };
    let failed = |what, remedy| Err(Error::failure(&reference.kind, what, remedy));
    match (reference.pairs(&result.maps), &reference.truth) {
        (Some(pairs), Truth::Surface { .. }) if Agreement::of(&pairs).is_none() => failed(
            "the reference is dark, so that nothing can be measured against it",
            "name a reference with light in it",
        ),
        (Some(pairs), _) => Ok(pairs),
        (None, Truth::Maps(_)) => Ok(Vec::new()),
        (None, Truth::Surface { .. }) => failed(
            "its size and that of the maps are not whole multiples of each other",
            "choose another --map-resolution",
        ),
    }
}

/// The power law of each error curve, and where the curve meets the [`TARGETS`].
fn costs(plots: &[(&'static Plot, Vec<Curve>)]) -> Table {
    let mut table = Table {
        columns: vec!["of", "curve", "error_power"],
        rows: Vec::new(),
    };
    table.columns.extend(TARGETS.map(|(name, _)| name));
    let is_cost = |plot: &Plot| plot.shows_error() && ["rays", "cpu_s"].contains(&plot.x);
    for (plot, curves) in plots.iter().filter(|(plot, _)| is_cost(plot)) {
        for curve in curves {
            let mut row = vec![
                plot.x.into(),
                curve.name.clone().into(),
                number(slope(&curve.points)),
            ];
            row.extend(TARGETS.map(|(_, target)| match cost_of(&curve.points, target) {
                Some(cost) => cost.to_string().into(),
                None => Cell::Empty,
            }));
            table.rows.push(row);
        }
    }
    table
}

impl StudyResult {
    /// The files of the study, by name: table, plots, pictures, and the page that shows them.
    ///
    /// # Errors
    /// A plot or picture that cannot be encoded.
    pub fn files(&self) -> Result<Vec<(String, Vec<u8>)>> {
        let mut files = vec![(format!("{}.csv", self.name), self.table.csv().into_bytes())];
        for (plot, curves) in &self.plots {
            files.push((format!("{}.svg", plot.file), plot.svg(curves)?.into_bytes()));
        }
        for picture in &self.pictures {
            let ((width, height), rgba) = (picture.size, picture.rgba.clone());
            let bytes = encode(width, height, rgba, &picture.file)?;
            files.push((format!("{}.png", picture.file), bytes));
        }
        files.push((format!("{}.md", self.name), self.page().into_bytes()));
        Ok(files)
    }

    /// The tables as Markdown.
    pub fn tables(&self) -> String {
        let mut text = self.table.markdown();
        if !self.costs.rows.is_empty() {
            text += "\nWhat errors cost (error ~ x^power; ~ extrapolated, < already with the least):\n\n";
            text += &self.costs.markdown();
        }
        text
    }

    /// The page: description, tables, and links to the other files.
    fn page(&self) -> String {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = if self.threads == 0 { cores } else { self.threads };
        let build = if cfg!(debug_assertions) {
            "debug"
        } else {
            "release"
        };
        let mut text = format!(
            "# Study `{}`: {}\n\n{}\n\nNephroid {} ({build}) on {} {}, {cores} cores, {threads} threads. `cpu_s` is of the light \
             pass, over all threads.\n\n{}",
            self.name,
            self.what,
            self.note,
            env!("CARGO_PKG_VERSION"),
            std::env::consts::ARCH,
            std::env::consts::OS,
            self.tables()
        );
        for (plot, _) in &self.plots {
            text += &format!("\n![{} against {}]({}.svg)\n", plot.y, plot.x, plot.file);
        }
        for picture in &self.pictures {
            text += &format!("\n![{0}]({1}.png)\n\n{0}\n", picture.caption, picture.file);
        }
        text
    }
}
