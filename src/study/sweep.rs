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

/// A bake is no reference where it stopped before it was known as well as this.
const TRUSTED: f64 = 0.01;

/// Errors that costs are given for.
const TARGETS: [(&str, f64); 3] = [("5 %", 0.05), ("2 %", 0.02), ("1 %", 0.01)];

/// Where and how thoroughly a study is done.
#[derive(Clone, Copy)]
pub struct Bench<'a> {
    /// Small maps and few of everything: shows that it works, not what it says.
    pub quick: bool,
    /// Worker threads; 0 = one per core.
    pub threads: usize,
    /// Hears how far each bake is.
    pub progress: &'a dyn Progress,
    /// Asks it to stop.
    pub control: &'a Control,
}

/// A study.
#[derive(Clone, Debug, Default)]
pub struct Sweep {
    /// On the command line, and of its files.
    pub name: &'static str,
    /// What it finds out, in one line.
    pub what: &'static str,
    /// What was measured, on which scenes, with which settings.
    pub note: String,
    /// Columns that tell variants apart.
    pub labels: &'static [&'static str],
    /// Columns that are measured.
    pub columns: &'static [Column],
    /// In the order of the rows.
    pub groups: Vec<Group>,
    /// Bakes of each variant, whose median CPU time counts; 0 is 1.
    pub repeats: usize,
    /// Two columns each.
    pub plots: &'static [Plot],
    /// Maps in a row of a sheet.
    pub sheet_columns: usize,
}

/// Variants that are measured against one reference.
#[derive(Clone, Debug)]
pub struct Group {
    /// What they should give.
    pub against: Against,
    /// At least one.
    pub variants: Vec<Variant>,
}

/// What bakes are measured against.
#[derive(Clone, Debug)]
pub enum Against {
    Nothing,
    /// A map that is known.
    Known(Reference),
    /// All maps of another bake; nothing where it has a target error but is not known to 1 % when it stops.
    Bake(Arc<Scene>, Box<BakeSettings>),
}

/// One row of the table.
#[derive(Clone, Debug)]
pub struct Variant {
    /// One for each of the sweep's labels.
    pub labels: Vec<Cell>,
    /// What is baked.
    pub scene: Arc<Scene>,
    /// How.
    pub settings: BakeSettings,
    /// What becomes of the bake before it is measured.
    pub estimate: Option<fn(&Variant, Bake) -> Bake>,
    /// Pictures of the scene in the bake's light: a file's name without `.png`, and from where.
    pub views: Vec<(String, Camera)>,
    /// The sheet that its map goes into; the reference is the first of each.
    pub sheet: Option<String>,
    /// The picture of what the reference has more and less.
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

    /// Its map goes into a sheet.
    #[must_use]
    pub fn in_sheet(self, file: impl Into<String>) -> Self {
        let sheet = Some(file.into());
        Self { sheet, ..self }
    }

    /// The scene in the bake's light is seen from a camera.
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

/// A measured column.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// With its unit, where it has one.
    pub name: &'static str,
    /// Its value for one variant.
    pub value: fn(&Measured) -> Cell,
}

/// A bake beside its reference.
pub struct Measured<'a> {
    /// What was asked for.
    pub variant: &'a Variant,
    /// The first bake.
    pub result: &'a Bake,
    /// What it is measured against.
    pub reference: Option<&'a Reference>,
    /// Texels beside those of the reference, where they can be paired.
    pub pairs: &'a [TexelPair],
    /// Of the pairs.
    pub agreement: Option<Agreement>,
    /// CPU seconds of the light pass, the median of all bakes.
    pub cpu_s: f64,
    /// CPU seconds of the views.
    pub eye_pass_cpu_s: Option<f64>,
}

impl Measured<'_> {
    /// What a reference that was baked has more, over all layers.
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

/// A number where there is one.
pub fn number(value: Option<f64>) -> Cell {
    value.map_or(Cell::Empty, Cell::Number)
}

/// A share where there is one.
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
/// Wavefront cells deposited.
pub const CELLS: Column = column("cells", |m| m.result.counts.cells.into());
/// Item buffers, tracing and depositing: all of the light pass but the hierarchy.
pub const CPU_S: Column = column("cpu_s", |m| m.cpu_s.into());
/// The same on the wall.
pub const WALL_S: Column = column("wall_s", |m| {
    let times = &m.result.timings_s;
    (times.plan + times.trace + times.deposit).into()
});
/// Of the views, by the ray tracer on the CPU.
pub const EYE_PASS_CPU_S: Column = column("eye_pass_cpu_s", |m| number(m.eye_pass_cpu_s));
/// Held for maps, rays and patches.
pub const MEMORY_MB: Column = column("memory_mb", |m| {
    number(m.result.course.last().map(|point| point.bytes as f64 / 1e6))
});
/// sqrt(mean((I − R)²)) / mean(R).
pub const RELATIVE_RMSE: Column = column("relative_rmse", |m| m.agreed(|a| Cell::Share(a.relative_rmse)));
/// mean(|I − R| / R) over texels with R > 1 % of mean(R).
pub const ARD: Column = column("ard", |m| {
    m.agreed(|a| Cell::Share(a.average_relative_difference))
});
/// Largest I over largest R.
pub const PEAK_RATIO: Column = column("peak_ratio", |m| m.agreed(|a| a.peak_ratio.into()));
/// mean(I) / mean(R).
pub const FLUX_RATIO: Column = column("flux_ratio", |m| m.agreed(|a| a.flux_ratio.into()));
/// What R is.
pub const REFERENCE: Column = column("reference", |m| {
    m.reference
        .map_or(Cell::Empty, |reference| reference.kind.clone().into())
});

