//! Levels of a light whose caustics are soft: a lamp with a size, a sun's disc, a sky, or any light on rough surfaces.
//!
//! A source point and one micro-facet per specular event are held fixed over a wavefront, so that it stays smooth; maps
//! are means over wavefronts, whose points fill their domain evenly. Their number is a dimension of the error beside the
//! lattice: levels go on in the one that has more of it.

use rayon::prelude::*;

use super::caustic::{CausticLayer, Climb, Course};
use super::level_plan;
use super::light_level::{KeptError, LevelKey, LightLevel, LightState, SoftParts};
use super::map_size::{MapSize, Sizes};
use super::part_maps::PartMaps;
use super::shards::PassSums;
use super::wavefront_level::take_strays;
use crate::error::Result;
use crate::geometry::sampling::even_point;
use crate::illumination::Receiver;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::accuracy::{self, LightError};
use crate::light_pass::caustic::pass::{PassReport, Seconds, Stopwatch};
use crate::light_pass::caustic::setup::AimedLight;
use crate::light_pass::emitter::Emitter;
use crate::light_pass::receiver_maps::{ChartFor, ReceiverMaps};
use crate::light_pass::share::Share;
use crate::light_pass::wavefront::receivers::Receivers;
use crate::optics::LinearSrgb;
use crate::plan::Effect;
use crate::progress::Stage;
use crate::settings::{Estimator, MOST_WAVEFRONTS};
use crate::transport::Microfacets;

/// Wavefronts of the first picture.
const FIRST_WAVEFRONTS: u32 = 4;

/// Wavefronts of a bake without a target.
const USUAL_WAVEFRONTS: u32 = 32;

/// Finer lattices than the usual last one.
const MOST_FINER: usize = 3;

/// The lattice is refined where its part of the error is so many times that of the wavefronts: it costs four times as
/// much, they twice.
const FINER_FROM: f64 = 1.5;

/// And so large a part of the target.
const FINER_FROM_TARGET: f64 = 0.6;

/// The strength of one place of a light may be so many times that of another: a blue pixel of a sky has that much more in
/// one channel than in luminance.
const STRENGTH_MARGIN: f64 = 16.0;

/// Share of the squared difference of two lattices that is the finer one's own error: first order.
const LATTICE_SHARE: f64 = 0.2;

/// Levels until both dimensions of the error are known.
pub(super) const SOFT_BEGINNING: usize = 2;

/// However fine a lattice, its triangles are no finer than so many times less than is usual.
const LEAST_COARSE: f64 = 0.125;

/// How far a soft light is resolved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Resolved {
    /// Which lattice.
    lattice: usize,
    /// How many wavefronts, a power of two.
    wavefronts: u32,
}

impl Resolved {
    /// The same wavefronts on the lattice that the error is taken from.
    fn coarser(self) -> Self {
        Self {
            lattice: self.lattice.saturating_sub(1),
            ..self
        }
    }
}

