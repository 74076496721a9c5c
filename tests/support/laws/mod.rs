//! A table of hard cases: scenes to bake, and the laws that their bakes have to satisfy.

pub mod law;
pub mod scenes;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use nephroid::settings::{ErrorMetric, Estimator};

use crate::prelude::*;
use crate::tools::{bake, photons, settings, to};

/// Largest relative error of the energy balance of ledgers and maps.
const BOOKS_BOUND: f64 = 1e-6;

/// Number of photons that determines a flux to about one per cent.
const MIN_PHOTONS: f64 = 2e4;

/// Whether the long variants of the cases are requested.
pub fn is_long() -> bool {
    std::env::var_os("NEPHROID_LONG").is_some_and(|value| value != "0")
}

/// A scene and its bake.
pub struct Baked {
    pub scene: Scene,
    pub result: Bake,
    estimator: Estimator,
}

impl Baked {
    fn new(scene: Scene, settings: &BakeSettings) -> Self {
        Self {
            result: bake(scene.clone(), settings),
            scene,
            estimator: settings.estimator,
        }
    }

    /// Relative RMSE that chance causes, as estimated; 0 for splats, whose rays are not chosen by chance.
    pub fn noise(&self) -> f64 {
        match self.estimator {
            Estimator::Splat => 0.0,
            _ => self.result.estimated_relative_rmse.unwrap_or(0.0),
        }
    }
}

/// Deviation from a law, or the largest that it allows, given all bakes so far.
type Measure = Box<dyn Fn(&[Baked]) -> f64 + Send>;

/// Use of bakes before they are dropped.
type Look = Box<dyn Fn(&[Baked]) + Send>;

enum Step {
    Bake {
        what: Box<(Scene, BakeSettings)>,
        /// Whether the scene is also baked by photons and by the automatic estimator.
        is_carried: bool,
    },
    Law {
        says: String,
        bound: Measure,
        of: Measure,
    },
    /// A law about the last bake's scene, baked by photons and by the automatic estimator.
    Carried(String, Box<dyn Fn(&Baked) -> f64 + Send>),
    Forget(Look),
}

#[derive(Default)]
pub struct Table {
    cases: Vec<Case>,
}

impl Table {
    /// Adds a case.
    pub fn case(&mut self, name: impl Into<String>) -> &mut Case {
        self.cases.push(Case {
            name: name.into(),
            steps: Vec::new(),
            is_without_books: false,
        });
        self.cases.last_mut().expect("it was pushed")
    }
}

/// Bakes and laws, in order. A law sees all bakes before it.
pub struct Case {
    name: String,
    steps: Vec<Step>,
    is_without_books: bool,
}

impl Case {
    /// Bakes by bundles to a relative RMSE, with maps of side² texels.
    pub fn bake(&mut self, scene: Scene, target: f64, side: usize) -> &mut Self {
        self.bake_with(scene, to(target, side))
    }

    /// Bakes by splats at a density [rays/sr], with maps of side² texels.
    pub fn splat(&mut self, scene: Scene, density_per_sr: f64, side: usize) -> &mut Self {
        self.bake_with(scene, settings(density_per_sr, side))
    }

    /// Bakes with these settings.
    pub fn bake_with(&mut self, scene: Scene, settings: BakeSettings) -> &mut Self {
        self.steps.push(Step::Bake {
            what: Box::new((scene, settings)),
            is_carried: self.steps.is_empty(),
        });
        self
    }

    /// Adds a law with the bound and the measure of its deviation. Laws of the same wording are reported once, with
    /// the largest deviation.
    pub fn law(
        &mut self,
        says: impl Into<String>,
        bound: f64,
        of: impl Fn(&[Baked]) -> f64 + Send + 'static,
    ) -> &mut Self {
        self.law_within(says, move |_| bound, of)
    }

    /// Adds a law whose bound depends on the bakes.
    pub fn law_within(
        &mut self,
        says: impl Into<String>,
        bound: impl Fn(&[Baked]) -> f64 + Send + 'static,
        of: impl Fn(&[Baked]) -> f64 + Send + 'static,
    ) -> &mut Self {
        self.steps.push(Step::Law {
            says: says.into(),
            bound: Box::new(bound),
            of: Box::new(of),
        });
        self
    }

    /// Adds a law about the last bake's scene, baked by photons and by the automatic estimator. The measure is
    /// relative to what chance allows, so that its bound is 1.
    pub fn carried(&mut self, says: &str, of: impl Fn(&Baked) -> f64 + Send + 'static) -> &mut Self {
        let mut steps = self.steps.iter_mut().rev();
        if let Some(Step::Bake { is_carried, .. }) = steps.find(|step| matches!(step, Step::Bake { .. })) {
            *is_carried = true;
        }
        self.steps.push(Step::Carried(says.into(), Box::new(of)));
        self
    }

    /// Passes all bakes so far to `after` and drops them.
    pub fn forget(&mut self, after: impl Fn(&[Baked]) + Send + 'static) -> &mut Self {
        self.steps.push(Step::Forget(Box::new(after)));
        self
    }

