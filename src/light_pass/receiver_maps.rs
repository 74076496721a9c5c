//! Maps while flux is added to them: allocated when a surface first receives some.

use glam::DVec2;
use std::sync::Arc;

use super::caustic::footprint::TexelFromWorld;
use super::caustic::path::Arrival;
use super::caustic::splat::Coverage;
use crate::illumination::Chart;
use crate::illumination::accumulator::FluxAccumulator;
use crate::illumination::islands::Islands;
use crate::scene::Scene;

/// One surface's map with its flux.
#[derive(Debug)]
pub struct ReceiverMap {
    /// How the surface lies in the map.
    pub chart: Arc<Chart>,
    /// The flux so far.
    pub flux: FluxAccumulator,
    /// Islands of the chart, where there is more than one.
    islands: Option<Islands>,
}

/// Gives the chart of an object at a size that suits it; `None` where the object cannot take a map.
pub type ChartFor<'a> = dyn Fn(usize) -> Option<Arc<Chart>> + Sync + 'a;

/// Maps of all objects that received flux, by object.
#[derive(Debug)]
pub struct ReceiverMaps {
    slots: Vec<Slot>,
}

#[derive(Debug)]
enum Slot {
    /// No flux yet.
    Untouched,
    /// Cannot take a map.
    Refused,
    Allocated(Box<ReceiverMap>),
}

impl ReceiverMaps {
    /// No map yet.
    pub fn new(objects: usize) -> Self {
        Self {
            slots: (0..objects).map(|_| Slot::Untouched).collect(),
        }
    }

    /// Allocates the map of an object unless that was tried before.
    pub fn touch(&mut self, object: usize, chart_for: &ChartFor) {
        if matches!(self.slots[object], Slot::Untouched) {
            self.slots[object] = match chart_for(object) {
                Some(chart) => {
                    let flux = FluxAccumulator::new(chart.width, chart.height);
                    let islands = Islands::find(&chart);
                    Slot::Allocated(Box::new(ReceiverMap { chart, flux, islands }))
                }
                None => Slot::Refused,
            };
        }
    }

    /// The map of an object, if it has one.
    pub fn get(&self, object: usize) -> Option<&ReceiverMap> {
        match &self.slots[object] {
            Slot::Allocated(map) => Some(map),
            Slot::Untouched | Slot::Refused => None,
        }
    }

    /// All maps with their objects, in the order of the objects.
    pub fn iter(&self) -> impl Iterator<Item = (usize, &ReceiverMap)> {
        (0..self.slots.len()).filter_map(|object| Some((object, self.get(object)?)))
    }

    /// All maps with their objects, to be added to.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = (usize, &mut ReceiverMap)> {
        self.slots
            .iter_mut()
            .enumerate()
            .filter_map(|(object, slot)| match slot {
                Slot::Allocated(map) => Some((object, &mut **map)),
                Slot::Untouched | Slot::Refused => None,
            })
    }
}

impl ReceiverMap {
    /// Doubles the map each way until it is as wide as `size`, in texels; each texel's flux goes in four equal parts to
    /// those that replace it. `chart_for` gives the chart of a size.
    pub fn grow_to(
        &mut self,
        size: (usize, usize),
        chart_for: &dyn Fn((usize, usize)) -> Option<Arc<Chart>>,
    ) {
        while self.flux.width() < size.0 {
            self.flux = self.flux.doubled();
        }
        if let Some(chart) = chart_for((self.flux.width(), self.flux.height())) {
            self.islands = Islands::find(&chart);
            self.chart = chart;
        }
    }

    /// Texel coordinates of an arrival, and the local map from metres to texels; `None` on a triangle without area.
    pub fn locate(&self, scene: &Scene, arrival: &Arrival) -> Option<(DVec2, TexelFromWorld)> {
        let triangle = arrival.triangle as usize;
        let [b, c] = arrival.barycentric.to_array();
        let uv = self.chart.uv(triangle, [1.0 - b - c, b, c]);
        let size = DVec2::new(self.chart.width as f64, self.chart.height as f64);
        let corners = scene.objects[arrival.object as usize].mesh.corners(triangle);
        let rows = self.chart.texel_from_world(triangle, corners)?;
        Some(((uv * size).clamp(DVec2::ZERO, size), rows))
    }
}

impl ReceiverMap {
    /// The island that an arrival lies on.
    pub fn island(&self, arrival: &Arrival) -> u32 {
        self.islands
            .as_ref()
            .map_or(0, |islands| islands.of_triangle(arrival.triangle as usize))
    }

    /// The flux, to be added to, beside what says where it may go.
    pub fn split(&mut self) -> (&mut FluxAccumulator, Covered<'_>) {
        (
            &mut self.flux,
            Covered {
                chart: &self.chart,
                islands: self.islands.as_ref(),
            },
        )
    }
}

/// Which texels of a map are covered, and by which island.
#[derive(Clone, Copy, Debug)]
pub struct Covered<'a> {
    chart: &'a Chart,
    islands: Option<&'a Islands>,
}

impl Coverage for Covered<'_> {
    fn size(&self) -> (usize, usize) {
        (self.chart.width, self.chart.height)
    }

    fn is_full(&self) -> bool {
        self.chart.texel_areas_m2.len() == 1
    }

    fn covers(&self, column: usize, row: usize, island: u32) -> bool {
        self.chart.texel_area_m2(row * self.chart.width + column) > 0.0
            && self
                .islands
                .is_none_or(|islands| islands.covers(column, row, island))
    }
}
