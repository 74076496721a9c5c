//! Schedules direct light beside the levels of the caustic layer, timed separately.

use super::caustic::CausticOutcome;
use super::clock::Clock;
use super::direct_cache::{DirectCache, DirectCharts};
use super::sizes::ChartCache;
use crate::light_pass::pass_report::{Seconds, Stopwatch};
use crate::progress::{Control, Progress};
use crate::settings::BakeSettings;
use crate::transport::Tracer;

/// Work of the direct layer in this bake.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DirectWork {
    shadow_rays: u64,
    seconds: Seconds,
}

impl DirectWork {
    /// Finds the shadow borders that maps have to resolve.
    pub(super) fn look_for_borders(
        &mut self,
        tracer: &Tracer,
        sizes: &ChartCache,
        settings: &BakeSettings,
        control: &Control,
    ) {
        let watch = Stopwatch::start();
        self.shadow_rays += sizes.find_borders(tracer, settings, control);
        self.seconds.add(watch.elapsed());
    }

    /// Bakes missing layers; false if cancelled.
    pub(super) fn bake_missing(
        &mut self,
        tracer: &Tracer,
        charts: &DirectCharts,
        direct: &mut DirectCache,
        progress: &dyn Progress,
        control: &Control,
    ) -> bool {
        let watch = Stopwatch::start();
        let report = direct.complete(tracer, charts, progress, control);
        self.shadow_rays += report.shadow_rays;
        self.seconds.add(watch.elapsed());
        report.complete
    }

    /// The outcome with this work added.
    pub(super) fn added_to(&self, outcome: &CausticOutcome) -> CausticOutcome {
        let mut both = outcome.clone();
        both.counts.shadow_rays += self.shadow_rays;
        both
    }

    pub(super) fn clock(&self, clock: &Clock) -> Clock {
        let mut both = *clock;
        both.trace.add(self.seconds);
        both
    }
}
