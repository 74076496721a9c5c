//! Bakes the caustic layer of all lights level by level: complete coarse maps first, then finer ones, each with its
//! error.

use std::time::Instant;

use super::BakeCounts;
use super::carrier::Carrier;
use super::clock::Clock;
use super::finish::CompletedLevel;
use super::forecast::{CostPoint, Forecast, forecast};
use super::goals::{Errors, Goal};
use super::light_level::{KeptError, LevelKey, LightLevel, LightState, LightStates};
use super::map_size::Sizes;
use super::metric::{Backdrop, ErrorTerms};
use super::shards::{PassSums, ShardRole};
use super::sizes::ChartCache;
use super::spectra::Spectra;
use crate::error::{Error, Result, Warning};
use crate::illumination::accumulator::FluxUnit;
use crate::illumination::{Receiver, Side};
use crate::light_pass::accuracy::{self, Images, LightError, PreviousRound};
use crate::light_pass::caustic::pass::{PassReport, Stopwatch};
use crate::light_pass::caustic::setup::{LightVisibility, VisibleLight};
use crate::light_pass::caustic::statistics::FootprintStatistics;
use crate::light_pass::receiver_maps::ChartFor;
use crate::light_pass::shard_index::ShardIndex;
use crate::light_pass::wavefront::refine::Round;
use crate::optics::LinearSrgb;
use crate::plan::{Effect, EffectPlan};
use crate::progress::{Control, Progress};
use crate::settings::{BakeSettings, Estimator};
use crate::transport::Tracer;

/// Levels needed for an error estimate; each lattice has half the step of the one before.
pub(super) const ESTIMATED_LEVELS: usize = 3;

/// A round of refinement aims at this fraction of the target, so that a near miss does not cost another round.
const GOAL: f64 = 0.85;

/// Lower bound of a round's goal, relative to the error before it.
const ROUND_GAIN: f64 = 0.4;

/// Maximum rounds of refinement; cells are then 2¹⁶ times smaller than the first ones.
const MAX_ROUNDS: usize = 8;

/// Lumped share of patches above which photons take over: such light looks more converged than it is.
const MAX_LUMPED_SHARE: f64 = 0.3;

/// Fraction of the time limit for this layer if indirect light is still to be gathered.
const PART_BEFORE_INDIRECT: f64 = 0.85;

/// Inputs of the caustic layer.
pub(super) struct CausticLayer<'a> {
    pub(super) tracer: &'a Tracer,
    pub(super) aim: &'a LightVisibility,
    pub(super) settings: &'a BakeSettings,
    pub(super) sizes: &'a ChartCache,
    /// Spectra of the lights that are traced by wavelength.
    pub(super) spectra: &'a Spectra,
    pub(super) plan: &'a EffectPlan,
    pub(super) progress: &'a dyn Progress,
    /// Cancellation by the user.
    pub(super) control: &'a Control,
    /// Start of the whole bake.
    pub(super) began: Instant,
}

/// State of the layer's bake.
#[derive(Clone, Debug, Default)]
pub(super) struct CausticOutcome {
    /// Work of this layer in this bake.
    pub(super) counts: BakeCounts,
    /// Cost and error after each level whose error is known.
    pub(super) course: Vec<CostPoint>,
    /// Cost point and forecast from when the error was first known.
    pub(super) forecast: Option<(CostPoint, Forecast)>,
    pub(super) warnings: Vec<Warning>,
    /// Why refinement ended before the finest lattice; `None` if it did not.
    pub(super) stopped: Option<Stopped>,
    /// Lights with maps; the last level of each one's state is shown.
    pub(super) finished: Vec<usize>,
}

/// Why refinement ended early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stopped {
    /// The estimated error met the target.
    Target,
    /// The time limit was reached.
    Time,
    /// The user cancelled.
    Cancelled,
}

