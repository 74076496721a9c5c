//! Accumulating maps, allocated when a surface first receives flux.

use rayon::prelude::*;
use std::borrow::Cow;
use std::sync::Arc;

use super::path::Arrival;
use crate::illumination::accumulator::{FluxAccumulator, FluxCount, PackedFlux};
use crate::illumination::islands::Islands;
use crate::illumination::{Chart, Receiver, smoothing};
use crate::optics::LinearSrgb;

/// Which texels of a map a surface covers.
pub trait Coverage: Sync {
    /// Texels across and down.
    fn size(&self) -> (usize, usize);

    /// Whether every texel is covered.
    fn is_full(&self) -> bool;

    /// Whether an island of the chart covers any part of a texel.
    fn covers(&self, column: usize, row: usize, island: u32) -> bool;
}

/// The map of one surface, with its flux.
#[derive(Clone, Debug)]
pub struct ReceiverMap {
    pub chart: Arc<Chart>,
    /// Accumulated flux: `levels[0]` at the map's size, each further level at half the size of the one before,
    /// allocated once a kernel is smooth enough for it. Tiled maps have one level.
    levels: Vec<FluxAccumulator>,
    /// All flux at the map's size, in place of the levels, once no more is added.
    packed: Option<PackedFlux>,
}

/// Returns the chart of a receiver at a suitable size; `None` if it cannot take a map.
pub type ChartFor<'a> = dyn Fn(Receiver) -> Option<Arc<Chart>> + Sync + 'a;

/// Maps of all receivers that received flux.
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
    /// No maps yet, for a scene with this number of objects.
    pub fn new(objects: usize) -> Self {
        Self {
            slots: Receiver::all(objects).map(|_| Slot::Untouched).collect(),
        }
    }

    /// All receivers of the scene, in order.
    pub fn receivers(&self) -> impl Iterator<Item = Receiver> + use<> {
        Receiver::all(self.slots.len() / 2)
    }

    /// Allocates the map of a receiver, unless that was tried before.
    pub fn touch(&mut self, receiver: Receiver, chart_for: &ChartFor) {
        let slot = &mut self.slots[receiver.index()];
        if matches!(slot, Slot::Untouched) {
            *slot = match chart_for(receiver) {
                Some(chart) => {
                    let flux = FluxAccumulator::for_chart(&chart);
                    Slot::Allocated(Box::new(ReceiverMap::new(chart, flux)))
                }
                None => Slot::Refused,
            };
        }
    }

    pub fn get(&self, receiver: Receiver) -> Option<&ReceiverMap> {
        match &self.slots[receiver.index()] {
            Slot::Allocated(map) => Some(map),
            Slot::Untouched | Slot::Refused => None,
        }
    }

    /// Converts all flux to other channels: applies a linear function to each triple of counts and rounds to the
    /// nearest count.
    pub fn transform(&mut self, f: impl Fn(LinearSrgb) -> LinearSrgb + Sync) {
        for slot in &mut self.slots {
            if let Slot::Allocated(map) = slot {
                for level in &mut map.levels {
                    level.texels_mut().par_iter_mut().for_each(|count| {
                        if *count != [0; 3] {
                            let flux = LinearSrgb::from(count.map(|channel| channel as f64));
                            *count = f(flux).to_array().map(|channel| channel.round() as i64);
                        }
                    });
                }
            }
        }
    }

    /// The same maps in less memory, to be kept: no more flux can be added.
    #[must_use]
    pub fn packed(mut self) -> Self {
        for (_, map) in self.iter_mut() {
            map.packed = Some(PackedFlux::new(&map.flux()));
            map.levels.clear();
        }
        self
    }

    /// Memory of the flux [bytes].
    pub fn bytes(&self) -> u64 {
        self.iter().map(|(_, map)| map.bytes()).sum()
    }

    /// Adds the flux of other maps of the same sizes.
    pub fn add(&mut self, other: &Self) {
        for (slot, part) in self.slots.iter_mut().zip(&other.slots) {
            match (slot, part) {
                (Slot::Allocated(sum), Slot::Allocated(part)) => sum.add(part),
                (slot, part @ Slot::Allocated(_)) => *slot = part.clone(),
                _ => {}
            }
        }
    }

    /// All maps with their receivers, in order.
    pub fn iter(&self) -> impl Iterator<Item = (Receiver, &ReceiverMap)> {
        Receiver::all(self.slots.len() / 2).filter_map(|receiver| Some((receiver, self.get(receiver)?)))
    }

    pub fn iter_mut(&mut self) -> impl Iterator<Item = (Receiver, &mut ReceiverMap)> {
        let maps = self.receivers().zip(&mut self.slots);
        maps.filter_map(|(receiver, slot)| match slot {
            Slot::Allocated(map) => Some((receiver, &mut **map)),
            Slot::Untouched | Slot::Refused => None,
        })
    }

    pub fn get_mut(&mut self, receiver: Receiver) -> Option<&mut ReceiverMap> {
        match &mut self.slots[receiver.index()] {
            Slot::Allocated(map) => Some(map),
            Slot::Untouched | Slot::Refused => None,
        }
    }
}

