//! Chooses size and tile refinement of each map: as fine as its light needs, within the memory limit.
//!
//! The texels of a tile should be no larger than the footprints that fall on it (section 3.1.1 of the paper). If memory
//! is short, texels grow by the same factor relative to their footprints everywhere, beginning with those that are far
//! finer than their light.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::sizes::MapMemory;
use crate::illumination::Receiver;
use crate::illumination::tiles::{self, COARSEST, TileLayout};
use crate::light_pass::footprint_statistics::FootprintSample;

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct MapSize {
    /// Width and height [texels of the finest size].
    pub(super) size: (usize, usize),
    /// The tiles, if the map is tiled.
    pub(super) layout: Option<Arc<TileLayout>>,
    /// Number of halvings to save memory.
    pub(super) halved: u32,
}

pub(super) type Sizes = BTreeMap<Receiver, MapSize>;

impl MapSize {
    /// A dense map of this size.
    pub(super) fn dense(size: (usize, usize)) -> Self {
        Self {
            size,
            layout: None,
            halved: 0,
        }
    }

    pub(super) fn texels(&self) -> u64 {
        match &self.layout {
            Some(layout) => layout.texel_count() as u64,
            None => self.size.0 as u64 * self.size.1 as u64,
        }
    }
}

/// The size after a number of halvings, each rounded up.
pub(super) fn halved((width, height): (usize, usize), times: u32) -> (usize, usize) {
    let half = |side: usize| (0..times).fold(side, |side, _| side.div_ceil(2));
    (half(width), half(height))
}

/// Maps with fewer tiles are not tiled.
const MIN_TILES: usize = 32;

/// A tiled map must take less than this share of the dense one.
const WORTH: f64 = 0.75;

/// Share of a tile's light whose footprints may be smaller than its texels.
const FINER_PART: f64 = 0.25;

/// The resolution that the light on a tile requires.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TileDemand {
    /// Levels by which texels of the finest size are finer than the footprints on the tile.
    fineness: f64,
    /// log₂ of the map's mean irradiance over that of the tile [levels]: where light is half as bright, twice as much
    /// of it may be missed.
    dimness: f64,
}

impl TileDemand {
    /// A tile without light.
    pub(super) const NOTHING: Self = Self {
        fineness: MAX_LEVELS,
        dimness: 0.0,
    };

    /// Requires at least the resolution of a level.
    fn refine(&mut self, level: u8) {
        if self.requested() > f64::from(level) {
            *self = Self {
                fineness: f64::from(level),
                dimness: 0.0,
            };
        }
    }

    /// The level that resolves the footprints.
    fn requested(&self) -> f64 {
        self.fineness + self.dimness.clamp(0.0, MAX_DIM)
    }

    /// The level, up to a common offset, at which all tiles miss the same amount of light.
    fn reduced(&self) -> f64 {
        self.fineness + self.dimness
    }
}

/// Maximum number of levels by which texels of dim light are larger than its footprints.
const MAX_DIM: f64 = 1.0;

/// Places of a map on or next to a shadow border.
#[derive(Clone, Debug)]
pub(super) struct Borders {
    /// Columns and rows of places.
    pub(super) size: (usize, usize),
    /// Row by row.
    pub(super) marked: Vec<bool>,
}

impl Borders {
    /// Requires at least the resolution of a level from all tiles of a map that a border runs through.
    pub(super) fn refine(&self, map: (usize, usize), level: u8, needs: &mut [TileDemand]) {
        let (columns, rows) = tiles::tile_counts(map.0, map.1);
        // The tiles that a place and its neighbours lie in.
        let reach = |place: usize, places: usize, texels: usize, tiles: usize| {
            let tile = |place: usize| (place * texels / places / tiles::SIDE).min(tiles - 1);
            tile(place.saturating_sub(1))..=tile(place + 1)
        };
        for place in (0..self.marked.len()).filter(|place| self.marked[*place]) {
            let (column, row) = (place % self.size.0, place / self.size.0);
            for row in reach(row, self.size.1, map.1, rows) {
                for column in reach(column, self.size.0, map.0, columns) {
                    needs[row * columns + column].refine(level);
                }
            }
        }
    }
}

/// Requested size of one map.
#[derive(Clone, Debug)]
pub(super) struct SizeRequest {
    /// Width and height that are requested, or that the finest light requires [texels].
    pub(super) size: (usize, usize),
    /// Whether all texels should be equally fine, if memory allows.
    pub(super) is_even: bool,
    /// What each tile requires, row by row; `None` if the map cannot be tiled.
    pub(super) tiles: Option<Vec<TileDemand>>,
    /// Levels by which texels of that size are finer than the mean footprint of the map.
    pub(super) fineness: f64,
    /// Coarsest level of tiles, if memory allows.
    pub(super) coarsest: u8,
    /// Caustics that were seen on the map [W].
    pub(super) flux_w: f64,
}

