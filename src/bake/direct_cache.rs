//! Cache of the direct layer: what edits and settings do not affect is not traced again.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec2;
use rayon::prelude::*;

use super::finish::single;
use crate::illumination::lookup::bilinear;
use crate::illumination::tiles::Tile;
use crate::illumination::{Chart, Receiver};
use crate::light_pass::direct::{DirectLayer, bake_direct};
use crate::optics::LinearSrgb;
use crate::progress::{Control, Progress};
use crate::scene::{Light, Scene};
use crate::settings::BakeSettings;
use crate::transport::Tracer;

/// The charts that direct light of one map is baked on.
#[derive(Clone, Debug)]
pub(super) struct DirectChart {
    /// Of the map itself.
    pub(super) map: Arc<Chart>,
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

    /// A layer on the texels of the map: its values at texel centres, means where texels are larger than those it was
    /// baked on.
    fn on_map<'a>(&self, layer: &'a DirectLayer) -> Cow<'a, [[f32; 3]]> {
        let (map, own) = (&*self.map, &*self.own);
        if map.layout.is_none() && own.texel_count() == map.texel_count() {
            return Cow::Borrowed(&layer.irradiance);
        }
        let value = |corner: [usize; 2], side: f64| self.value(layer, corner, side).to_array().map(single);
        let Some(layout) = &map.layout else {
            let across = map.width;
            let texels = (0..map.texel_count()).into_par_iter();
            let values = texels.map(|texel| value([texel % across, texel / across], 1.0));
            return Cow::Owned(values.collect());
        };
        let of_tile = |tile: usize| {
            let Tile {
                level, origin, size, ..
            } = layout.tile(tile);
            let corner = move |texel: usize| {
                [
                    origin.0 + ((texel % size.0) << level),
                    origin.1 + ((texel / size.0) << level),
                ]
            };
            (0..size.0 * size.1).map(move |texel| value(corner(texel), f64::from(1_u32 << level)))
        };
        let tiles = (0..layout.tile_count()).into_par_iter();
        Cow::Owned(tiles.flat_map_iter(of_tile).collect())
    }

    /// Value of one texel, given by its corner and side in texels of the finest size.
    fn value(&self, layer: &DirectLayer, corner: [usize; 2], side: f64) -> LinearSrgb {
        let size = DVec2::new(self.map.width as f64, self.map.height as f64);
        let own_size = DVec2::new(self.own.width as f64, self.own.height as f64);
        let low = DVec2::new(corner[0] as f64, corner[1] as f64);
        // Texels as small as the subdivision at shadow borders.
        let divided = layer.divided.as_ref().filter(|divided| {
            let smallest = 1.0 / (self.own.width * divided.side()) as f64;
            side / size.x < 1.5 * smallest
        });
        if let Some(value) = divided.and_then(|divided| divided.at((low + 0.5 * side) / size)) {
            return value;
        }
        let times = (DVec2::splat(side) * own_size / size).ceil().max(DVec2::ONE);
        let mut mean = LinearSrgb::BLACK;
        for row in 0..times.y as usize {
            for column in 0..times.x as usize {
                let part = (DVec2::new(column as f64, row as f64) + 0.5) / times;
                let uv = (low + part * side) / size;
                mean += bilinear(&layer.irradiance, self.own.width, self.own.height, uv);
            }
        }
        mean / (times.x * times.y)
    }
}

/// Light, receiver, and size of the chart.
type Key = (usize, Receiver, [usize; 3]);

/// Direct light: by light and map if there is room for that, or of all lights together.
#[derive(Debug, Default)]
pub(super) struct DirectCache {
    /// At unit strength, by light and map.
    layers: BTreeMap<Key, DirectLayer>,
    /// Sum over all lights, at their strengths in this bake.
    together: Mutex<BTreeMap<Receiver, SummedIrradiance>>,
    /// Whether a sum is of layers that lack samples.
    is_rough: bool,
    /// Limit on the memory of all layers [bytes]; `None` if they have to exist light by light.
    most_bytes: Option<u64>,
}

/// A chart and E of all lights on it [W/m²].
type SummedIrradiance = (Arc<Chart>, Vec<[f32; 3]>);

/// Sums of irradiance in double precision.
fn add(sums: &mut [LinearSrgb], part: &[[f32; 3]], strength: LinearSrgb) {
    for (sum, unit) in sums.iter_mut().zip(part) {
        *sum += LinearSrgb::from(unit.map(f64::from)) * strength;
    }
}

