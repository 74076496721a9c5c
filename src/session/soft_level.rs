//! Levels of a light whose caustics are soft: a lamp with a size, a sun's disc, a sky, or any light on rough surfaces.
//!
//! A source point and one micro-facet per specular event are held fixed over a wavefront, so that it stays smooth; maps
//! are means over wavefronts, whose points fill their domain evenly. Their number is a dimension of the error beside the
//! lattice: levels go on in the one that has more of it.

use rayon::prelude::*;

use super::caustic::{CausticLayer, Climb, Course};
use super::level_plan;
use super::light_level::{KeptError, LevelKey, LightLevel, LightState, Sizes, SoftParts};
use crate::error::{Error, Result};
use crate::geometry::sampling::even_point;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::accuracy;
use crate::light_pass::caustic::pass::{PassReport, Seconds, Stopwatch};
use crate::light_pass::caustic::setup::AimedLight;
use crate::light_pass::emitter::Emitter;
use crate::light_pass::receiver_maps::{ChartFor, ReceiverMaps};
use crate::light_pass::wavefront::receivers::Receivers;
use crate::optics::LinearSrgb;
use crate::plan::Effect;
use crate::progress::Stage;
use crate::settings::{Estimator, MOST_WAVEFRONTS};
use crate::transport::Microfacets;

/// Wavefronts of the first picture.
const FIRST_WAVEFRONTS: u32 = 4;

/// Wavefronts of a bake without a target.
const USUAL_WAVEFRONTS: u32 = 64;

/// Finer lattices than the usual last one.
const MOST_FINER: usize = 5;

/// The strength of one place of a light may be so many times that of another: a blue pixel of a sky has that much more in
/// one channel than in luminance.
const STRENGTH_MARGIN: f64 = 16.0;

/// Share of the squared difference of two lattices that is the finer one's own error: first order.
const LATTICE_SHARE: f64 = 0.2;

/// Levels until both dimensions of the error are known.
pub(super) const SOFT_BEGINNING: usize = 3;

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