/// Levels of one light in the running bake.
#[derive(Debug, Default)]
pub(super) struct LightProgress {
    pub(super) carrier: Carrier,
    /// Last level of the other carrier, shown while its error is lower: photons traced to predict their cost, or
    /// abandoned patches.
    pub(super) rival: Option<LightLevel>,
    /// From coarse to fine.
    pub(super) levels: Vec<LightLevel>,
    /// Wall-clock time of the last level of patches [s].
    pub(super) level_s: f64,
    pub(super) rounds: Vec<Round>,
    /// Relative RMSE that the last round aims at.
    pub(super) goal: Option<f64>,
    /// Relative RMSE of this light's maps that the target of the whole bake asks for.
    pub(super) aim: Option<f64>,
    /// Number of levels, and the light's share of the error of the whole bake with that many, in the target metric.
    pub(super) shares: Vec<(usize, f64)>,
    /// Upper limit of that share.
    pub(super) most_share: Option<f64>,
    pub(super) done: bool,
    /// Whether it was treated as negligible by mistake.
    pub(super) is_underrated: bool,
}

impl LightProgress {
    /// The level to show: the last one, or the rival while it is better.
    pub(super) fn shown(&self) -> Option<&LightLevel> {
        if self.is_rival_better() {
            self.rival.as_ref()
        } else {
            self.levels.last()
        }
    }

    fn is_rival_better(&self) -> bool {
        let rmse = |level: &LightLevel| {
            let error = level.error.as_ref();
            error.map_or(f64::INFINITY, |error| error.estimate.relative_rmse)
        };
        match (self.levels.last(), &self.rival) {
            (Some(level), Some(rival)) => rmse(rival) < rmse(level),
            (level, _) => level.is_none(),
        }
    }

    /// Error of the last level, if known.
    pub(super) fn error(&self) -> Option<&LightError> {
        Some(&self.levels.last()?.error.as_ref()?.estimate)
    }
}

/// Receives the intermediate results of a bake.
pub(super) trait BakeObserver {
    /// Takes a result that is not the final one.
    ///
    /// # Errors
    /// An error ends the bake.
    fn show(
        &mut self,
        _levels: &[CompletedLevel],
        _so_far: &CausticOutcome,
        _clock: &mut Clock,
    ) -> Result<()> {
        Ok(())
    }

    /// Takes the first result, when the light of other layers is not known yet.
    ///
    /// # Errors
    /// An error ends the bake.
    fn show_first(
        &mut self,
        _levels: &[CompletedLevel],
        _so_far: &CausticOutcome,
        _clock: &mut Clock,
    ) -> Result<()> {
        Ok(())
    }

    /// Light of other layers on the maps of these levels and on all other maps.
    fn backdrop(&mut self, _levels: &[CompletedLevel]) -> Backdrop {
        Backdrop::new()
    }
}

impl BakeObserver for () {}

/// The level to show of each light that has one.
pub(super) fn shown<'a>(
    lights: &[&VisibleLight],
    all_progress: &'a [LightProgress],
) -> Vec<CompletedLevel<'a>> {
    let pictures = lights.iter().zip(all_progress);
    pictures
        .filter_map(|(light, light_progress)| Some((light.light, light_progress.shown()?)))
        .collect()
}

/// Mutable state of a running bake.
pub(super) struct BakeContext<'a> {
    pub(super) control: &'a Control,
    pub(super) clock: &'a mut Clock,
    pub(super) outcome: &'a mut CausticOutcome,
    /// Whether passes run here, in part, or come from shards.
    pub(super) role: &'a mut ShardRole,
    /// Mean footprints, if needed.
    pub(super) statistics: Option<FootprintStatistics>,
    /// Receiver queries after which the next level of patches is abandoned.
    pub(super) most_queries: u64,
    /// Cancellation, including the time limit.
    pub(super) limited: &'a Control,
    /// Lights that are still being refined.
    pub(super) open_lights: usize,
}

impl BakeContext<'_> {
    /// Runs a pass over the lattice of a light. `run` adds the pass, or this shard's share of it, to the empty sums
    /// that it gets; a merge takes the sums from the shards instead.
    ///
    /// # Errors
    /// Sums that cannot be recorded or read from shards.
    pub(super) fn pass(
        &mut self,
        chart_for: &ChartFor,
        nothing: PassSums,
        run: impl FnOnce(&Self, Option<ShardIndex>, PassSums) -> PassSums,
    ) -> Result<PassSums> {
        if let ShardRole::Merge(merging) = self.role {
            return merging.pass(chart_for, nothing);
        }
        let share = self.role.share();
        let sums = run(self, share, nothing);
        self.role.note(&sums)?;
        Ok(sums)
    }
}

