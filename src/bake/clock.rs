//! Wall and CPU time of a bake, by stage.

use super::result::Timings;
use crate::light_pass::pass_report::{Seconds, Stopwatch};

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Clock {
    pub(super) build: Seconds,
    pub(super) plan: Seconds,
    pub(super) trace: Seconds,
    pub(super) deposit: Seconds,
    pub(super) total: Seconds,
}

impl Clock {
    pub(super) fn time<T>(
        &mut self,
        stage: impl Fn(&mut Self) -> &mut Seconds,
        work: impl FnOnce() -> T,
    ) -> T {
        let watch = Stopwatch::start();
        let done = work();
        stage(self).add(watch.elapsed());
        done
    }

    pub(super) fn timings(&self) -> (Timings, Timings) {
        let of = |pick: fn(Seconds) -> f64| Timings {
            load: 0.0,
            build: pick(self.build),
            plan: pick(self.plan),
            trace: pick(self.trace),
            deposit: pick(self.deposit),
            total: pick(self.total),
        };
        (of(|seconds| seconds.wall), of(|seconds| seconds.cpu))
    }
}
