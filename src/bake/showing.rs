//! Intermediate maps: each level of the caustic layer, with the other layers as far as they are finished.

use std::sync::Arc;

use super::caustic::{CausticOutcome, Stopped};
use super::clock::Clock;
use super::direct_cache::{DirectCache, DirectCharts};
use super::direct_work::DirectWork;
use super::finish::{Charts, CompletedLevel, DirectDetail, MapAssembler};
use super::first_look::FirstLook;
use super::indirect_cache::IndirectCache;
use super::indirect_work::IndirectWork;
use super::metric::{Backdrop, ComparisonView};
use super::{Bake, LightLayer, PreparedBake, account};
use crate::error::Warning;
use crate::illumination::IlluminationMap;
use crate::light_pass::pass_report::Stopwatch;
use crate::optics::luminance;
use crate::plan::Effect;
use crate::progress::Control;
use crate::settings::LayerKind;

/// Receives intermediate results.
pub(super) type LevelCallback<'a> = dyn FnMut(Bake) + Send + 'a;

/// Maps, and what single lights add to them.
type AssembledMaps = (Vec<IlluminationMap>, Vec<LightLayer>);

/// Passes the levels of a bake to a callback.
pub(super) struct Showing<'a, 'level> {
    pub(super) finish: &'a MapAssembler<'a>,
    pub(super) bake: &'a PreparedBake<'a>,
    /// Runs since the start of the bake.
    pub(super) watch: &'a Stopwatch,
    /// After its deadline, direct light is not refined further.
    pub(super) for_direct: &'a Control,
    pub(super) level: Option<&'a mut LevelCallback<'level>>,
    pub(super) direct: &'a mut DirectCache,
    pub(super) indirect: &'a mut IndirectCache,
    pub(super) lamps: DirectWork,
    /// Whether no caustics have been shown yet.
    pub(super) is_first: bool,
    /// Stand-in for layers that are not baked yet, if nothing was shown before the bake.
    pub(super) first_look: Option<FirstLook>,
    /// The same after an edit; also indirect light for the error metric, if neither `first_look` nor the cache has any.
    pub(super) glance: Option<FirstLook>,
}

impl Showing<'_, '_> {
    /// A result with the cost of all stages so far.
    pub(super) fn assembled(
        &self,
        maps: AssembledMaps,
        levels: &[CompletedLevel],
        so_far: &CausticOutcome,
        clock: &mut Clock,
    ) -> Bake {
        let mut result = self.finish.result(maps, levels, so_far);
        clock.total = self.watch.elapsed();
        account(
            &mut result,
            self.finish,
            &self.bake.visibility,
            &self.lamps.clock(clock),
        );
        result
    }

    fn hand_out(
        &mut self,
        maps: AssembledMaps,
        levels: &[CompletedLevel],
        so_far: &CausticOutcome,
        clock: &mut Clock,
    ) {
        let result = self.assembled(maps, levels, so_far, clock);
        if let Some(level) = &mut self.level {
            level(result);
        }
    }

    /// The outcome with the work for direct light and item buffers.
    pub(super) fn with_direct(&self, so_far: &CausticOutcome) -> CausticOutcome {
        let mut both = self.lamps.added_to(so_far);
        both.counts.item_buffer_tests = self.bake.item_buffer_tests;
        both
    }

    /// Bakes direct light that is missing on these charts, where there is any; false if cancelled.
    fn bake_direct(&mut self, charts: &DirectCharts) -> bool {
        let detail = self.finish.direct;
        let progress = detail.progress(self.bake.progress);
        let tracer = &self.bake.tracer;
        detail == DirectDetail::Absent
            || self
                .lamps
                .bake_missing(tracer, charts, self.direct, progress, self.for_direct)
    }

    /// Bakes direct light on the charts that no intermediate picture or earlier bake has filled.
    pub(super) fn complete_direct(&mut self, charts: &Charts, outcome: &mut CausticOutcome) {
        if !self.bake_direct(&self.finish.direct_charts(charts)) {
            outcome.stopped = Some(Stopped::Cancelled);
        } else if self.finish.direct == DirectDetail::Full && !self.direct.is_refined() {
            outcome.warnings.push(Warning::new(
                "direct layer",
                "the time was up before all shadows had the samples that they need",
                "allow more --max-time",
            ));
        }
    }

    /// Adds the indirect light of finished layers to their maps, and shows it each time that it is less noisy.
    pub(super) fn gather_indirect(
        &mut self,
        (maps, parts): &mut AssembledMaps,
        levels: &[CompletedLevel],
        outcome: &mut CausticOutcome,
        clock: &mut Clock,
    ) {
        // The cache is taken out while solutions are shown.
        let mut cache = std::mem::take(self.indirect);
        let mut level = self.level.take();
        let mut gathered = IndirectWork::default();
        let mut show = |so_far: &IndirectWork, known: &IndirectCache| {
            let Some(level) = level.as_mut().filter(|_| self.bake.control.is_watched()) else {
                return;
            };
            let (mut maps, mut parts) = (maps.clone(), parts.clone());
            so_far.add_to(known, &mut maps, &mut parts);
            let (outcome, mut clock) = (so_far.added_to(outcome), so_far.clock(clock));
            level(self.assembled((maps, parts), levels, &outcome, &mut clock));
        };
        let is_complete = gathered.gather(self.bake, self.finish.sizes, &mut cache, maps, &mut show);
        if !is_complete {
            outcome.stopped = Some(Stopped::Cancelled);
        }
        gathered.add_to(&cache, maps, parts);
        *self.indirect = cache;
        *outcome = gathered.added_to(outcome);
        *clock = gathered.clock(clock);
    }