impl Bench<'_> {
    /// Texels across and down: those of the shipped references, or fewer.
    pub fn side(&self) -> usize {
        if self.quick { 64 } else { 256 }
    }

    /// Of a choice, the first few where there is no time.
    pub fn some<'v, T>(&self, values: &'v [T], few: usize) -> &'v [T] {
        &values[..if self.quick {
            few.min(values.len())
        } else {
            values.len()
        }]
    }

    /// Settings with maps of that side.
    pub fn at(&self, settings: BakeSettings, side: usize) -> BakeSettings {
        BakeSettings {
            map_resolution: MapResolution::Fixed {
                width: side,
                height: side,
            },
            ..settings
        }
    }

    /// In a session of its own, so that no bake finds the work of another done.
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
                let is_known = |error: f64| error <= TRUSTED;
                if settings.max_error.is_some() && !result.estimated_relative_rmse.is_some_and(is_known) {
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

/// Light pass without the hierarchy [s of CPU].
fn light_pass_cpu_s(result: &Bake) -> f64 {
    result.cpu_s.plan + result.cpu_s.trace + result.cpu_s.deposit
}

/// All that a study found.
#[derive(Clone, Debug)]
pub struct StudyResult {
    /// Of the sweep.
    pub name: &'static str,
    what: &'static str,
    note: String,
    threads: usize,
    /// A row for each variant.
    pub table: Table,
    /// What errors cost, curve by curve; empty where no error is plotted.
    pub costs: Table,
    plots: Vec<(&'static Plot, Vec<Curve>)>,
    pictures: Vec<Picture>,
}

impl Sweep {
    /// Bakes and measures every variant.
    ///
    /// # Errors
    /// Those of a bake; a reference that does not fit; stopped before the end.
    pub fn run(&self, bench: &Bench) -> Result<StudyResult> {
        let mut table = Table {
            columns: self.labels.to_vec(),
            rows: Vec::new(),
        };
        table
            .columns
            .extend(self.columns.iter().map(|column| column.name));
        let (mut pictures, mut sheets) = (Vec::new(), Vec::new());
        for group in &self.groups {
            let reference = group.against.reference(bench)?;
            for variant in &group.variants {
                let row = self.row(bench, variant, reference.as_ref(), &mut pictures, &mut sheets)?;
                table.rows.push(row);
            }
        }
        for (file, images, captions) in sheets {
            let captions = format!("In rows of {}: {captions}.", self.sheet_columns);
            pictures.extend(picture::sheet(file, captions, &images, self.sheet_columns));
        }
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
        let mut result = bench.bake(&variant.scene, &variant.settings)?;
        let mut cpu_s = vec![light_pass_cpu_s(&result)];
        for _ in 1..self.repeats {
            cpu_s.push(light_pass_cpu_s(&bench.bake(&variant.scene, &variant.settings)?));
        }
        cpu_s.sort_by(f64::total_cmp);
        if let Some(estimate) = variant.estimate {
            result = estimate(variant, result);
        }
        let mut eye_pass_cpu_s = None;
        for (file, camera) in &variant.views {
            let request = (file.clone(), variant.caption());
            let (picture, cpu_s) = picture::view(bench, request, (&variant.scene, &result.maps), camera)?;
            pictures.push(picture);
            *eye_pass_cpu_s.get_or_insert(0.0) += cpu_s;
        }
        let pairs = pairs(reference, &result)?;
        let measured = Measured {
            variant,
            result: &result,
            reference,
            pairs: &pairs,
            agreement: Agreement::of(&pairs),
            // Of an even number the lower middle one.
            cpu_s: cpu_s[(cpu_s.len() - 1) / 2],
            eye_pass_cpu_s,
        };
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

/// Its file, its maps and what they are.
type Sheet = (String, Vec<Image>, String);

/// Adds the map of the reference's surface to a sheet; a new one begins with the reference.
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

/// Texels beside those of the reference. Maps of another bake may have sizes of their own, and then have no pairs.
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

/// The power of each curve of errors, and where it meets the [`TARGETS`].
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
    /// The files that it consists of, each with its name: table, plots, pictures, and the page that shows them.
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

    /// All of it, with links to the files beside it.
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