/// Minimum spread of a kernel at a level [texels of the level]: linear interpolation between texels then adds less than
/// one per cent to its variance.
const MIN_SPREAD_TEXELS: f64 = 6.0;

/// Minimum side of a level [texels].
const MIN_LEVEL_SIDE: usize = 16;

impl ReceiverMap {
    fn new(chart: Arc<Chart>, flux: FluxAccumulator) -> Self {
        Self {
            chart,
            levels: vec![flux],
            packed: None,
        }
    }

    /// Sizes of the levels that the map may have.
    fn level_sizes(&self) -> impl Iterator<Item = (usize, usize)> {
        let is_whole = self.chart.is_full() && self.chart.layout.is_none();
        let halves = |side: usize| side.is_multiple_of(2) && side / 2 >= MIN_LEVEL_SIDE;
        let first = (self.chart.width, self.chart.height);
        std::iter::successors(Some(first), move |&(width, height)| {
            (is_whole && halves(width) && halves(height)).then_some((width / 2, height / 2))
        })
    }

    /// Number of levels that the map may have.
    pub fn most_levels(&self) -> usize {
        self.level_sizes().count()
    }

    /// Allocates levels up to this one.
    fn make_levels(&mut self, level: usize) {
        let missing: Vec<(usize, usize)> = self
            .level_sizes()
            .take(level + 1)
            .skip(self.levels.len())
            .collect();
        let empty = missing
            .into_iter()
            .map(|(width, height)| FluxAccumulator::new(width, height));
        self.levels.extend(empty);
    }

    /// The coarsest level that still resolves a smooth kernel of the given spread [texels of the map].
    pub fn level_for(&self, spread_texels: f64) -> usize {
        let fits = |level: &usize| spread_texels / f64::from(1_u32 << level) >= MIN_SPREAD_TEXELS;
        let levels = (0..).zip(self.level_sizes()).map(|(level, _)| level);
        levels.skip(1).take_while(fits).last().unwrap_or(0)
    }

    /// Accumulated flux by level.
    pub fn levels(&self) -> &[FluxAccumulator] {
        &self.levels
    }

    /// Texels at the map's size.
    pub fn texels_mut(&mut self) -> &mut [FluxCount] {
        self.levels[0].texels_mut()
    }

    /// Total flux over all levels.
    pub fn flux_counts(&self) -> [i128; 3] {
        let packed = self.packed.as_ref().map(PackedFlux::unpacked);
        let texels = self.levels.iter().chain(&packed).flat_map(|level| level.texels());
        texels.fold([0; 3], |sum, texel| {
            std::array::from_fn(|channel| sum[channel] + i128::from(texel[channel]))
        })
    }

    fn bytes(&self) -> u64 {
        let texels: usize = self.levels.iter().map(|level| level.texels().len()).sum();
        let packed = self.packed.as_ref().map_or(0, PackedFlux::bytes);
        (texels * size_of::<FluxCount>()) as u64 + packed
    }

    fn add(&mut self, part: &Self) {
        self.make_levels(part.levels.len() - 1);
        for (level, other) in self.levels.iter_mut().zip(&part.levels) {
            for (texel, more) in level.texels_mut().iter_mut().zip(other.texels()) {
                smoothing::add(texel, *more);
            }
        }
    }

    /// Total flux at the map's size, with coarser levels interpolated smoothly.
    pub fn flux(&self) -> Cow<'_, FluxAccumulator> {
        if let Some(packed) = &self.packed {
            return Cow::Owned(packed.unpacked());
        }
        let mut levels = self.levels.iter().rev();
        let mut sum = Cow::Borrowed(levels.next().expect("a map has a level"));
        for level in levels {
            let mut finer = FluxAccumulator::new(level.width(), level.height());
            smoothing::spread(&sum, &mut finer, None, 1);
            for (count, more) in finer.texels_mut().iter_mut().zip(level.texels()) {
                smoothing::add(count, *more);
            }
            sum = Cow::Owned(finer);
        }
        sum
    }
}

impl ReceiverMap {
    /// The island on which an arrival lies.
    pub fn island(&self, arrival: &Arrival) -> u32 {
        self.chart
            .islands()
            .map_or(0, |islands| islands.of_triangle(arrival.triangle as usize))
    }

    /// A level's flux, with the coverage that deposits have to respect.
    pub fn level(&mut self, level: usize) -> (&mut FluxAccumulator, IslandCoverage<'_>) {
        self.make_levels(level);
        let flux = &mut self.levels[level];
        let size = (flux.width(), flux.height());
        // Coarser levels exist only where every texel is covered.
        let chart = (!self.chart.is_full()).then_some(&*self.chart);
        (
            flux,
            IslandCoverage {
                size,
                chart,
                islands: self.chart.islands(),
            },
        )
    }
}

/// Which texels of a map are covered, and by which island.
#[derive(Clone, Copy, Debug)]
pub struct IslandCoverage<'a> {
    size: (usize, usize),
    /// `None` if all texels are covered.
    chart: Option<&'a Chart>,
    islands: Option<&'a Islands>,
}

impl Coverage for IslandCoverage<'_> {
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