/// Levels by which texels may be larger than footprints, to save memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum MemoryReduction {
    /// As requested.
    Nothing,
    Levels(f64),
}

impl SizeRequest {
    /// A dense map.
    pub(super) fn dense(size: (usize, usize)) -> Self {
        Self {
            size,
            is_even: true,
            tiles: None,
            fineness: 0.0,
            coarsest: COARSEST,
            flux_w: 0.0,
        }
    }

    /// The size that the map gets.
    pub(super) fn granted(&self, sparing: MemoryReduction) -> MapSize {
        match (sparing, &self.tiles) {
            (MemoryReduction::Nothing, Some(tiles)) if !self.is_even => self.in_tiles(tiles, None),
            (MemoryReduction::Nothing, _) => MapSize::dense(self.size),
            (MemoryReduction::Levels(levels), Some(tiles)) => {
                let finest = tiles
                    .iter()
                    .map(TileDemand::reduced)
                    .fold(f64::INFINITY, f64::min);
                if finest + levels < f64::from(COARSEST) {
                    self.in_tiles(tiles, Some(levels))
                } else {
                    self.in_one(finest + levels)
                }
            }
            (MemoryReduction::Levels(levels), None) => self.in_one(self.fineness + levels),
        }
    }

    /// A dense map, coarser by a number of levels.
    fn in_one(&self, levels: f64) -> MapSize {
        let halved_times = levels.clamp(0.0, 32.0) as u32;
        MapSize {
            size: halved(self.size, halved_times),
            layout: None,
            halved: halved_times,
        }
    }

    /// A tiled map as requested, or coarser by `sparing` levels; a dense one if tiles save too little.
    fn in_tiles(&self, tiles: &[TileDemand], sparing: Option<f64>) -> MapSize {
        // Neighbours may differ by one level only, so that fine tiles make those around them finer.
        let (columns, _) = tiles::tile_counts(self.size.0, self.size.1);
        let balanced = |level: &dyn Fn(&TileDemand) -> f64, coarsest: u8| {
            let level = |tile: &TileDemand| level(tile).clamp(0.0, f64::from(coarsest)) as u8;
            let mut levels: Vec<u8> = tiles.iter().map(level).collect();
            tiles::balance(&mut levels, columns);
            levels
        };
        let wanted = if self.is_even {
            vec![0; tiles.len()]
        } else {
            balanced(&TileDemand::requested, self.coarsest)
        };

        // If memory is short, all tiles miss the same amount of light.
        let mut levels = wanted.clone();
        if let Some(reduced) = sparing {
            let coarser = balanced(&|tile| tile.reduced() + reduced, COARSEST);
            // No tile gets finer than requested.
            levels = wanted
                .iter()
                .zip(coarser)
                .map(|(own, coarser)| coarser.max(*own))
                .collect();
        }

        // Tiles that save little are not worth the look-ups through their layout.
        let layout = TileLayout::new(self.size, &levels, &wanted);
        let dense = self.size.0 * self.size.1;
        if layout.texel_count() as f64 > WORTH * dense as f64 {
            return MapSize::dense(self.size);
        }
        MapSize {
            size: self.size,
            layout: Some(Arc::new(layout)),
            halved: 0,
        }
    }
}

/// Whether a map of a size has enough tiles to be tiled.
pub(super) fn is_divisible((width, height): (usize, usize)) -> bool {
    let (columns, rows) = tiles::tile_counts(width, height);
    columns * rows >= MIN_TILES
}

/// Step in which texels grow if memory is short [levels].
const SPARING_STEP: f64 = 0.125;

/// Maximum number of levels by which texels are finer, or coarser, than their light.
const MAX_LEVELS: f64 = 20.0;

/// Requested sizes of all maps.
pub(super) fn requested(wishes: &BTreeMap<Receiver, SizeRequest>) -> Sizes {
    granted(wishes, MemoryReduction::Nothing)
}

fn granted(wishes: &BTreeMap<Receiver, SizeRequest>, sparing: MemoryReduction) -> Sizes {
    wishes
        .iter()
        .map(|(&receiver, wish)| (receiver, wish.granted(sparing)))
        .collect()
}

