//! Cache of the direct layer: what edits and settings do not affect is not traced again.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::illumination::{Chart, Receiver};
use crate::light_pass::direct::{DirectLayer, bake_direct};
use crate::progress::{Control, Progress};
use crate::transport::Tracer;

/// What direct light is baked on.
#[derive(Clone, Debug)]
pub(super) struct DirectChart {
    pub(super) own: Arc<Chart>,
    /// Of the smaller texels into which it is divided where light ends within little.
    pub(super) smaller: Option<Arc<Chart>>,
}

pub(super) type DirectCharts = BTreeMap<Receiver, DirectChart>;

impl DirectChart {
    /// Texels across and down, and of the smaller ones.
    fn size(&self) -> [usize; 3] {
        let smaller = self.smaller.as_ref().map_or(0, |smaller| smaller.width);
        [self.own.width, self.own.height, smaller]
    }

    fn key(&self, light: usize) -> Key {
        (light, self.own.receiver, self.size())
    }
}

/// One light on one map: its place in the scene, the receiver, and the map's size.
type Key = (usize, Receiver, [usize; 3]);

/// Lights of unit strength, by light and map.
#[derive(Debug, Default)]
pub(super) struct DirectCache {
    layers: BTreeMap<Key, DirectLayer>,
    /// All lights together, at their strengths of this bake.
    together: Mutex<BTreeMap<Receiver, SummedIrradiance>>,
}

/// E of all lights on a chart [W/m²].
type SummedIrradiance = (Arc<Chart>, Vec<[f32; 3]>);

/// What a look for direct light took.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DirectReport {
    pub(super) shadow_rays: u64,
    /// False where it was cancelled: what is missing is black.
    pub(super) complete: bool,
}

impl DirectCache {
    /// Shapes or materials are not what they were.
    pub(super) fn clear(&mut self) {
        self.layers.clear();
        self.begin();
    }

    /// The strengths of lights may not be what they were.
    pub(super) fn begin(&mut self) {
        self.together
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner)
            .clear();
    }

    /// All lights together on a chart, as `add_up` does it, or as it was done before in this bake.
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

    /// A light is not what it was.
    pub(super) fn forget(&mut self, light: usize) {
        self.layers.retain(|key, _| key.0 != light);
        self.begin();
    }

    /// Whether nothing is known.
    pub(super) fn is_empty(&self) -> bool {
        self.layers.is_empty()
    }

    /// Whether all lights are known on all charts.
    pub(super) fn knows(&self, lights: usize, charts: &DirectCharts) -> bool {
        let is_known = |light: usize| {
            charts
                .values()
                .all(|chart| self.layers.contains_key(&chart.key(light)))
        };
        (0..lights).all(is_known)
    }

    /// Bakes what is missing, and forgets maps of other sizes.
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
            let is_missing = |chart: &&DirectChart| !self.layers.contains_key(&chart.key(light));
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

    /// A light of unit strength on a map; `None` where it was not baked.
    pub(super) fn layer(&self, light: usize, chart: &DirectChart) -> Option<&DirectLayer> {
        self.layers.get(&chart.key(light))
    }
}
