//! Direct light that was baked before: what edits and settings do not touch is not traced again.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::illumination::{Chart, Receiver};
use crate::light_pass::direct::bake_direct;
use crate::progress::{Control, Progress};
use crate::transport::Tracer;

/// One light on one map: its place in the scene, the receiver, and the map's size.
type Key = (usize, Receiver, (usize, usize));

/// E of lights of unit strength [W/m²], by light and map.
#[derive(Debug, Default)]
pub(super) struct DirectCache {
    layers: BTreeMap<Key, Arc<Vec<[f32; 3]>>>,
}

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
    }

    /// A light is not what it was.
    pub(super) fn forget(&mut self, light: usize) {
        self.layers.retain(|key, _| key.0 != light);
    }

    /// Whether nothing is known.
    pub(super) fn is_empty(&self) -> bool {
        self.layers.is_empty()
    }

    /// Whether all lights are known on all charts.
    pub(super) fn knows(&self, lights: usize, charts: &BTreeMap<Receiver, Arc<Chart>>) -> bool {
        (0..lights).all(|light| {
            charts
                .values()
                .all(|chart| self.layers.contains_key(&key(light, chart)))
        })
    }

    /// Bakes what is missing, and forgets maps of other sizes.
    pub(super) fn complete(
        &mut self,
        tracer: &Tracer,
        charts: &BTreeMap<Receiver, Arc<Chart>>,
        progress: &dyn Progress,
        control: &Control,
    ) -> DirectReport {
        let lights = &tracer.scene().lights;
        let wanted = |(_, receiver, size): &Key| {
            let chart = charts.get(receiver);
            chart.is_some_and(|chart| (chart.width, chart.height) == *size)
        };
        self.layers.retain(|key, _| wanted(key));
        let mut report = DirectReport {
            shadow_rays: 0,
            complete: true,
        };
        for (light, source) in lights.iter().enumerate() {
            let missing: Vec<&Chart> = charts
                .values()
                .map(|chart| &**chart)
                .filter(|chart| !self.layers.contains_key(&key(light, chart)))
                .collect();
            let baked = bake_direct(tracer, &[source.of_unit_strength()], &missing, progress, control);
            for (chart, layer) in missing.into_iter().zip(baked) {
                report.shadow_rays += layer.shadow_rays;
                report.complete &= layer.complete;
                if layer.complete {
                    self.layers.insert(key(light, chart), Arc::new(layer.irradiance));
                }
            }
        }
        report
    }

    /// E of a light of unit strength on a map [W/m²]; `None` where it was not baked.
    pub(super) fn layer(&self, light: usize, chart: &Chart) -> Option<&[[f32; 3]]> {
        self.layers.get(&key(light, chart)).map(|layer| &layer[..])
    }
}

fn key(light: usize, chart: &Chart) -> Key {
    (light, chart.receiver, (chart.width, chart.height))
}