    /// Skips the check of the energy balance: for layers other than caustics, and for values beyond the range of
    /// maps.
    pub fn without_books(&mut self) -> &mut Self {
        self.is_without_books = true;
        self
    }

    fn rows(self) -> Vec<Row> {
        let (mut bakes, mut carried, mut rows) = (Vec::new(), Vec::new(), Vec::new());
        let (mut open, mut first) = (None, String::new());
        let mut note = |law: String, measured: f64, bound: f64, scene: &str| {
            rows.push(Row {
                case: self.name.clone(),
                scene: scene.into(),
                law,
                // NaN counts as the largest deviation.
                measured: if measured.is_nan() { f64::INFINITY } else { measured },
                bound,
            });
        };
        for step in self.steps {
            let is_done = catch_unwind(AssertUnwindSafe(|| match step {
                Step::Bake { what, is_carried } => {
                    let (scene, mut settings) = *what;
                    // Cases run in parallel, so each uses one thread unless it asks for more.
                    settings.threads = settings.threads.max(1);
                    if open.is_none() {
                        first = scene.name.clone();
                    }
                    let baked = Baked::new(scene.clone(), &settings);
                    open = Some(energy_residual(&baked.result).max(open.unwrap_or(0.0)));
                    carried = if is_carried { by_carriers(&scene, &settings) } else { Vec::new() };
                    for (_, baked) in carried.iter().filter(|_| !self.is_without_books) {
                        open = Some(energy_residual(&baked.result).max(open.unwrap_or(0.0)));
                    }
                    bakes.push(baked);
                }
                Step::Law { says, bound, of } => note(says, of(&bakes), bound(&bakes), &first),
                Step::Carried(says, of) => {
                    for (carrier, baked) in &carried {
                        note(format!("by {carrier}, over what chance allows: {says}"), of(baked), 1.0, &first);
                    }
                }
                Step::Forget(after) => {
                    after(&bakes);
                    bakes.clear();
                }
            }));
            if is_done.is_err() {
                note("runs to its end".into(), f64::INFINITY, 0.0, &first);
            }
        }
        if let Some(open) = open.filter(|_| !self.is_without_books) {
            note("ledgers and maps hold every watt".into(), open, BOOKS_BOUND, &first);
        }
        rows
    }
}

/// Largest relative error in the energy balance of the ledgers, or between ledgers and maps. Infinite if a value is
/// not finite or is negative; negative values are valid for spectral lights, whose colours may lie outside sRGB.
pub fn energy_residual(result: &Bake) -> f64 {
    let is_spectral = result.ledgers.iter().any(|ledger| ledger.emitted_radiant_w.is_some());
    let is_value = |e: f32| e.is_finite() && (e >= 0.0 || is_spectral);
    let mut is_sound = result.maps.iter().flat_map(values).all(is_value);
    let mut worst: f64 = 0.0;
    let (mut deposited_w, mut emitted_w) = (0.0, 0.0);
    for energy in result.ledgers.iter().map(|ledger| ledger.energy_w) {
        let imbalance = energy.relative_imbalance();
        is_sound &= imbalance.is_finite() && energy.truncated.non_finite == 0.0;
        worst = worst.max(imbalance);
        deposited_w += energy.deposited;
        emitted_w += energy.emitted;
    }
    let has_layer = |map: &IlluminationMap| map.layer(LayerKind::Caustic).is_some();
    if result.maps.iter().any(has_layer) || deposited_w > 0.0 {
        let held = |map: &IlluminationMap| map.flux_w(LayerKind::Caustic).luminance();
        let held_w: f64 = result.maps.iter().map(held).sum();
        is_sound &= held_w.is_finite();
        // If only a sliver of light is deposited, rounding errors are as large as the light itself.
        let whole_w = deposited_w.max(1e-9 * emitted_w);
        // Maps cannot hold values below the range of single precision.
        let area_m2: f64 = result.maps.iter().map(|map| map.chart.area_m2()).sum();
        let lost_w = (held_w - deposited_w).abs() - area_m2 * f64::from(f32::MIN_POSITIVE);
        if whole_w > 0.0 {
            worst = worst.max(lost_w.max(0.0) / whole_w);
        }
    }
    if is_sound { worst } else { f64::INFINITY }
}

/// The scene baked by photons and by the automatic estimator.
fn by_carriers(scene: &Scene, settings: &BakeSettings) -> Vec<(&'static str, Baked)> {
    let plain = photons(settings.density_per_sr, 16);
    let photons = BakeSettings {
        estimator: Estimator::Photon,
        rays: plain.rays,
        sigma: plain.sigma,
        kernel: plain.kernel,
        kernel_sampling: plain.kernel_sampling,
        footprint: plain.footprint,
        filter: plain.filter,
        max_error: None,
        ..settings.clone()
    };
    let few = bake(scene.clone(), &photons).counts.rays.max(1);
    let many = BakeSettings {
        density_per_sr: photons.density_per_sr * (MIN_PHOTONS / few as f64).max(1.0),
        ..photons.clone()
    };
    let chosen = BakeSettings {
        estimator: Estimator::Auto,
        max_error: Some(0.1),
        error_metric: ErrorMetric::Rmse,
        ..photons
    };
    let baked = |settings: &BakeSettings| Baked::new(scene.clone(), settings);
    vec![("photons", baked(&many)), ("auto", baked(&chosen))]
}

