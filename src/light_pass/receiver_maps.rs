//! Maps while flux is added to them: allocated when a surface first receives some.

use glam::DVec2;
use std::sync::Arc;

use super::caustic::footprint::TexelFromWorld;
use super::caustic::path::Arrival;
use super::caustic::splat::Coverage;
use crate::illumination::Chart;
use crate::illumination::accumulator::FluxAccumulator;
use crate::illumination::islands::Islands;
use crate::illumination::smoothing::smooth;
use crate::scene::Scene;

/// One surface's map with its flux.
#[derive(Clone, Debug)]
pub struct ReceiverMap {
    /// How the surface lies in the map.
    pub chart: Arc<Chart>,
    /// The flux so far: `levels[0]` at the map's size, each further one at half the size of the one before, for
    /// kernels that are smooth there.
    levels: Vec<FluxAccumulator>,
    /// Islands of the chart, where there is more than one.
    islands: Option<Islands>,
}

/// Gives the chart of an object at a size that suits it; `None` where the object cannot take a map.
pub type ChartFor<'a> = dyn Fn(usize) -> Option<Arc<Chart>> + Sync + 'a;

/// Maps of all objects that received flux, by object.
#[derive(Clone, Debug)]
pub struct ReceiverMaps {
    slots: Vec<Slot>,
}

#[derive(Clone, Debug)]
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
                    Slot::Allocated(Box::new(ReceiverMap::new(chart, flux)))
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

    /// Smooths all maps by a gaussian [texels, standard deviation]; nothing at 0. Maps with gaps are left as they are:
    /// their borders are no mirrors.
    pub fn smooth(&mut self, spread_texels: f64) {
        for slot in &mut self.slots {
            if let Slot::Allocated(map) = slot
                && map.chart.texel_areas_m2.len() == 1
            {
                smooth(&mut map.levels[0], spread_texels);
            }
        }
    }

    /// Adds the flux of other maps of the same sizes.
    pub fn add(&mut self, other: Self) {
        for (slot, part) in self.slots.iter_mut().zip(other.slots) {
            match (slot, part) {
                (Slot::Allocated(sum), Slot::Allocated(part)) => sum.add(&part),
                (slot, part @ Slot::Allocated(_)) => *slot = part,
                _ => {}
            }
        }
    }

    /// All maps with their objects, in the order of the objects.
    pub fn iter(&self) -> impl Iterator<Item = (usize, &ReceiverMap)> {
        (0..self.slots.len()).filter_map(|object| Some((object, self.get(object)?)))
    }

    /// The map of an object, to be added to.
    pub fn get_mut(&mut self, object: usize) -> Option<&mut ReceiverMap> {
        match &mut self.slots[object] {
            Slot::Allocated(map) => Some(map),
            Slot::Untouched | Slot::Refused => None,
        }
    }
}

/// Spreads that a kernel must have at a level [texels of the level]: linear interpolation between texels then adds less
/// than one per cent to its variance.
const LEAST_SPREAD_TEXELS: f64 = 6.0;

/// Least side of a level [texels].
const LEAST_LEVEL_SIDE: usize = 16;

impl ReceiverMap {
    fn new(chart: Arc<Chart>, flux: FluxAccumulator) -> Self {
        let islands = Islands::find(&chart);
        let mut levels = vec![flux];
        let full = chart.texel_areas_m2.len() == 1;
        let halves = |side: usize| side.is_multiple_of(2) && side / 2 >= LEAST_LEVEL_SIDE;
        let (mut width, mut height) = (chart.width, chart.height);
        while full && halves(width) && halves(height) {
            (width, height) = (width / 2, height / 2);
            levels.push(FluxAccumulator::new(width, height));
        }
        Self {
            chart,
            levels,
            islands,
        }
    }

    /// The coarsest level at which a smooth kernel of the given spread [texels of the map] is still well resolved.
    pub fn level_for(&self, spread_texels: f64) -> usize {
        let fits = |level: &usize| spread_texels / f64::from(1_u32 << level) >= LEAST_SPREAD_TEXELS;
        (1..self.levels.len()).take_while(fits).last().unwrap_or(0)
    }

    fn add(&mut self, part: &Self) {
        for (level, other) in self.levels.iter_mut().zip(&part.levels) {
            for (texel, more) in level.texels_mut().iter_mut().zip(other.texels()) {
                for channel in 0..3 {
                    texel[channel] += more[channel];
                }
            }
        }
    }

    /// All flux at the map's size: coarser levels spread smoothly.
    pub fn flux(&self) -> FluxAccumulator {
        let mut levels = self.levels.iter().rev();
        let mut sum = levels
            .next()
            .cloned()
            .unwrap_or_else(|| FluxAccumulator::new(0, 0));
        for level in levels {
            let mut finer = level.clone();
            sum.spread_into(&mut finer);
            sum = finer;
        }
        sum
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

    /// A level's flux, to be added to, beside what says where it may go.
    pub fn level(&mut self, level: usize) -> (&mut FluxAccumulator, Covered<'_>) {
        let flux = &mut self.levels[level];
        let size = (flux.width(), flux.height());
        // Coarser levels exist only where every texel is covered.
        let chart = (self.chart.texel_areas_m2.len() > 1).then_some(&*self.chart);
        (
            flux,
            Covered {
                size,
                chart,
                islands: self.islands.as_ref(),
            },
        )
    }
}

/// Which texels of a map are covered, and by which island.
#[derive(Clone, Copy, Debug)]
pub struct Covered<'a> {
    size: (usize, usize),
    /// `None` where all texels are covered.
    chart: Option<&'a Chart>,
    islands: Option<&'a Islands>,
}

impl Coverage for Covered<'_> {
    fn size(&self) -> (usize, usize) {
        self.size
    }

    fn is_full(&self) -> bool {
        self.chart.is_none()
    }

    fn covers(&self, column: usize, row: usize, island: u32) -> bool {
        self.chart
            .is_none_or(|chart| chart.texel_area_m2(row * self.size.0 + column) > 0.0)
            && self
                .islands
                .is_none_or(|islands| islands.covers(column, row, island))
    }
}