impl CausticLayer<'_> {
    /// Whether maps of a light are means over wavefronts.
    pub(super) fn is_soft(&self, light: &AimedLight) -> bool {
        self.has_places(light) || self.has_lobes(light)
    }

    /// Whether its light comes from many places.
    fn has_places(&self, light: &AimedLight) -> bool {
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
        let (first, last) = self.soft_ends(light);
        let finer = index.saturating_sub(last);
        let (columns, rows) = lattices[index.min(last)];
        if self.settings.estimator == Estimator::Splat && index == first {
            return (columns.div_ceil(2), rows.div_ceil(2));
        }
        (columns << finer, rows << finer)
    }

    /// Where the first picture begins, and where a bake without a target ends.
    fn soft_ends(&self, light: &AimedLight) -> (usize, usize) {
        let last = self.lattices(light).len() - 1;
        if self.settings.max_error.is_some() {
            (0, last)
        } else {
            (last.saturating_sub(1), last)
        }
    }

    /// What comes after the levels so far; `None` where they are enough.
    pub(super) fn next_resolved(&self, light: &AimedLight, climb: &Climb) -> Option<Resolved> {
        let (first, last) = self.soft_ends(light);
        let most = self.settings.wavefronts.unwrap_or(MOST_WAVEFRONTS);
        let start = Resolved {
            lattice: first,
            wavefronts: FIRST_WAVEFRONTS.min(most),
        };
        let Some(level) = climb.levels.last() else {
            return Some(start);
        };
        let at = level.key.resolved?;
        let more = Resolved {
            wavefronts: at.wavefronts * 2,
            ..at
        };
        let finer = Resolved {
            lattice: at.lattice + 1,
            ..at
        };
        let is_fixed = self.settings.max_error.is_none();
        let wanted = self.settings.wavefronts.unwrap_or(USUAL_WAVEFRONTS);
        match (&level.parts.spread, &level.parts.lattice) {
            (None, _) if at.wavefronts < most => Some(more),
            (_, None) => Some(finer),
            _ if is_fixed && at.lattice < last => Some(finer),
            _ if is_fixed => (at.wavefronts < wanted).then_some(more),
            (spread, lattice) => {
                let of = |part: &Option<accuracy::LightError>| {
                    part.as_ref().map_or(0.0, |part| part.relative_rmse)
                };
                let can_more = at.wavefronts < most;
                let can_finer = at.lattice < last + MOST_FINER;
                if can_more && (of(spread) >= of(lattice) || !can_finer) {
                    Some(more)
                } else {
                    can_finer.then_some(finer)
                }
            }
        }
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
        self.estimate_soft(&mut level, climb.levels.last(), course);
        climb.levels.push(level);
        Ok(())
    }

    fn soft_key(&self, light: &AimedLight, resolved: Resolved, step: usize, sizes: &Sizes) -> LevelKey {
        let size = self.soft_lattice(light, resolved.lattice);
        let (_, last) = self.soft_ends(light);
        let coarser = last as i32 - resolved.lattice as i32;
        let mut trace = self.trace_key(size, coarser, &[]);
        // It chooses the points of all wavefronts.
        trace.settings.seed = self.settings.seed;
        LevelKey {
            trace,
            resolved: Some(resolved),
            coarseness: self.soft_coarseness(resolved.lattice, light),
            ..self.key(
                light,
                step.min(self.lattices(light).len() - 1),
                (&[], None),
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
        let source = &self.tracer.scene().lights[light.light];
        let real_w = power_w * source.strength().max_channel();
        if power_w.is_finite() && power_w > 0.0 && real_w.is_finite() {
            return Ok(FluxUnit::for_power(power_w * f64::from(MOST_WAVEFRONTS)));
        }
        Err(Error::failure(
            &self.tracer.scene().source,
            format!("light `{}` sends {real_w:e} W", source.name),
            "give it an intensity that makes that a finite number",
        ))
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
        // The wavefronts so far are the first of the new ones.
        let before = before.filter(|before| {
            let fewer = before.key.resolved.map(|before| before.wavefronts);
            before.key.trace == key.trace
                && before.key.sizes == key.sizes
                && fewer < Some(resolved.wavefronts)
        });
        let first = before
            .and_then(|before| before.key.resolved)
            .map_or(0, |before| before.wavefronts);
        let watch = Stopwatch::start();
        let (mut report, mut maps) =
            self.run_wavefronts(light, &key, unit, first..resolved.wavefronts, course);
        share_time(&mut report, watch.elapsed());
        course.outcome.count(&report, course.clock);
        if self.has_places(light) {
            course.outcome.meter.places.rays += report.rays;
            course.outcome.meter.places.deposits += report.deposits.transmitted + report.deposits.reflected;
        }
        let mut ledger = report.ledger;
        if let Some(before) = before {
            maps.add(before.maps.clone());
            ledger.merge(&before.ledger);
        }
        Ok((!report.cancelled).then(|| LightLevel {
            unit: unit.shared(resolved.wavefronts),
            key,
            maps,
            ledger,
            overreaches: Vec::new(),
            noise: None,
            error: None,
            traced: None,
            parts: SoftParts::default(),
        }))
    }

    /// Maps summed over some wavefronts.
    fn run_wavefronts(
        &self,
        light: &AimedLight,
        key: &LevelKey,
        unit: FluxUnit,
        wavefronts: std::ops::Range<u32>,
        course: &Course,
    ) -> (PassReport, ReceiverMaps) {
        let count = wavefronts.len();
        let texels: u64 = key
            .sizes
            .values()
            .map(|&(width, height)| (width * height) as u64)
            .sum();
        // Each task has maps of its own.
        let room = self.settings.memory_bytes / 4 / (texels * super::BYTES_PER_TEXEL).max(1);
        let tasks = rayon::current_num_threads()
            .min(count)
            .min((room as usize).max(1))
            .max(1);
        let done = std::sync::atomic::AtomicU64::new(0);
        let chart_for = |object: usize| self.chart(object, &key.sizes);
        let receivers = Receivers::new(self.tracer, &chart_for);
        let lit = (&receivers, &chart_for as &ChartFor);
        let parts: Vec<(PassReport, ReceiverMaps)> = (0..tasks)
            .into_par_iter()
            .map(|task| {
                let mut report = PassReport::default();
                let mut maps = self.no_maps();
                for index in wavefronts.clone().skip(task).step_by(tasks) {
                    if course.control.is_cancelled() {
                        report.cancelled = true;
                        break;
                    }
                    if let Some(wavefront) = self.wavefront(light, index) {
                        report.merge(self.run_wavefront(&wavefront, key, unit, lit, &mut maps, course));
                    }
                    let done = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
                    self.progress.advance(Stage::Caustic, done, count as u64);
                }
                (report, maps)
            })
            .collect();
        let mut sum = (PassReport::default(), self.no_maps());
        for (report, maps) in parts {
            sum.0.merge(report);
            sum.1.add(maps);
        }
        sum
    }

    /// Compares a level with the one before it.
    fn estimate_soft(&self, level: &mut LightLevel, before: Option<&LightLevel>, course: &mut Course) {
        let watch = Stopwatch::start();
        level.parts = SoftParts::default();
        level.error = None;
        if let Some(before) = before
            && let (Some(now), Some(then)) = (level.key.resolved, before.key.resolved)
        {
            let ledger = level.ledger.report("", level.unit, LinearSrgb::WHITE).energy_w;
            let fine = accuracy::images(&level.maps, level.unit);
            let coarse = accuracy::images(&before.maps, before.unit);
            level.parts = before.parts.clone();
            if now.lattice == then.lattice {
                // (A − B)/2 of two independent halves is as large as the error of their mean.
                level.parts.spread = accuracy::by_difference(&fine, &coarse, 1.0, &ledger);
            } else {
                level.parts.lattice = accuracy::by_difference(&fine, &coarse, LATTICE_SHARE, &ledger);
            }
            level.error = match (&level.parts.spread, &level.parts.lattice) {
                (Some(spread), Some(lattice)) => Some(KeptError {
                    predecessors: 0,
                    estimate: accuracy::together(spread, lattice),
                }),
                _ => None,
            };
        }
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
        maps: &mut ReceiverMaps,
        course: &Course,
    ) -> PassReport {
        match self.settings.estimator {
            Estimator::Wavefront => self.run_patches(wavefront, key, unit, lit, maps, course),
            Estimator::Splat => self.run_splats(wavefront, key, unit, maps, course),
        }
    }
}