/// All values of a map, including its errors.
pub fn values(map: &IlluminationMap) -> impl Iterator<Item = f32> {
    let layers = map.layers.iter().flat_map(|layer| layer.irradiance.iter().flatten());
    layers.chain(map.error.iter().flatten()).copied()
}

/// Result of one law of one case.
struct Row {
    case: String,
    scene: String,
    law: String,
    measured: f64,
    bound: f64,
}

impl Row {
    fn holds(&self) -> bool {
        self.measured <= self.bound
    }

    fn line(&self) -> String {
        let (measured, bound) = (number(self.measured), number(self.bound));
        let verdict = if self.holds() { "holds" } else { "**fails**" };
        let (case, scene, law) = (&self.case, &self.scene, &self.law);
        format!("| {case} | {scene} | {law} | {measured} | {bound} | {verdict} |\n")
    }
}

/// Merges rows of the same case and law; the largest deviation is kept.
fn worst(mut rows: Vec<Row>, row: Row) -> Vec<Row> {
    match rows.iter_mut().find(|known| known.case == row.case && known.law == row.law) {
        Some(known) if known.measured < row.measured => *known = row,
        Some(_) => {}
        None => rows.push(row),
    }
    rows
}

/// Tables of finished groups, by name.
static DONE: Mutex<Vec<(&str, String)>> = Mutex::new(Vec::new());

/// Runs all cases of a group and writes the tables of all groups so far; asserts that all laws hold.
#[track_caller]
pub fn hold(group: &'static str, fill: fn(&mut Table)) {
    let mut table = Table::default();
    fill(&mut table);
    let rows = run(table);
    publish(group, &rows);
    check(&rows);
}

/// Runs the named cases, which must exist; asserts that all laws hold.
#[track_caller]
pub fn hold_some(fill: fn(&mut Table), names: &[&str]) {
    let mut table = Table::default();
    fill(&mut table);
    table.cases.retain(|case| names.contains(&case.name.as_str()));
    let has = |name: &&str| table.cases.iter().any(|case| case.name == **name);
    assert!(names.iter().all(has), "a case of {names:?} is missing");
    check(&run(table));
}

#[track_caller]
fn check(rows: &[Row]) {
    let faults: String = rows.iter().filter(|row| !row.holds()).map(Row::line).collect();
    assert!(!rows.is_empty() && faults.is_empty(), "laws that do not hold:\n{faults}");
}

/// Runs cases in parallel.
fn run(table: Table) -> Vec<Row> {
    let cases: Vec<Mutex<Option<Case>>> = table.cases.into_iter().map(Some).map(Mutex::new).collect();
    let next = AtomicUsize::new(0);
    let take = |index: usize| cases.get(index)?.lock().expect("no panic holds it").take();
    let work = || {
        let indices = std::iter::from_fn(|| Some(next.fetch_add(1, Ordering::Relaxed)));
        let cases = indices.map_while(|index| Some((index, take(index)?)));
        cases.map(|(index, case)| (index, case.rows())).collect::<Vec<_>>()
    };
    let mut found: Vec<(usize, Vec<Row>)> = std::thread::scope(|scope| {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let workers: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
        let done = workers.into_iter().map(|worker| worker.join().expect("panics are caught"));
        done.flatten().collect()
    });
    found.sort_by_key(|(index, _)| *index);
    found.into_iter().flat_map(|(_, rows)| rows).fold(Vec::new(), worst)
}

/// Prints a group's table and writes those of all groups so far to `laws/laws.md` in the build folder.
#[allow(clippy::print_stdout, reason = "the guide quotes it")]
fn publish(group: &'static str, rows: &[Row]) {
    let mut table = format!("\n## {group}\n\n| case | scene | law | measured | bound | verdict |\n|---|---|---|---|---|---|\n");
    table.extend(rows.iter().map(Row::line));
    println!("{table}");
    let mut done = DONE.lock().expect("no panic holds it");
    done.push((group, table));
    done.sort();
    let mut text = String::from("# Hard cases\n");
    text.extend(done.iter().map(|(_, table)| table.as_str()));
    let folder = crate::build_folder().with_file_name("laws");
    std::fs::create_dir_all(&folder).expect("the build folder can be written");
    std::fs::write(folder.join("laws.md"), text).expect("the build folder can be written");
}

/// Two digits; scientific notation outside 1e-3 to 1e3.
fn number(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return "∞".into();
    }
    if !(1e-3..1e3).contains(&magnitude) {
        return format!("{value:.1e}");
    }
    let digits = (1 - magnitude.log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}