/// Sizes of all maps within a memory limit [bytes]: as requested, or as little coarser as possible.
pub(super) fn fit(wishes: &BTreeMap<Receiver, SizeRequest>, (limit, memory): (u64, &MapMemory)) -> Sizes {
    let fits = |sizes: &Sizes| memory.of_sizes(sizes) <= limit;
    let requested = requested(wishes);
    if fits(&requested) {
        return requested;
    }
    // Tiles that are far finer than their light are reduced first, then all others.
    let steps = (2.0 * MAX_LEVELS / SPARING_STEP) as i32;
    let sparing = |step: i32| MemoryReduction::Levels(f64::from(step) * SPARING_STEP - MAX_LEVELS);
    let (mut low, mut high) = (0, steps);
    while low < high {
        let middle = low + (high - low) / 2;
        if fits(&granted(wishes, sparing(middle))) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }

    // A step halves large maps, so that much may be left: single ones, those with most light first, take it back.
    let mut sizes = granted(wishes, sparing(high));
    let mut by_light: Vec<(&Receiver, &SizeRequest)> = wishes.iter().collect();
    by_light.sort_by(|(_, a), (_, b)| b.flux_w.total_cmp(&a.flux_w));
    for (&receiver, wish) in by_light {
        let finer = wish.granted(sparing((high - 1).max(0)));
        if let Some(size) = sizes.insert(receiver, finer)
            && !fits(&sizes)
        {
            sizes.insert(receiver, size);
        }
    }
    sizes
}

/// Maximum number of cells across and down that light is sorted into.
const MAX_CELLS: usize = 64;

/// Bins for the share of a map that a footprint covers, one per power of two, from the whole map down.
const BINS: usize = 36;

/// What each tile of a map requires, row by row.
pub(super) fn needs<'a>(
    size: (usize, usize),
    spots: impl Iterator<Item = &'a FootprintSample>,
) -> Vec<TileDemand> {
    // Flux is sorted by place and size of footprints: one histogram for each cell of the map.
    let (columns, rows) = tiles::tile_counts(size.0, size.1);
    let (across, down) = (columns.min(MAX_CELLS), rows.min(MAX_CELLS));
    let mut cells = vec![[0.0_f64; BINS]; across * down];
    for spot in spots {
        let bin = (-spot.map_share.log2()).clamp(0.0, (BINS - 1) as f64) as usize;
        let (low, high) = spot.bounds;
        let in_columns = parts(low.x, high.x, across);
        for (row, height) in parts(low.y, high.y, down) {
            for &(column, width) in &in_columns {
                cells[row * across + column][bin] += spot.flux_w * width * height;
            }
        }
    }

    // Of the light of a cell, only `FINER_PART` may have footprints smaller than its texels.
    let texels = ((size.0 * size.1) as f64).log2();
    let mean = cells.iter().flatten().sum::<f64>() / cells.len() as f64;
    let of_cell = |bins: &[f64; BINS]| {
        finer_bin(bins).map_or(TileDemand::NOTHING, |bin| TileDemand {
            // Half the logarithm of the footprint's texels, because a level halves both sides.
            fineness: 0.5 * (texels - (bin as f64 + 0.5)),
            dimness: (mean / bins.iter().sum::<f64>()).log2(),
        })
    };
    let cells: Vec<TileDemand> = cells.iter().map(of_cell).collect();

    // Tiles smaller than a cell share its demand.
    (0..columns * rows)
        .map(|tile| {
            let (column, row) = (tile % columns, tile / columns);
            cells[row * down / rows * across + column * across / columns]
        })
        .collect()
}

/// The bin, from the finest on, up to which [`FINER_PART`] of the light lies; `None` without light.
fn finer_bin(bins: &[f64; BINS]) -> Option<usize> {
    let all: f64 = bins.iter().sum();
    let mut sum = 0.0;
    (0..BINS).rev().find(|&bin| {
        sum += bins[bin];
        sum > 0.0 && sum >= FINER_PART * all
    })
}

/// Cells of a line of `count` that an interval within [0, 1] overlaps, each with its share of the interval.
fn parts(low: f64, high: f64, count: usize) -> Vec<(usize, f64)> {
    let cell = |place: f64| ((place * count as f64) as usize).min(count - 1);
    let length = high - low;
    (cell(low)..=cell(high))
        .map(|index| {
            let [begin, end] = [index, index + 1].map(|border| border as f64 / count as f64);
            let inside = high.min(end) - low.max(begin);
            (index, if length > 0.0 { inside / length } else { 1.0 })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_step_leaves_goes_to_the_brightest_maps() {
        let wishes: BTreeMap<Receiver, SizeRequest> = [1.0, 3.0, 2.0]
            .into_iter()
            .enumerate()
            .map(|(object, flux_w)| {
                let wish = SizeRequest::dense((256, 256));
                (Receiver::front(object), SizeRequest { flux_w, ..wish })
            })
            .collect();
        let memory = MapMemory::finished(BTreeMap::new());
        let limit = memory.of_sizes(&requested(&wishes)) * 3 / 4;
        let sides = fit(&wishes, (limit, &memory))
            .values()
            .map(|size| size.size.0)
            .collect::<Vec<_>>();
        assert_eq!(sides, [128, 256, 256]);
    }
}