fn rounded(sums: &[LinearSrgb]) -> Vec<[f32; 3]> {
    sums.iter().map(|sum| sum.to_array().map(single)).collect()
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DirectReport {
    pub(super) shadow_rays: u64,
    /// False if cancelled; unfinished layers are not kept.
    pub(super) complete: bool,
}

/// Memory of a layer per texel, with those at its shadow borders [bytes].
const BYTES_PER_TEXEL: u64 = 2 * 12;

impl DirectCache {
    /// Drops everything, because shapes or materials changed.
    pub(super) fn clear(&mut self) {
        self.layers.clear();
        self.forget_sums();
    }

    /// Begins a bake. Drops the sums, because strengths of lights may have changed.
    pub(super) fn begin(&mut self, settings: &BakeSettings) {
        self.most_bytes = (!settings.per_light).then(|| settings.direct_bytes());
        self.forget_sums();
    }

    fn forget_sums(&mut self) {
        self.is_rough = false;
        self.sums().clear();
    }

    fn sums(&mut self) -> &mut BTreeMap<Receiver, SummedIrradiance> {
        self.together.get_mut().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sum of all lights on a map [W/m²]; `None` if one was not baked.
    pub(super) fn together(&self, chart: &DirectChart, lights: &[Light]) -> Option<Vec<[f32; 3]>> {
        let known = || self.together.lock().unwrap_or_else(PoisonError::into_inner);
        let receiver = chart.map.receiver;
        if let Some((_, sum)) = known()
            .get(&receiver)
            .filter(|(of, _)| Arc::ptr_eq(of, &chart.map))
        {
            return Some(sum.clone());
        }
        let mut sums = vec![LinearSrgb::BLACK; chart.map.texel_count()];
        for (light, source) in lights.iter().enumerate() {
            let layer = self.layers.get(&chart.key(light))?;
            add(&mut sums, &chart.on_map(layer), source.strength());
        }
        let sum = rounded(&sums);
        known().insert(receiver, (Arc::clone(&chart.map), sum.clone()));
        Some(sum)
    }

    /// One light on a map [W/m²]; `None` if it was not baked.
    pub(super) fn of_light(&self, light: usize, chart: &DirectChart, scene: &Scene) -> Option<Vec<[f32; 3]>> {
        let layer = self.layers.get(&chart.key(light))?;
        let mut sums = vec![LinearSrgb::BLACK; chart.map.texel_count()];
        add(&mut sums, &chart.on_map(layer), scene.lights[light].strength());
        Some(rounded(&sums))
    }

    /// Drops a light that changed.
    pub(super) fn forget(&mut self, light: usize) {
        self.layers.retain(|key, _| key.0 != light);
        self.forget_sums();
    }

    pub(super) fn is_empty(&self) -> bool {
        self.layers.is_empty()
    }

    /// Whether every layer has all the samples that it needs.
    pub(super) fn is_refined(&self) -> bool {
        !self.is_rough && self.layers.values().all(|layer| layer.is_refined)
    }

    /// Whether all lights are known on all charts.
    pub(super) fn knows(&self, lights: usize, charts: &DirectCharts) -> bool {
        charts.values().all(|chart| {
            self.is_summed(chart) || (0..lights).all(|light| self.layers.contains_key(&chart.key(light)))
        })
    }

    fn is_summed(&self, chart: &DirectChart) -> bool {
        let known = self.together.lock().unwrap_or_else(PoisonError::into_inner);
        let sum = known.get(&chart.map.receiver);
        sum.is_some_and(|(of, _)| Arc::ptr_eq(of, &chart.map))
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
        // Layers light by light spare shadow rays when a light changes, but all of them have to fit into memory;
        // otherwise only their sum is kept.
        let lights = &tracer.scene().lights;
        let texels = charts.values().map(|chart| chart.own.texel_count() as u64);
        let bytes = texels.sum::<u64>() * lights.len() as u64 * BYTES_PER_TEXEL;
        if self.most_bytes.is_some_and(|most| bytes > most) {
            return self.add_up(tracer, charts, progress, control);
        }

        // Layers on charts of other sizes are of no use.
        let wanted = |(_, receiver, size): &Key| {
            let chart = charts.get(receiver);
            chart.is_some_and(|chart| chart.size() == *size)
        };
        self.layers.retain(|key, _| wanted(key));

        // After the deadline only absent layers are baked: a map without a lamp is wrong, one with few samples just
        // rough. An interrupted layer has black rows and is not kept.
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
            for (chart, layer) in missing
                .iter()
                .zip(baked(tracer, source, &missing, progress, control))
            {
                report.add(&layer);
                self.forget_sums();
                if layer.complete {
                    self.layers.insert(chart.key(light), layer);
                }
            }
        }
        report
    }

    /// Adds up the layers of all lights on charts whose sum is missing, and keeps none of them.
    fn add_up(
        &mut self,
        tracer: &Tracer,
        charts: &DirectCharts,
        progress: &dyn Progress,
        control: &Control,
    ) -> DirectReport {
        // Layers that an earlier bake kept light by light are dropped, as there is no room for them.
        self.layers.clear();
        let missing: Vec<&DirectChart> = charts.values().filter(|chart| !self.is_summed(chart)).collect();
        let mut report = DirectReport {
            shadow_rays: 0,
            complete: true,
        };

        // Each layer is added at the strength of its light in this bake, and then dropped.
        let black = |chart: &&DirectChart| vec![LinearSrgb::BLACK; chart.map.texel_count()];
        let mut sums: Vec<Vec<LinearSrgb>> = missing.iter().map(black).collect();
        for source in &tracer.scene().lights {
            let layers = baked(tracer, source, &missing, progress, control);
            for ((chart, sum), layer) in missing.iter().zip(&mut sums).zip(layers) {
                report.add(&layer);
                self.is_rough |= !layer.is_refined;
                add(sum, &chart.on_map(&layer), source.strength());
            }
        }

        // Interrupted sums lack light and are dropped.
        if report.complete {
            let sums = missing.iter().zip(sums);
            let sums = sums.map(|(chart, sum)| {
                let of_map = (Arc::clone(&chart.map), rounded(&sum));
                (chart.map.receiver, of_map)
            });
            self.sums().extend(sums);
        }
        report
    }
}

impl DirectReport {
    fn add(&mut self, layer: &DirectLayer) {
        self.shadow_rays += layer.shadow_rays;
        self.complete &= layer.complete;
    }
}

/// Direct light of a light at unit strength.
fn baked(
    tracer: &Tracer,
    source: &Light,
    charts: &[&DirectChart],
    progress: &dyn Progress,
    control: &Control,
) -> Vec<DirectLayer> {
    let on: Vec<_> = charts
        .iter()
        .map(|chart| (&*chart.own, chart.smaller.as_deref()))
        .collect();
    bake_direct(tracer, &[source.of_unit_strength()], &on, progress, control)
}
