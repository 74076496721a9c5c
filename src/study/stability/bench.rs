//! Bakes with the books open, and notes what laws come to.

use std::num::NonZero;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::error::{Error, Result};
use crate::illumination::IlluminationMap;
use crate::progress::{Control, Progress};
use crate::scene::Scene;
use crate::session::{BakeResult, BakeSession};
use crate::settings::{BakeSettings, LayerKind};

/// Most that ledgers and maps may leave open, of what was emitted or deposited [1].
pub const BOOKS_BOUND: f64 = 1e-6;

/// How much is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Effort {
    /// Coarse lattices and small maps, in a minute or two.
    Quick,
    /// What takes long as well.
    Long,
}

/// What a law came to.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Finding {
    /// The law.
    pub law: String,
    /// How far it was off at worst, as a share unless the law says otherwise.
    pub worst: f64,
    /// How far it may be.
    pub bound: f64,
}

impl Finding {
    /// Whether the law holds; it does not where there is no number.
    pub fn holds(&self) -> bool {
        self.worst <= self.bound
    }
}

/// Where a case is put to the test.
pub struct Bench<'a> {
    /// How much is tried.
    pub effort: Effort,
    /// So far.
    pub findings: Vec<Finding>,
    /// So far.
    pub bakes: usize,
    books_open: f64,
    threads: usize,
    progress: &'a dyn Progress,
    control: &'a Control,
}

impl<'a> Bench<'a> {
    /// With nothing found yet, for so much effort on so many threads (0: one per core).
    pub fn new((effort, threads): (Effort, usize), progress: &'a dyn Progress, control: &'a Control) -> Self {
        Self {
            effort,
            threads,
            findings: Vec::new(),
            bakes: 0,
            books_open: 0.0,
            progress,
            control,
        }
    }

    /// What the books of all bakes left open at worst; `None` without a bake.
    pub fn books_open(&self) -> Option<f64> {
        (self.bakes > 0).then_some(self.books_open)
    }

    /// Bakes, on as many threads as the settings say or else the study, and looks at every value and every ledger.
    ///
    /// # Errors
    /// A bake that fails; stopped before the end.
    pub fn bake(&mut self, scene: &Scene, settings: &BakeSettings) -> Result<BakeResult> {
        let result = self.bake_unnoted(scene, settings)?;
        self.note(&result);
        Ok(result)
    }

    /// Bakes many small scenes side by side: as many at a time as the study has threads. Results are in the order of
    /// the jobs.
    ///
    /// # Errors
    /// As [`Self::bake`], the first of them.
    pub fn bake_each(&mut self, jobs: &[(Scene, BakeSettings)]) -> Result<Vec<BakeResult>> {
        let next = AtomicUsize::new(0);
        let work = || -> Vec<(usize, Result<BakeResult>)> {
            let indices = std::iter::from_fn(|| Some(next.fetch_add(1, Ordering::Relaxed)));
            let jobs = indices.map_while(|index| Some((index, jobs.get(index)?)));
            jobs.map(|(index, (scene, settings))| (index, self.bake_unnoted(scene, settings)))
                .collect()
        };
        let cores = std::thread::available_parallelism().map_or(1, NonZero::get);
        let threads = if self.threads == 0 { cores } else { self.threads };
        let mut done: Vec<(usize, Result<BakeResult>)> = std::thread::scope(|scope| {
            let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
            let results = workers.into_iter().flat_map(|worker| {
                worker
                    .join()
                    .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            });
            results.collect()
        });
        done.sort_by_key(|(index, _)| *index);
        let results: Result<Vec<BakeResult>> = done.into_iter().map(|(_, result)| result).collect();
        let results = results?;
        results.iter().for_each(|result| self.note(result));
        Ok(results)
    }

    fn bake_unnoted(&self, scene: &Scene, settings: &BakeSettings) -> Result<BakeResult> {
        let mut session = BakeSession::new(Arc::new(scene.clone()))?;
        let settings = BakeSettings {
            threads: if settings.threads == 0 {
                self.threads
            } else {
                settings.threads
            },
            ..settings.clone()
        };
        let result = session.bake(&settings, self.progress, self.control)?;
        if result.partial {
            return Err(Error::cancelled("study stability"));
        }
        Ok(result)
    }

    fn note(&mut self, result: &BakeResult) {
        self.bakes += 1;
        self.books_open = self.books_open.max(books_open(result));
    }

    /// Bakes, and leaves it to the case to look at values and ledgers.
    ///
    /// # Errors
    /// As [`Self::bake`].
    pub fn bake_beyond_range(&mut self, scene: &Scene, settings: &BakeSettings) -> Result<BakeResult> {
        let known = self.books_open;
        let result = self.bake(scene, settings);
        self.books_open = known;
        result
    }

    /// Notes how far a law is off; of several times the worst counts.
    pub fn law(&mut self, law: &str, off: f64, bound: f64) {
        // What is no number is worse than anything.
        let off = if off.is_nan() { f64::INFINITY } else { off };
        match self.findings.iter_mut().find(|finding| finding.law == law) {
            Some(known) => known.worst = known.worst.max(off),
            None => self.findings.push(Finding {
                law: law.into(),
                worst: off,
                bound,
            }),
        }
    }

    /// Notes whether something that must be so is so: 0 or 1 of 0.
    pub fn must(&mut self, law: &str, is_so: bool) {
        self.law(law, f64::from(u8::from(!is_so)), 0.0);
    }
}

/// What ledgers leave open at worst, of what was emitted, or maps of what was deposited; infinite where a value is not
/// finite or below zero.
pub fn books_open(result: &BakeResult) -> f64 {
    let values = result.maps.iter().flat_map(values);
    let mut is_sound = values.into_iter().all(|e| e.is_finite() && e >= 0.0);
    let mut worst: f64 = 0.0;
    let (mut deposited_w, mut emitted_w) = (0.0, 0.0);
    for ledger in &result.ledgers {
        let energy = ledger.energy_w;
        let imbalance = energy.relative_imbalance();
        is_sound &= imbalance.is_finite() && energy.truncated.non_finite == 0.0;
        worst = worst.max(imbalance);
        deposited_w += energy.deposited;
        emitted_w += energy.emitted;
    }
    if result
        .maps
        .iter()
        .any(|map| map.layer(LayerKind::Caustic).is_some())
        || deposited_w > 0.0
    {
        let held = |map: &IlluminationMap| map.flux_w(LayerKind::Caustic).luminance();
        let held_w: f64 = result.maps.iter().map(held).sum();
        is_sound &= held_w.is_finite();
        // Of a sliver of light, roundings are as large as the light itself.
        let whole_w = deposited_w.max(1e-9 * emitted_w);
        // Nor do maps hold what single precision does not.
        let area_m2: f64 = result.maps.iter().map(|map| map.chart.area_m2()).sum();
        let lost_w = (held_w - deposited_w).abs() - area_m2 * f64::from(f32::MIN_POSITIVE);
        if whole_w > 0.0 {
            worst = worst.max(lost_w.max(0.0) / whole_w);
        }
    }
    if is_sound { worst } else { f64::INFINITY }
}

/// All values of a map, its errors included.
pub fn values(map: &IlluminationMap) -> impl Iterator<Item = f32> {
    let layers = map
        .layers
        .iter()
        .flat_map(|layer| layer.irradiance.iter().flatten());
    layers.chain(map.error.iter().flatten()).copied()
}