impl CausticLayer<'_> {
    /// Bakes all lights, reusing levels that are still valid. The observer sees every result but the last.
    ///
    /// # Errors
    /// Light that the estimator cannot follow; a power that is not finite; shards whose maps may exceed the memory
    /// limit.
    pub(super) fn bake(
        &self,
        states: &mut LightStates,
        (clock, role): (&mut Clock, &mut ShardRole),
        observer: &mut dyn BakeObserver,
    ) -> Result<CausticOutcome> {
        if role.is_cut() && !self.fits_anyway() {
            return Err(Error::failure(
                "--memory",
                format!(
                    "shards need maps of a fixed size, but these may take more than {} MiB and would be made coarser",
                    self.settings.map_memory_bytes() >> 20
                ),
                "allow more --memory or ask for a smaller --map-resolution",
            ));
        }
        let mut outcome = CausticOutcome::default();
        let lights: Vec<&VisibleLight> = self.lit().collect();
        self.refuse_soft_light(&lights)?;
        let whole = self.control.without_deadline();
        let part = if self.plan.is_on(Effect::Indirect) {
            PART_BEFORE_INDIRECT
        } else {
            1.0
        };
        let limit_s = self.settings.max_time_s.map(|limit_s| part * limit_s);
        let limited = super::limited(self.control, limit_s, self.began);
        let mut course = BakeContext {
            control: &limited,
            clock,
            outcome: &mut outcome,
            role,
            statistics: None,
            most_queries: u64::MAX,
            limited: &limited,
            open_lights: lights.len(),
        };
        let scene = self.tracer.scene();
        let moving = (lights.len() > 1 && scene.is_animated()).then_some(&**scene);
        for light in &lights {
            let state = states.of_mut(light.light);
            let has_bumps = self.plan.is_on(Effect::Bumps);
            let spectrum = self.spectra.key(light.light);
            let bytes = self.settings.kept_light_bytes();
            state.begin(light, (has_bumps, spectrum), bytes, moving);
        }
        let sizes = self.sizes_of_maps(states, &lights, &mut course)?;
        course.statistics = states.statistics.as_ref().map(|(_, known)| known.clone());
        let mut all_progress = Vec::with_capacity(lights.len());
        for light in &lights {
            all_progress.push(LightProgress {
                carrier: self.carrier(light),
                ..LightProgress::default()
            });
        }
        course.control = &whole;
        let mut is_first = true;
        let errors = loop {
            course.open_lights = all_progress
                .iter()
                .filter(|light_progress| !light_progress.done)
                .count();
            for (light, light_progress) in lights
                .iter()
                .zip(&mut all_progress)
                .filter(|(_, light_progress)| !light_progress.done)
            {
                self.advance(
                    light,
                    &sizes,
                    states.of_mut(light.light),
                    light_progress,
                    &mut course,
                )?;
            }
            if std::mem::take(&mut is_first) && !self.control.is_cancelled() {
                observer.show_first(&shown(&lights, &all_progress), course.outcome, course.clock)?;
            }
            let mut counting = self.counting(&lights, &all_progress, observer);
            let mut errors = self.errors(&lights, &all_progress, &counting);
            let promote_dim_lights = self.promote_dim_lights(&errors, &all_progress);
            for &index in &promote_dim_lights {
                all_progress[index] = LightProgress {
                    is_underrated: true,
                    carrier: all_progress[index].carrier,
                    ..LightProgress::default()
                };
                let state = states.of_mut(lights[index].light);
                self.advance(
                    lights[index],
                    &sizes,
                    state,
                    &mut all_progress[index],
                    &mut course,
                )?;
            }
            if !promote_dim_lights.is_empty() {
                counting = self.counting(&lights, &all_progress, observer);
                errors = self.errors(&lights, &all_progress, &counting);
            }
            self.decide(&lights, &mut all_progress, &errors, &counting);
            self.note_cost(states, &lights, &all_progress, &errors, &mut course);
            // The first picture ignores the time limit, the others respect it.
            course.control = &limited;
            if limited.is_cancelled() || all_progress.iter().all(|light_progress| light_progress.done) {
                break errors;
            }
            observer.show(&shown(&lights, &all_progress), course.outcome, course.clock)?;
        };
        outcome.stopped = self.stopped(&all_progress, &errors, &limited);
        for (light, mut light_progress) in lights.iter().zip(all_progress) {
            // The last level is shown; a rival that is worse is kept for the next bake.
            let is_better = light_progress.is_rival_better();
            if let Some(rival) = light_progress.rival.take() {
                let place = if is_better { light_progress.levels.len() } else { 0 };
                light_progress.levels.insert(place, rival);
            }
            if let Some(level) = light_progress.levels.last() {
                outcome.finished.push(light.light);
                let strays = level.strays.iter().map(|&receiver| self.stray(light, receiver));
                outcome.warnings.extend(strays);
            }
            let state = states.of_mut(light.light);
            state.keep(light_progress.levels, self.settings.memory_bytes);
        }
        Ok(outcome)
    }

    /// Records the cost of this level if its error is known.
    fn note_cost(
        &self,
        states: &LightStates,
        lights: &[&VisibleLight],
        all_progress: &[LightProgress],
        errors: &Errors,
        course: &mut BakeContext,
    ) {
        let error = errors.error();
        // The cost of the first photons says nothing about patches.
        let is_open = all_progress.iter().any(|light_progress| {
            light_progress.carrier == Carrier::Undecided
                && light_progress
                    .levels
                    .last()
                    .is_none_or(|level| level.error.is_none())
        });
        // An unchanged error means that the level was cut off.
        let is_known = course
            .outcome
            .course
            .last()
            .is_some_and(|last| last.error == error);
        if !errors.are_of_all(lights) || !error.is_finite() || is_open || is_known {
            return;
        }
        let held = all_progress
            .iter()
            .flat_map(|light_progress| &light_progress.levels)
            .map(LightLevel::bytes);
        let clock = &course.clock;
        let point = CostPoint {
            rays: course.outcome.counts.rays,
            cpu_s: clock.plan.cpu + clock.trace.cpu + clock.deposit.cpu,
            wall_s: clock.plan.wall + clock.trace.wall + clock.deposit.wall,
            bytes: states.bytes() + held.sum::<u64>(),
            error,
            is_coarse: lights.iter().zip(all_progress).any(|(light, light_progress)| {
                let begins = match light_progress.carrier {
                    Carrier::Photons => 1,
                    _ => self.lattices(light).len(),
                };
                !light_progress.done && light_progress.levels.len() < begins
            }),
            is_by_photons: all_progress
                .iter()
                .any(|light_progress| light_progress.carrier == Carrier::Photons),
        };
        course.outcome.course.push(point);
        let Some(target) = self.settings.max_error else {
            return;
        };
        if let Some(expected) = forecast(&course.outcome.course, target, self.settings.estimator) {
            self.progress.expect(&expected.in_words());
            course.outcome.forecast.get_or_insert((point, expected));
        }
    }

    /// The warning about a map that was dropped.
    fn stray(&self, light: &VisibleLight, receiver: Receiver) -> Warning {
        let scene = self.tracer.scene();
        Warning::new(
            &scene.objects[receiver.object()].name,
            format!(
                "light of `{}` on its {} side is less than a millionth as bright as on the other maps, and is left out",
                scene.lights[light.light].name,
                if receiver.side() == Side::Front {
                    "front"
                } else {
                    "back"
                }
            ),
            "bake with more --density if it should be there",
        )
    }

    /// Why no finer level follows.
    fn stopped(&self, all_progress: &[LightProgress], errors: &Errors, limited: &Control) -> Option<Stopped> {
        if self.control.is_cancelled() {
            return Some(Stopped::Cancelled);
        }
        if limited.is_cancelled() && !all_progress.iter().all(|light_progress| light_progress.done) {
            return Some(Stopped::Time);
        }
        let target = self.settings.max_error?;
        (errors.is_empty() || errors.error() <= target).then_some(Stopped::Target)
    }

    /// Lights of nonzero strength that reach something specular.
    pub(super) fn lit(&self) -> impl Iterator<Item = &VisibleLight> {
        let scene = self.tracer.scene();
        let lights = self.aim.lights.iter();
        lights.filter(|light| scene.lights[light.light].strength().max_channel() > 0.0)
    }

    /// Does something with the rays of a light, whose ways are noted where its state asks for that.
    pub(super) fn noting<R>(
        &self,
        state: &mut LightState,
        run: impl FnOnce(&CausticLayer, &mut LightState) -> R,
    ) -> R {
        let noting = state
            .traversed
            .as_ref()
            .map(|traversed| self.tracer.noting(traversed));
        let tracer = noting.as_ref().unwrap_or(self.tracer);
        run(&CausticLayer { tracer, ..*self }, state)
    }

    /// Adds one level to a light.
    fn advance(
        &self,
        light: &VisibleLight,
        sizes: &Sizes,
        state: &mut LightState,
        light_progress: &mut LightProgress,
        course: &mut BakeContext,
    ) -> Result<()> {
        self.noting(state, |layer, state| {
            layer.next_level(light, sizes, state, light_progress, course)
        })
    }

    fn next_level(
        &self,
        light: &VisibleLight,
        sizes: &Sizes,
        state: &mut LightState,
        light_progress: &mut LightProgress,
        course: &mut BakeContext,
    ) -> Result<()> {
        if light_progress.carrier == Carrier::Undecided {
            // Photons are shown before patches, which take longer.
            let made_photons = self.decide_carrier(light, sizes, state, light_progress, course)?;
            if made_photons {
                return Ok(());
            }
        }
        if light_progress.carrier == Carrier::Photons {
            return self.advance_photons(light, sizes, state, light_progress, course);
        }
        let unit = self.unit(light)?;
        let step = light_progress.levels.len();
        let key = self.key(light, step, light_progress, sizes);
        let began = Instant::now();
        let made = match state.take(&key) {
            Some(level) => Some(level),
            None => self.make(light, key, unit, state, course)?,
        };
        light_progress.level_s = began.elapsed().as_secs_f64();
        course.most_queries = u64::MAX;
        let Some(mut level) = made else {
            if light_progress.carrier == Carrier::Undecided && !course.control.is_cancelled() {
                light_progress.turn_to_photons();
            }
            return Ok(());
        };
        if light_progress.carrier == Carrier::Undecided && level.lumped_share > MAX_LUMPED_SHARE {
            light_progress.turn_to_photons();
            light_progress.rival = None;
            return Ok(());
        }
        if level.key.trace.is_negligible {
            // No better estimate is worth its cost: all of its light counts as error.
            let whole = accuracy::images(&level.maps, level.unit);
            let ledger = level.ledger.report("", level.unit, LinearSrgb::WHITE).energy_w;
            let estimate = accuracy::by_difference(&whole, &Images::new(), 1.0, &ledger);
            level.error = estimate.map(|estimate| KeptError {
                predecessors: 0,
                auditors: None,
                estimate,
            });
            light_progress.levels.push(level);
            light_progress.done = true;
            return Ok(());
        }
        self.judge(light, level, state, light_progress, course)
    }

    /// Adds a level of patches or splats with its estimated error.
    pub(super) fn judge(
        &self,
        light: &VisibleLight,
        mut level: LightLevel,
        state: &mut LightState,
        light_progress: &mut LightProgress,
        course: &mut BakeContext,
    ) -> Result<()> {
        let predecessors = light_progress.levels.len().min(ESTIMATED_LEVELS - 1);
        let auditors = light_progress.rival.as_ref().and_then(|rival| rival.key.photons);
        let is_known = |error: &KeptError| error.predecessors == predecessors && error.auditors == auditors;
        if !level.error.as_ref().is_some_and(is_known) && !course.control.is_cancelled() {
            let estimate = self.error_of(light, &level, state, light_progress, course)?;
            level.error = estimate.map(|estimate| KeptError {
                predecessors,
                auditors,
                estimate,
            });
        }
        light_progress.levels.push(level);
        Ok(())
    }

    /// Decides which lights continue, and towards which goal.
    fn decide(
        &self,
        lights: &[&VisibleLight],
        all_progress: &mut [LightProgress],
        errors: &Errors,
        counting: &ErrorTerms,
    ) {
        let goals = self.goals(lights, all_progress, errors);
        for ((light, light_progress), goal) in lights.iter().zip(all_progress).zip(goals) {
            if light_progress.done {
                continue;
            }
            light_progress.done = match goal {
                Goal::Converged => {
                    light_progress.carrier != Carrier::Undecided
                        || !self.lacks_auditors(light, light_progress)
                }
                Goal::NextLevel => !self.has_next_level(light, light_progress),
                Goal::Refine(target) if light_progress.carrier == Carrier::Photons => {
                    let is_good = light_progress
                        .error()
                        .is_some_and(|error| error.relative_rmse <= target);
                    is_good || !self.has_next_level(light, light_progress)
                }
                Goal::Refine(target) => !self.refine(light_progress, target, counting),
            };
        }
    }

    fn has_next_level(&self, light: &VisibleLight, light_progress: &LightProgress) -> bool {
        if light_progress.carrier == Carrier::Photons {
            self.next_photons(light, light_progress.levels.last(), light_progress.aim)
                .is_some()
        } else {
            light_progress.levels.len() < self.lattices(light).len()
        }
    }

    fn make(
        &self,
        light: &VisibleLight,
        key: LevelKey,
        unit: FluxUnit,
        state: &mut LightState,
        course: &mut BakeContext,
    ) -> Result<Option<LightLevel>> {
        match self.settings.estimator {
            estimator if estimator.refines() => self.make_wavefront(light, key, unit, state, course),
            _ => self.make_splats(light, key, unit, state, course),
        }
    }

    /// Error of a level, estimated from the levels before it; `None` while unknown, and for a shard's part.
    fn error_of(
        &self,
        light: &VisibleLight,
        level: &LightLevel,
        state: &mut LightState,
        light_progress: &LightProgress,
        course: &mut BakeContext,
    ) -> Result<Option<LightError>> {
        let is_shard = course.role.is_shard();
        let ledger = level.ledger.report("", level.unit, LinearSrgb::WHITE).energy_w;
        Ok(match self.settings.estimator {
            estimator if estimator.refines() && is_shard => None,
            estimator if estimator.refines() => {
                let watch = Stopwatch::start();
                let levels = light_progress.levels.iter().rev().take(ESTIMATED_LEVELS - 1);
                let coarser: Vec<Images> = levels
                    .map(|level| accuracy::images(&level.maps, level.unit))
                    .collect();
                let before = light_progress.rounds.last().and_then(|round| {
                    let error = &light_progress.levels.last()?.error.as_ref()?.estimate;
                    let refined = &round.tiles;
                    Some(PreviousRound { error, refined })
                });
                let fine = accuracy::images(&level.maps, level.unit);
                let mut estimate =
                    accuracy::estimate(&fine, [coarser.first(), coarser.get(1)], before, &ledger);
                if let (Some(estimate), Some(photons)) = (&mut estimate, &light_progress.rival) {
                    self.audit(light, &fine, photons, estimate);
                }
                course.clock.deposit.add(watch.elapsed());
                estimate
            }
            _ => {
                let thinner = self.thinned_images(light, level, state, course)?;
                match (thinner, &level.noise) {
                    (Some(thinner), Some(noise)) if !is_shard => {
                        let fine = accuracy::images(&level.maps, level.unit);
                        accuracy::estimate_splats(&fine, &thinner, noise, &ledger)
                    }
                    _ => None,
                }
            }
        })
    }

    /// Plans another round of refinement towards a relative RMSE; false if nothing is left to refine.
    fn refine(&self, light_progress: &mut LightProgress, target: f64, counting: &ErrorTerms) -> bool {
        let Some(error) = light_progress.error() else {
            return false;
        };
        if error.relative_rmse <= target {
            return false;
        }
        // One round hardly gains more, and smaller steps leave a result to show if time runs out.
        let goal = (GOAL * target).max(ROUND_GAIN * error.relative_rmse);
        if self.settings.estimator == Estimator::Splat || light_progress.rounds.len() >= MAX_ROUNDS {
            return false;
        }
        let Some(level) = light_progress.levels.last() else {
            return false;
        };
        let counted = match counting {
            ErrorTerms::Rmse => None,
            ErrorTerms::Visible(counts) => Some(counts.of_tiles(level, error)),
        };
        let tiles = accuracy::rough_tiles(error, goal, counted.as_ref());
        let is_any = !tiles.is_empty();
        let overshoots = &level.overshoots[..];
        let round = Round::new(tiles, overshoots);
        light_progress.rounds.push(round);
        light_progress.goal = Some(goal);
        is_any
    }
}

impl CausticOutcome {
    /// Adds the counts and times of a pass.
    pub(super) fn count(&mut self, report: &PassReport, clock: &mut Clock) {
        self.counts.rays += report.rays;
        self.counts.segments += report.segments;
        self.counts.splats += report.splats;
        self.counts.cells += report.cells;
        self.counts.receiver_queries += report.receiver_queries;
        clock.trace.add(report.trace_s);
        clock.deposit.add(report.deposit_s);
    }
}