impl CausticLayer<'_> {
    /// Whether maps of a light are means over wavefronts.
    pub(super) fn is_soft(&self, light: &AimedLight) -> bool {
        self.has_places(light) || self.has_lobes(light)
    }

    /// Whether its light comes from many places.
    pub(super) fn has_places(&self, light: &AimedLight) -> bool {
        self.plan.is_on(Effect::AreaLights) && self.tracer.scene().lights[light.light].has_extent()
    }

    /// Whether its light meets rough surfaces.
    fn has_lobes(&self, light: &AimedLight) -> bool {
        let scene = self.tracer.scene();
        let is_rough = |&(object, _): &(usize, Option<usize>)| scene.material_of(object).is_rough();
        self.plan.is_on(Effect::Roughness) && self.aim.sights[light.light].reached.iter().any(is_rough)
    }

    /// One wavefront of a light; `None` where it sends nothing to a caster.
    fn wavefront(&self, light: &AimedLight, index: u32) -> Option<AimedLight> {
        let scene = self.tracer.scene();
        let seed = self.settings.seed;
        let emitter = if self.has_places(light) {
            let source = scene.lights[light.light].of_unit_strength();
            Some(Emitter::sample(&source, scene, even_point(index, 0, seed))?)
        } else {
            None
        };
        let facets = || Microfacets::new(|pair| even_point(index, 1 + pair, seed));
        light.another(
            self.tracer,
            self.aiming(),
            emitter,
            self.has_lobes(light).then(facets),
        )
    }

    /// Cells across and down of a lattice; beyond the usual last one each has half the steps.
    fn soft_lattice(&self, light: &AimedLight, index: usize) -> (usize, usize) {
        let lattices = self.lattices(light);
        let last = lattices.len() - 1;
        let finer = index.saturating_sub(last);
        let (columns, rows) = lattices[index.min(last)];
        if self.settings.estimator == Estimator::Splat && index < last {
            return (columns.div_ceil(2), rows.div_ceil(2));
        }
        (columns << finer, rows << finer)
    }

    /// Where the first picture begins, and the usual last lattice. Each has a coarser one beside it.
    fn soft_ends(&self, light: &AimedLight) -> (usize, usize) {
        let last = self.lattices(light).len() - 1;
        let first = if self.settings.max_error.is_some() {
            1
        } else {
            last
        };
        (first.min(last), last)
    }

    /// What comes after the levels so far; `None` where there is nothing more.
    pub(super) fn next_resolved(&self, light: &AimedLight, climb: &Climb) -> Option<Resolved> {
        let (first, last) = self.soft_ends(light);
        let wanted = self.settings.wavefronts.unwrap_or(USUAL_WAVEFRONTS);
        let (most, target) = match self.settings.max_error {
            Some(target) => (self.settings.wavefronts.unwrap_or(MOST_WAVEFRONTS), target),
            None => (wanted, f64::INFINITY),
        };
        let Some(level) = climb.levels.last() else {
            return Some(Resolved {
                lattice: first,
                wavefronts: FIRST_WAVEFRONTS.min(most),
            });
        };
        let at = level.key.resolved?;
        let more = (at.wavefronts < most).then_some(Resolved {
            wavefronts: at.wavefronts * 2,
            ..at
        });
        let rmse = |part: &Option<LightError>| part.as_ref().map(|part| part.relative_rmse);
        let (spread, lattice) = (rmse(&level.parts.spread), rmse(&level.parts.lattice));
        // More wavefronts help either: their lattices do not err alike.
        let is_coarse = lattice.is_some_and(|lattice| {
            let spread = if more.is_some() {
                spread.unwrap_or(f64::INFINITY)
            } else {
                0.0
            };
            lattice > FINER_FROM * spread && lattice > FINER_FROM_TARGET * target
        });
        let finer = (is_coarse && at.lattice < last + MOST_FINER).then_some(Resolved {
            lattice: at.lattice + 1,
            ..at
        });
        finer.or(more)
    }

    /// One level more of a soft light.
    ///
    /// # Errors
    /// A light whose power is no number.
    pub(super) fn climb_soft(
        &self,
        light: &AimedLight,
        sizes: &Sizes,
        state: &mut LightState,
        climb: &mut Climb,
        course: &mut Course,
    ) -> Result<()> {
        let Some(resolved) = self.next_resolved(light, climb) else {
            climb.done = true;
            return Ok(());
        };
        let key = self.soft_key(light, resolved, climb.levels.len(), sizes);
        let made = match state.take(&key) {
            Some(level) => Some(level),
            None => self.make_soft(light, key, climb.levels.last(), course)?,
        };
        let Some(mut level) = made else {
            return Ok(());
        };
        if !course.labour.is_shard() {
            self.estimate_soft(&mut level, climb.levels.last(), course);
        }
        climb.levels.push(level);
        Ok(())
    }

    fn soft_key(&self, light: &AimedLight, resolved: Resolved, step: usize, sizes: &Sizes) -> LevelKey {
        let size = self.soft_lattice(light, resolved.lattice);
        let (_, last) = self.soft_ends(light);
        let coarser = last as i32 - resolved.lattice as i32;
        let mut trace = self.trace_key(light, size, coarser, &[]);
        // It chooses the points of all wavefronts.
        trace.settings.seed = self.settings.seed;
        LevelKey {
            trace,
            resolved: Some(resolved),
            coarseness: self.soft_coarseness(resolved.lattice, light),
            ..self.key(
                light,
                step.min(self.lattices(light).len() - 1),
                &Climb::default(),
                sizes,
            )
        }
    }

    /// How coarse triangles may be: the more wavefronts share a map, the less each of them shows.
    fn soft_coarseness(&self, lattice: usize, light: &AimedLight) -> f64 {
        let (_, last) = self.soft_ends(light);
        let usual = level_plan::coarseness(self.settings.max_error, None);
        (usual * (last as f64 - lattice as f64).exp2()).clamp(LEAST_COARSE, level_plan::MOST_COARSE)
    }

    /// The unit of sums over all wavefronts that there may be.
    fn soft_unit(&self, light: &AimedLight) -> Result<FluxUnit> {
        let power_w = light.power_bound_w(self.tracer.scene()) * STRENGTH_MARGIN;
        self.unit_for(light, power_w, f64::from(MOST_WAVEFRONTS))
    }

    /// Traces and deposits the wavefronts that are missing; `None` where it was stopped.
    fn make_soft(
        &self,
        light: &AimedLight,
        key: LevelKey,
        before: Option<&LightLevel>,
        course: &mut Course,
    ) -> Result<Option<LightLevel>> {
        let unit = self.soft_unit(light)?;
        let Some(resolved) = key.resolved else {
            return Ok(None);
        };
        let coarse_key = self.soft_key(light, resolved.coarser(), 0, &key.sizes);
        let (count, before_at) = (resolved.wavefronts, before.and_then(|before| before.key.resolved));
        // The wavefronts so far are the first of the new ones.
        let same = before.filter(|before| before.key.trace == key.trace && before.key.sizes == key.sizes);
        let first = same.and(before_at).map_or(0, |before| before.wavefronts);
        let watch = Stopwatch::start();
        let (mut report, mut maps, mut bands) =
            self.run_wavefronts(light, &key, unit, first..count, course)?;
        // What was fine before a finer lattice is what to compare with now.
        let is_refined = before_at == Some(resolved.coarser());
        let mut coarse = match before.filter(|_| is_refined) {
            Some(before) => before.maps.clone(),
            None => {
                let (other, coarse, _) =
                    self.run_wavefronts(light, &coarse_key, unit, first..count, course)?;
                let ledger = report.ledger;
                report.merge(other);
                report.ledger = ledger;
                coarse
            }
        };
        if !course.labour.is_merge() {
            share_time(&mut report, watch.elapsed());
        }
        course.outcome.count(&report, course.clock);
        let mut ledger = report.ledger;
        let strays = take_strays(&mut maps, &mut ledger);
        if let Some(same) = same {
            maps.add(same.maps.clone());
            for earlier in &same.bands {
                bands[earlier.index].add(earlier.maps.clone());
            }
            ledger.merge(&same.ledger);
            if let Some(earlier) = &same.parts.coarse {
                coarse.add(earlier.clone());
            }
        }
        Ok((!report.cancelled).then(|| LightLevel {
            strays,
            parts: SoftParts {
                coarse: Some(coarse),
                ..SoftParts::default()
            },
            ..self.level(
                light,
                (key, unit.per(u64::from(resolved.wavefronts))),
                (maps, bands),
                ledger,
            )
        }))
    }

    /// Maps summed over some wavefronts.
    fn run_wavefronts(
        &self,
        light: &AimedLight,
        key: &LevelKey,
        unit: FluxUnit,
        wavefronts: std::ops::Range<u32>,
        course: &mut Course,
    ) -> Result<(PassReport, ReceiverMaps, Vec<ReceiverMaps>)> {
        let chart_for = |receiver: Receiver| self.chart(receiver, &key.sizes);
        let nothing = PassSums::new(vec![self.part_maps()]);
        let mut sums = course.pass(&chart_for, nothing, |course, share, sums| {
            // A wavefront is one piece, and shares no ray with others.
            let of_share = |index: &u32| share.is_none_or(|share: Share| share.has(u64::from(*index)));
            let own: Vec<u32> = wavefronts.filter(of_share).collect();
            self.run_own_wavefronts(light, key, (unit, &chart_for), &own, sums, course)
        })?;
        let mut report = sums.report;
        let (mut maps, bands) = sums.maps.swap_remove(0).into_sum();
        self.spectra
            .to_linear_srgb(light.light, &mut maps, &mut report.ledger);
        Ok((report, maps, bands))
    }

    /// Adds some wavefronts.
    fn run_own_wavefronts(
        &self,
        light: &AimedLight,
        key: &LevelKey,
        (unit, chart_for): (FluxUnit, &ChartFor),
        wavefronts: &[u32],
        mut sums: PassSums,
        course: &Course,
    ) -> PassSums {
        let count = wavefronts.len();
        let sets = self.spectra.kept_bands().max(1) as u64;
        let texels: u64 = sets * key.sizes.values().map(MapSize::texels).sum::<u64>();
        // Each task has maps of its own.
        let room = self.settings.memory_bytes / 4 / (texels * super::BYTES_PER_TEXEL).max(1);
        let tasks = rayon::current_num_threads()
            .min(count)
            .min((room as usize).max(1))
            .max(1);
        let done = std::sync::atomic::AtomicU64::new(0);
        let receivers = Receivers::new(self.tracer, chart_for);
        let lit = (&receivers, chart_for);
        let parts: Vec<(PassReport, PartMaps)> = (0..tasks)
            .into_par_iter()
            .map(|task| {
                let mut report = PassReport::default();
                let mut maps = self.part_maps();
                for &index in wavefronts.iter().skip(task).step_by(tasks) {
                    if course.control.is_cancelled() {
                        report.cancelled = true;
                        break;
                    }
                    if let Some(wavefront) = self.wavefront(light, index) {
                        let (of_wavefront, added) =
                            self.run_wavefront(&wavefront, key, unit, lit, maps, course);
                        report.merge(of_wavefront);
                        maps = added;
                    }
                    let done = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
                    self.progress.advance(Stage::Caustic, done, count as u64);
                }
                (report, maps)
            })
            .collect();
        for (part, maps) in parts {
            sums.report.merge(part);
            sums.maps[0].add(maps);
        }
        sums
    }

    /// Compares a level with the one before it.
    fn estimate_soft(&self, level: &mut LightLevel, before: Option<&LightLevel>, course: &mut Course) {
        let watch = Stopwatch::start();
        let ledger = level.ledger.report("", level.unit, LinearSrgb::WHITE).energy_w;
        let fine = accuracy::images(&level.maps, level.unit);
        let coarse = level.parts.coarse.as_ref();
        level.parts.lattice = coarse.and_then(|coarse| {
            let coarse = accuracy::images(coarse, level.unit);
            accuracy::by_difference(&fine, &coarse, LATTICE_SHARE, &ledger)
        });
        let lattice_of = |level: &LightLevel| level.key.resolved.map(|resolved| resolved.lattice);
        level.parts.spread = before.and_then(|before| {
            if lattice_of(before) == lattice_of(level) {
                // (A − B)/2 of two independent halves is as large as the error of their mean.
                let half = accuracy::images(&before.maps, before.unit);
                accuracy::by_difference(&fine, &half, 1.0, &ledger)
            } else {
                before.parts.spread.clone()
            }
        });
        level.error = match (&level.parts.spread, &level.parts.lattice) {
            (Some(spread), Some(lattice)) => Some(KeptError {
                predecessors: 0,
                estimate: accuracy::together(spread, lattice),
            }),
            _ => None,
        };
        course.clock.deposit.add(watch.elapsed());
    }
}

/// Divides the time of tasks that ran side by side as their own clocks did.
fn share_time(report: &mut PassReport, whole: Seconds) {
    let (trace, deposit) = (report.trace_s.wall, report.deposit_s.wall);
    let share = if trace + deposit > 0.0 {
        trace / (trace + deposit)
    } else {
        0.0
    };
    let part = |share: f64| Seconds {
        wall: whole.wall * share,
        cpu: whole.cpu * share,
    };
    (report.trace_s, report.deposit_s) = (part(share), part(1.0 - share));
}

impl CausticLayer<'_> {
    fn run_wavefront(
        &self,
        wavefront: &AimedLight,
        key: &LevelKey,
        unit: FluxUnit,
        lit: (&Receivers, &ChartFor),
        mut maps: PartMaps,
        course: &Course,
    ) -> (PassReport, PartMaps) {
        match self.settings.estimator {
            estimator if estimator.refines() => {
                let report = self.run_patches(wavefront, key, unit, lit, &mut maps, course);
                (report, maps)
            }
            _ => self.run_splats(wavefront, key, unit, maps, course),
        }
    }
}
