//! Bakes the caustic layer of all lights level by level: complete coarse maps first, then finer ones, each with its
//! error.

use std::sync::Arc;
use std::time::Instant;

use super::BakeCounts;
use super::clock::Clock;
use super::finish::CompletedLevel;
use super::forecast::{CostPoint, Forecast, forecast};
use super::goals::{Errors, Goal};
use super::light_level::{LightLevel, LightState, LightStates};
use super::map_size::Sizes;
use super::shards::{PassSums, ShardRole};
use super::showing::Showing;
use super::sizes::ChartCache;
use super::spectra::Spectra;
use super::splat_level::LEVEL_STRIDES;
use crate::error::{Error, Result, Warning};
use crate::light_pass::accuracy::LightError;
use crate::light_pass::footprint_statistics::FootprintStatistics;
use crate::light_pass::pass_report::PassReport;
use crate::light_pass::receiver_maps::ChartFor;
use crate::light_pass::shard_index::ShardIndex;
use crate::light_pass::visibility::{LightVisibility, VisibleLight};
use crate::plan::{Effect, EffectPlan};
use crate::progress::{Control, Progress};
use crate::settings::BakeSettings;
use crate::transport::Tracer;

/// Fraction of the time limit for this layer if indirect light is still to be gathered.
const PART_BEFORE_INDIRECT: f64 = 0.85;

/// Inputs of the caustic layer.
pub(super) struct CausticLayer<'a> {
    pub(super) tracer: &'a Tracer,
    pub(super) visibility: &'a LightVisibility,
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

/// One light in the running bake.
#[derive(Debug)]
pub(super) struct LightProgress<'a> {
    pub(super) visible: &'a VisibleLight,
    /// What is kept of it between bakes.
    pub(super) state: LightState,
    /// From coarse to fine.
    pub(super) levels: Vec<LightLevel>,
    /// Relative RMSE of this light's maps that the target of the whole bake asks for.
    pub(super) target_rmse: Option<f64>,
    pub(super) done: bool,
    /// Whether it was treated as negligible by mistake.
    pub(super) is_underrated: bool,
}

impl<'a> LightProgress<'a> {
    fn new(visible: &'a VisibleLight, state: LightState) -> Self {
        Self {
            visible,
            state,
            levels: Vec::new(),
            target_rmse: None,
            done: false,
            is_underrated: false,
        }
    }

    /// Begins anew, as a light that is not negligible.
    fn start_over(&mut self) {
        *self = Self {
            is_underrated: true,
            ..Self::new(self.visible, std::mem::take(&mut self.state))
        };
    }

    /// Error of the last level, if known.
    pub(super) fn error(&self) -> Option<&LightError> {
        self.levels.last()?.error.as_ref()
    }
}

/// The level to show of each light that has one.
pub(super) fn shown<'a>(lights: &'a [LightProgress]) -> Vec<CompletedLevel<'a>> {
    lights
        .iter()
        .filter_map(|light| Some((light.visible.light, light.levels.last()?)))
        .collect()
}

