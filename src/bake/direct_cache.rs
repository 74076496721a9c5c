//! Cache of the direct layer: what edits and settings do not affect is not traced again.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::illumination::{Chart, Receiver};
use crate::light_pass::direct::{DirectLayer, bake_direct};
use crate::progress::{Control, Progress};
use crate::transport::Tracer;

/// The charts that direct light of one map is baked on.
#[derive(Clone, Debug)]
pub(super) struct DirectChart {
    pub(super) own: Arc<Chart>,
    /// Finer chart of the texels that are subdivided at shadow borders.
    pub(super) smaller: Option<Arc<Chart>>,
}

pub(super) type DirectCharts = BTreeMap<Receiver, DirectChart>;

impl DirectChart {
    /// Width and height, and the width of the finer chart (0 without one).
    fn size(&self) -> [usize; 3] {
        let smaller = self.smaller.as_ref().map_or(0, |smaller| smaller.width);
        [self.own.width, self.own.height, smaller]
    }

    fn key(&self, light: usize) -> Key {
        (light, self.own.receiver, self.size())
    }
}

/// Light, receiver, and size of the chart.
type Key = (usize, Receiver, [usize; 3]);

/// Direct light at unit strength, by light and map.
#[derive(Debug, Default)]
pub(super) struct DirectCache {
    layers: BTreeMap<Key, DirectLayer>,
    /// Sum over all lights, at their strengths in this bake.
    together: Mutex<BTreeMap<Receiver, SummedIrradiance>>,
}

/// A chart and E of all lights on it [W/m²].
type SummedIrradiance = (Arc<Chart>, Vec<[f32; 3]>);

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DirectReport {
    pub(super) shadow_rays: u64,
    /// False if cancelled; unfinished layers are not kept.
    pub(super) complete: bool,
}

impl DirectCache {
    /// Drops everything, because shapes or materials changed.
    pub(super) fn clear(&mut self) {
        self.layers.clear();
        self.begin();
    }

    /// Drops the sums, because strengths of lights may have changed.
    pub(super) fn begin(&mut self) {
        self.together
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner)
            .clear();
    }

    /// Sum of all lights on a chart, from `add_up` unless this bake has it already.
    pub(super) fn together(
        &self,
        chart: &Arc<Chart>,
        add_up: impl FnOnce() -> Option<Vec<[f32; 3]>>,
    ) -> Option<Vec<[f32; 3]>> {
        let known = || self.together.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, sum)) = known()
            .get(&chart.receiver)
            .filter(|(of, _)| Arc::ptr_eq(of, chart))
        {
            return Some(sum.clone());
        }
        let sum = add_up()?;
        known().insert(chart.receiver, (Arc::clone(chart), sum.clone()));
        Some(sum)
    }

    /// Drops a light that changed.
    pub(super) fn forget(&mut self, light: usize) {
        self.layers.retain(|key, _| key.0 != light);
        self.begin();
    }

    pub(super) fn is_empty(&self) -> bool {
        self.layers.is_empty()
    }

    /// Whether every layer has all the samples that it needs.
    pub(super) fn is_refined(&self) -> bool {
        self.layers.values().all(|layer| layer.is_refined)
    }

    /// Whether all lights are cached on all charts.
    pub(super) fn knows(&self, lights: usize, charts: &DirectCharts) -> bool {
        let is_known = |light: usize| {
            charts
                .values()
                .all(|chart| self.layers.contains_key(&chart.key(light)))
        };
        (0..lights).all(is_known)
    }

    /// Bakes missing layers and drops those of other sizes. After a deadline of `control`, layers are as good as a few
    /// samples make them; a later bake with time left refines them.
    pub(super) fn complete(
        &mut self,
        tracer: &Tracer,
        charts: &DirectCharts,
        progress: &dyn Progress,
        control: &Control,
    ) -> DirectReport {
        let lights = &tracer.scene().lights;
        let wanted = |(_, receiver, size): &Key| {
            let chart = charts.get(receiver);
            chart.is_some_and(|chart| chart.size() == *size)
        };
        self.layers.retain(|key, _| wanted(key));
        let mut report = DirectReport {
            shadow_rays: 0,
            complete: true,
        };
        for (light, source) in lights.iter().enumerate() {
            let is_late = control.is_cancelled();
            let is_missing = |chart: &&DirectChart| {
                let known = self.layers.get(&chart.key(light));
                known.is_none_or(|layer| !layer.is_refined && !is_late)
            };
            let missing: Vec<&DirectChart> = charts.values().filter(is_missing).collect();
            let on: Vec<_> = missing
                .iter()
                .map(|chart| (&*chart.own, chart.smaller.as_deref()))
                .collect();
            let baked = bake_direct(tracer, &[source.of_unit_strength()], &on, progress, control);
            for (chart, layer) in missing.into_iter().zip(baked) {
                report.shadow_rays += layer.shadow_rays;
                report.complete &= layer.complete;
                self.begin();
                if layer.complete {
                    self.layers.insert(chart.key(light), layer);
                }
            }
        }
        report
    }

    /// A light at unit strength on a map; `None` if it was not baked.
    pub(super) fn layer(&self, light: usize, chart: &DirectChart) -> Option<&DirectLayer> {
        self.layers.get(&chart.key(light))
    }
}