    /// Takes the first result, when the light of other layers is not known yet.
    pub(super) fn show_first(
        &mut self,
        levels: &[CompletedLevel],
        so_far: &CausticOutcome,
        clock: &mut Clock,
    ) {
        if self.level.is_none() || levels.is_empty() || self.finish.direct != DirectDetail::Full {
            return;
        }
        let (charts, _) = self.finish.charts(levels);
        let direct_charts = self.finish.direct_charts(&charts);
        if !self.direct.knows(self.finish.scene.lights.len(), &direct_charts) {
            self.show_coarse(levels, so_far, clock);
        }
    }

    /// Shows these levels, with a coarse look at direct and indirect light in their place: of a new scene, and after a
    /// change that moves shadows.
    fn show_coarse(&mut self, levels: &[CompletedLevel], so_far: &CausticOutcome, clock: &mut Clock) {
        self.is_first = false;
        let look = match &mut self.first_look {
            Some(look) => look,
            None => self.glance.get_or_insert_default(),
        };
        let PreparedBake {
            tracer,
            progress,
            control,
            ..
        } = self.bake;
        let maps = look.maps(self.finish, tracer, levels, *progress, control);
        self.hand_out(maps, levels, so_far, clock);
    }

    /// Takes a result that is not the final one.
    pub(super) fn show(&mut self, levels: &[CompletedLevel], so_far: &CausticOutcome, clock: &mut Clock) {
        let is_first = std::mem::take(&mut self.is_first);
        if self.level.is_none() {
            return;
        }
        if is_first && self.first_look.is_some() {
            return self.show_coarse(levels, so_far, clock);
        }

        // Assembling maps takes time, so that later levels are shown only to someone who watches.
        if !is_first && !self.bake.control.is_watched() {
            return;
        }

        // Direct light that is missing on the charts of these levels is baked before they are shown.
        let (finish, plan) = (self.finish, self.finish.plan);
        let (charts, memory_warning) = finish.charts(levels);
        let direct_charts = finish.direct_charts(&charts);
        // The first picture after a change has to come soon; direct light follows with the second.
        let waits = is_first && !self.direct.knows(finish.scene.lights.len(), &direct_charts);
        if !waits {
            self.bake_direct(&direct_charts);
        }

        // Indirect light is solved with rays that are there already. New ones are traced after the last level.
        let mut so_far = self.with_direct(so_far);
        so_far.warnings.extend(memory_warning);
        let (mut maps, mut parts) = finish.maps(levels, &charts, self.direct);
        if plan.is_on(Effect::Indirect) && !waits {
            let look = self.first_look.as_ref();
            let known = look.map_or(&*self.indirect, FirstLook::indirect);
            IndirectWork::of_known(known, &maps).add_to(known, &mut maps, &mut parts);
        }
        self.hand_out((maps, parts), levels, &so_far, clock);
    }

    /// Light of other layers on the maps of these levels and on all other maps.
    pub(super) fn backdrop(&mut self, levels: &[CompletedLevel]) -> Backdrop {
        // Where no other layer is wanted, errors are relative to the caustics alone.
        let finish = self.finish;
        if finish.direct == DirectDetail::Absent && !finish.plan.is_on(Effect::Indirect) {
            return Backdrop::new();
        }

        // Direct light is needed on all maps: it sets the exposure, and errors show less beside bright light.
        let (charts, _) = finish.charts(levels);
        self.bake_direct(&finish.direct_charts(&charts));
        let (mut maps, _) = finish.maps(levels, &charts, self.direct);

        // The indirect light of the first look, of the last bake or of a glance is good enough to weigh errors.
        if finish.plan.is_on(Effect::Indirect) {
            let known = match &self.first_look {
                Some(look) => look.indirect(),
                None if self.indirect.network().is_some() => &*self.indirect,
                None => self.glance.get_or_insert_default().traced(
                    finish,
                    &self.bake.tracer,
                    self.bake.progress,
                    self.for_direct,
                ),
            };
            IndirectWork::of_known(known, &maps).add_to(known, &mut maps, &mut Vec::new());
        }

        // The metric knows luminance alone.
        let beside = maps.into_iter().map(|map| {
            let of = |kind: LayerKind| {
                let layer = map.layer(kind);
                layer.map_or_else(Vec::new, |layer| layer.irradiance.iter().map(luminance).collect())
            };
            let beside = ComparisonView {
                direct: of(LayerKind::Direct),
                indirect: of(LayerKind::Indirect),
                chart: Arc::clone(&map.chart),
            };
            (map.chart.receiver, beside)
        });
        beside.collect()
    }
}