/// Mutable state of a running bake.
pub(super) struct BakeContext<'a> {
    pub(super) control: &'a Control,
    pub(super) clock: &'a mut Clock,
    pub(super) outcome: &'a mut CausticOutcome,
    /// Whether passes run here, in part, or come from shards.
    pub(super) role: &'a mut ShardRole,
    /// Sizes of all maps.
    pub(super) sizes: Sizes,
    /// Mean footprints, if needed.
    pub(super) statistics: Option<Arc<FootprintStatistics>>,
    /// Minimum goal of first levels.
    pub(super) first_goal: f64,
    /// What each light may keep besides its last maps, of coarser levels and again of squares [bytes].
    pub(super) spare_bytes: u64,
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
    /// Bakes all lights, reusing levels that are still valid. `showing` gets every result but the last.
    ///
    /// # Errors
    /// Light that the estimator cannot follow; a power that is not finite; shards whose maps may exceed the memory
    /// limit.
    pub(super) fn bake(
        &self,
        states: &mut LightStates,
        (clock, role): (&mut Clock, &mut ShardRole),
        showing: Option<&mut Showing>,
    ) -> Result<CausticOutcome> {
        self.refuse_coarser_shards(role)?;
        self.refuse_soft_light()?;

        // Indirect light needs the last part of the time. The first picture takes as long as it takes.
        let part = if self.plan.is_on(Effect::Indirect) {
            PART_BEFORE_INDIRECT
        } else {
            1.0
        };
        let limit_s = self.settings.max_time_s.map(|limit_s| part * limit_s);
        let limited = super::limited(self.control, limit_s, self.began);
        let whole = self.control.without_deadline();

        // All lights and levels are deposited on maps of the same sizes, so that these are found first.
        let mut outcome = CausticOutcome::default();
        let mut lights = self.begin(states);
        let mut context = BakeContext {
            control: &limited,
            clock,
            outcome: &mut outcome,
            role,
            sizes: Sizes::default(),
            statistics: None,
            first_goal: 0.0,
            spare_bytes: 0,
            open_lights: lights.len(),
        };
        self.find_sizes(&mut states.statistics, &mut lights, &mut context)?;
        context.control = &whole;
        let errors = self.refine(states, &mut lights, &mut context, &limited, showing)?;

        // Levels and squares are kept for the next bake, as far as memory allows.
        let spare_bytes = context.spare_bytes;
        outcome.stopped = self.stopped(&lights, &errors, &limited);
        for mut light in lights {
            if !light.levels.is_empty() {
                outcome.finished.push(light.visible.light);
            }
            light.state.keep(light.levels, spare_bytes);
            states.put(light.visible.light, light.state);
        }
        Ok(outcome)
    }

    /// A shard knows only its own part of the light, so that sizes of maps must not depend on what is lit.
    fn refuse_coarser_shards(&self, role: &ShardRole) -> Result<()> {
        if !role.is_cut() || self.fits_anyway() {
            return Ok(());
        }
        Err(Error::failure(
            "--memory",
            format!(
                "shards need maps of a fixed size, but these may take more than {} MiB and would be made coarser",
                self.settings.map_memory_bytes() >> 20
            ),
            "allow more --memory or ask for a smaller --map-resolution",
        ))
    }

    /// Adds levels to the lights until all of them are done or `limited` is cancelled, and shows each round but the last.
    /// Returns the errors of the last.
    fn refine<'b>(
        &self,
        states: &LightStates,
        lights: &mut [LightProgress],
        context: &mut BakeContext<'b>,
        limited: &'b Control,
        mut showing: Option<&mut Showing>,
    ) -> Result<Errors> {
        let mut is_first = true;
        loop {
            // Lights that are done leave their room to the others.
            context.open_lights = lights.len();
            let own_bytes = self.squares_bytes(context);
            let done = lights.iter_mut().filter(|light| light.done);
            done.for_each(|light| light.state.fit_squares(own_bytes));
            context.open_lights = lights.iter().filter(|light| !light.done).count();

            // Each round adds a level to every light that is not done, so that every picture shows all of them.
            for light in lights.iter_mut().filter(|light| !light.done) {
                self.advance(light, context)?;
            }

            // The first caustics are shown before the visible error asks for direct light on all maps.
            if let Some(showing) = &mut showing
                && std::mem::take(&mut is_first)
                && !self.control.is_cancelled()
            {
                showing.show_first(&shown(lights), context.outcome, context.clock);
            }

            // The target is divided between the lights; those that meet their part are done.
            let errors = self.errors_of_round(lights, context, showing.as_deref_mut())?;
            self.decide(lights, &errors);
            self.note_cost(states, lights, &errors, context);

            // The first picture ignores the time limit, the others respect it.
            context.control = limited;
            if limited.is_cancelled() || lights.iter().all(|light| light.done) {
                return Ok(errors);
            }

            // The last round is not shown: the finished maps are those of its levels.
            if let Some(showing) = &mut showing {
                showing.show(&shown(lights), context.outcome, context.clock);
            }
        }
    }

    /// Errors of the levels so far. Light that was taken for negligible may be bright on one spot: it begins anew, and
    /// changes the errors.
    fn errors_of_round(
        &self,
        lights: &mut [LightProgress],
        context: &mut BakeContext,
        mut showing: Option<&mut Showing>,
    ) -> Result<Errors> {
        let terms = self.error_terms(lights, showing.as_deref_mut());
        let errors = self.errors(lights, &terms);
        let dim = self.promote_dim_lights(&errors, lights);
        if dim.is_empty() {
            return Ok(errors);
        }
        for index in dim {
            lights[index].start_over();
            self.advance(&mut lights[index], context)?;
        }
        let terms = self.error_terms(lights, showing);
        Ok(self.errors(lights, &terms))
    }

    /// All lights, with what is still valid of their states.
    fn begin<'b>(&'b self, states: &mut LightStates) -> Vec<LightProgress<'b>> {
        let lights: Vec<&VisibleLight> = self.lit().collect();
        let scene = self.tracer.scene();
        let moving = (lights.len() > 1 && scene.is_animated()).then_some(&**scene);
        let begin = |light: &'b VisibleLight| {
            let mut state = states.take(light.light);
            let bytes = self.kept_light_bytes();
            state.begin(light, self.spectra.has(light.light), bytes, moving);
            LightProgress::new(light, state)
        };
        lights.into_iter().map(begin).collect()
    }

    /// Records the cost of this level if its error is known.
    fn note_cost(
        &self,
        states: &LightStates,
        lights: &[LightProgress],
        errors: &Errors,
        context: &mut BakeContext,
    ) {
        let error = errors.error();
        // An unchanged error means that the level was cut off.
        let last = context.outcome.course.last();
        let is_known = last.is_some_and(|last| last.error == error);
        if !errors.are_of_all(lights) || !error.is_finite() || is_known {
            return;
        }

        // States of the lights in this bake were taken out of `states`, and are counted with their levels.
        let kept = lights.iter().map(|light| light.state.bytes());
        let held = lights
            .iter()
            .flat_map(|light| &light.levels)
            .map(LightLevel::bytes);
        let clock = &context.clock;
        let point = CostPoint {
            rays: context.outcome.counts.rays,
            cpu_s: clock.plan.cpu + clock.trace.cpu + clock.deposit.cpu,
            wall_s: clock.plan.wall + clock.trace.wall + clock.deposit.wall,
            bytes: states.bytes() + kept.sum::<u64>() + held.sum::<u64>(),
            error,
            is_by_photons: lights
                .iter()
                .filter_map(|light| light.levels.last()?.key.photons.as_ref()?.count())
                .next()
                .is_some(),
        };
        context.outcome.course.push(point);

        // Only the first forecast is kept: at the end it is compared with the actual cost.
        let Some(target) = self.settings.max_error else {
            return;
        };
        if let Some(expected) = forecast(&context.outcome.course, target, self.settings.estimator) {
            self.progress.expect(&expected.in_words());
            context.outcome.forecast.get_or_insert((point, expected));
        }
    }

    /// Why no finer level follows.
    fn stopped(&self, lights: &[LightProgress], errors: &Errors, limited: &Control) -> Option<Stopped> {
        if self.control.is_cancelled() {
            return Some(Stopped::Cancelled);
        }
        if limited.is_cancelled() && !lights.iter().all(|light| light.done) {
            return Some(Stopped::Time);
        }
        let target = self.settings.max_error?;
        (errors.is_empty() || errors.error() <= target).then_some(Stopped::Target)
    }

    /// Lights of nonzero strength that reach something specular.
    pub(super) fn lit(&self) -> impl Iterator<Item = &VisibleLight> {
        let scene = self.tracer.scene();
        let lights = self.visibility.lights.iter();
        lights.filter(|light| scene.lights[light.light].strength().max_channel() > 0.0)
    }

    /// Does something with the rays of a light, whose ways are noted where its state asks for that.
    pub(super) fn noting<'b, R>(
        &self,
        light: &mut LightProgress<'b>,
        run: impl FnOnce(&CausticLayer, &mut LightProgress<'b>) -> R,
    ) -> R {
        let traversed = light.state.traversed.as_ref();
        let noting = traversed.map(|traversed| self.tracer.noting(traversed));
        let tracer = noting.as_ref().unwrap_or(self.tracer);
        run(&CausticLayer { tracer, ..*self }, light)
    }

    /// Adds one level to a light.
    fn advance(&self, light: &mut LightProgress, context: &mut BakeContext) -> Result<()> {
        self.noting(light, |layer, light| layer.next_level(light, context))
    }

    fn next_level(&self, light: &mut LightProgress, context: &mut BakeContext) -> Result<()> {
        if self.settings.estimator.refines() {
            return self.advance_photons(light, context);
        }
        let unit = self.unit(light.visible)?;
        let key = self.key(light, None, context);
        let made = match light.state.take(&key) {
            Some(level) => Some(level),
            None => self.make_splats(light, key, unit, context)?,
        };
        if let Some(mut level) = made {
            if level.error.is_none() && !context.control.is_cancelled() {
                level.error = self.error_of_splats(light, &level, context)?;
            }
            light.levels.push(level);
        }
        Ok(())
    }

    /// Decides which lights continue.
    fn decide(&self, lights: &mut [LightProgress], errors: &Errors) {
        let goals = self.goals(lights, errors);
        for (light, goal) in lights.iter_mut().zip(goals).filter(|(light, _)| !light.done) {
            light.done = match goal {
                Goal::Converged => true,
                Goal::NextLevel => !self.has_next_level(light),
                Goal::Refine(target) => {
                    let is_good = light.error().is_some_and(|error| error.relative_rmse <= target);
                    is_good || !self.has_next_level(light)
                }
            };
        }
    }

    pub(super) fn has_next_level(&self, light: &LightProgress) -> bool {
        if !self.settings.estimator.refines() {
            return light.levels.len() < LEVEL_STRIDES.len();
        }
        self.next_aim(light.visible, light.levels.last(), light.target_rmse)
            .is_some()
    }
}

impl CausticOutcome {
    /// Adds the counts and times of a pass.
    pub(super) fn count(&mut self, report: &PassReport, clock: &mut Clock) {
        self.counts.rays += report.rays;
        self.counts.segments += report.segments;
        self.counts.splats += report.splats;
        self.counts.cells += report.squares;
        clock.trace.add(report.trace_s);
        clock.deposit.add(report.deposit_s);
    }
}
