//! A hierarchy of sums over a map's texels, four to a cell from level to level, for tiled and untiled maps alike.
//!
//! A cell of level l is 2^l finest texels long. Tiles with coarser texels than that have no cells at that level.

use rayon::prelude::*;

use crate::illumination::Chart;
use crate::illumination::tiles::{COARSEST, SIDE};

/// No cell, or no texel.
const NONE: u32 = u32::MAX;

/// The last level has at most this many cells along each axis.
const FEWEST_ACROSS: usize = 4;

/// The surroundings of a cell are averaged over cells this many levels coarser.
const STEPS_AROUND: usize = 2;

/// Weight of a cell along one axis in the mean over coarser cells that is interpolated at its own centre: 5/8 or 3/4 of
/// a quarter.
const OWN_WEIGHTS: [f32; 4] = [5.0 / 32.0, 3.0 / 16.0, 3.0 / 16.0, 5.0 / 32.0];

/// Cells of all levels, finest first.
pub(super) struct Cells {
    levels: Vec<Level>,
    /// Level and index of the cell that each texel is.
    of_texels: Vec<(u8, u32)>,
}

/// Values of every cell, level by level.
pub(super) type Values<const N: usize> = Vec<Vec<[f32; N]>>;

/// Cells of one level: those of a tile together, row by row.
pub(super) struct Level {
    /// Cells across and down, including those that are missing.
    size: (usize, usize),
    tiles_across: usize,
    /// A tile is 2^shift cells long.
    shift: u32,
    /// First cell of each tile; [`NONE`] if the tile is coarser than the level.
    begins: Vec<u32>,
    /// Column and row of each cell.
    places: Vec<(u32, u32)>,
    /// The texel that a cell consists of; [`NONE`] if it holds several.
    texels: Vec<u32>,
    /// Surface area in each cell [m²].
    areas_m2: Vec<f32>,
    /// That of the cell with most.
    largest_m2: f32,
}

impl Level {
    /// `(width, height)` of the map in finest texels.
    fn new(level: u8, (width, height): (usize, usize), chart: &Chart) -> Self {
        // A tile has the same extent at all levels, and half as many cells along each side from one to the next.
        let length = 1_usize << level;
        let size = (width.div_ceil(length), height.div_ceil(length));
        let side = SIDE.div_ceil(length);
        let tiles = (size.0.div_ceil(side), size.1.div_ceil(side));
        let (mut begins, mut places, mut texels) = (Vec::new(), Vec::new(), Vec::new());
        for tile in 0..tiles.0 * tiles.1 {
            let (column, row) = (tile % tiles.0 * side, tile / tiles.0 * side);
            let own = chart
                .layout
                .as_ref()
                .filter(|_| level <= COARSEST)
                .map(|layout| layout.tile(tile));

            // Texels coarser than the level have no cells here: values at their place come from coarser levels.
            if own.as_ref().is_some_and(|tile| tile.level > level) {
                begins.push(NONE);
                continue;
            }
            begins.push(places.len() as u32);

            // Cells as large as the tile's texels are these, in the order in which they are stored; larger ones are
            // sums.
            let mut next = own
                .filter(|tile| tile.level == level)
                .map(|tile| tile.texels.start as u32);
            for y in row..(row + side).min(size.1) {
                for x in column..(column + side).min(size.0) {
                    places.push((x as u32, y as u32));
                    let plain = (level == 0 && chart.layout.is_none()).then_some((y * width + x) as u32);
                    texels.push(next.or(plain).unwrap_or(NONE));
                    next = next.map(|texel| texel + 1);
                }
            }
        }

        // Areas are summed from level to level once all levels exist.
        Self {
            size,
            tiles_across: tiles.0,
            shift: side.trailing_zeros(),
            begins,
            areas_m2: vec![0.0; places.len()],
            largest_m2: 0.0,
            places,
            texels,
        }
    }

    fn index(&self, column: usize, row: usize) -> Option<usize> {
        let (tile_column, tile_row) = (column >> self.shift, row >> self.shift);
        let begin = self.begins[tile_row * self.tiles_across + tile_column];
        let (first_column, first_row) = (tile_column << self.shift, tile_row << self.shift);
        let across = (1 << self.shift).min(self.size.0 - first_column);
        (begin != NONE).then(|| begin as usize + (row - first_row) * across + column - first_column)
    }

    /// An area relative to that of the level's largest cell: 1 for every cell that a surface of even resolution covers.
    fn share(&self, area_m2: f32) -> f32 {
        area_m2 / self.largest_m2.max(f32::MIN_POSITIVE)
    }

    /// Sum over the cells of the finer level in one cell.
    fn add_up<const N: usize>(&self, place: (u32, u32), finer: &Self, values: &[[f32; N]]) -> [f32; N] {
        let mut sum = [0.0; N];
        let within = |first: u32, end: usize| {
            (2 * first as usize..2 * first as usize + 2).take_while(move |at| *at < end)
        };
        for row in within(place.1, finer.size.1) {
            for column in within(place.0, finer.size.0) {
                if let Some(index) = finer.index(column, row) {
                    sum.iter_mut()
                        .zip(values[index])
                        .for_each(|(sum, value)| *sum += value);
                }
            }
        }
        sum
    }
}

impl Cells {
    pub fn new(chart: &Chart) -> Self {
        let size = chart
            .layout
            .as_ref()
            .map_or((chart.width, chart.height), |layout| layout.size());
        let mut cells = Self {
            levels: Vec::new(),
            of_texels: vec![(0, NONE); chart.texel_count()],
        };
        for level in 0.. {
            cells.levels.push(Level::new(level, size, chart));
            let last = cells.levels[usize::from(level)].size;
            if last.0.max(last.1) <= FEWEST_ACROSS && (level >= COARSEST || chart.layout.is_none()) {
                break;
            }
        }
        for (number, level) in cells.levels.iter().enumerate() {
            for (index, &texel) in level.texels.iter().enumerate() {
                if texel != NONE {
                    cells.of_texels[texel as usize] = (number as u8, index as u32);
                }
            }
        }
        let areas = cells.sums(|texel| [chart.texel_area_m2(texel) as f32]);
        for (level, areas) in cells.levels.iter_mut().zip(areas) {
            level.areas_m2 = areas.into_iter().map(|[area_m2]| area_m2).collect();
            level.largest_m2 = level.areas_m2.iter().copied().fold(0.0, f32::max);
        }
        cells
    }

    /// The first level that covers the whole map, with cells of many texels but still a small part of the map.
    pub fn pool(&self) -> usize {
        let across = self.levels[0].size.0.max(self.levels[0].size.1);
        let of_tiles = self.levels.iter().position(|level| !level.begins.contains(&NONE));
        let many = (across.ilog2() as usize).clamp(5, 9) - 3;
        many.max(of_tiles.unwrap_or(0)).min(self.levels.len() - 1)
    }

    pub fn texels<const N: usize>(&self, values: &Values<N>) -> Vec<[f32; N]> {
        self.inherited(0, |level, index| values[level][index])
    }

    /// Surface area in each of a level's cells [m²].
    pub fn areas_m2(&self, level: usize) -> &[f32] {
        &self.levels[level].areas_m2
    }

    /// Area of each texel, relative to the largest of its size.
    pub fn shares(&self) -> Vec<f32> {
        self.inherited(0, |level, index| {
            let level = &self.levels[level];
            level.share(level.areas_m2[index])
        })
    }

    /// For each texel, the value of a cell, given its level and index: the cell of a level in which the texel lies, or
    /// the texel's own if that is larger.
    pub fn inherited<T: Send>(&self, level: usize, value: impl Fn(usize, usize) -> T + Sync) -> Vec<T> {
        let of_texel = |&(number, index): &(u8, u32)| {
            let (number, index) = (usize::from(number), index as usize);
            let steps = level.saturating_sub(number);
            let (column, row) = self.levels[number].places[index];
            let above = &self.levels[number + steps];
            let cell = above.index(column as usize >> steps, row as usize >> steps);
            value(number + steps, cell.expect("coarser cells cover finer ones"))
        };
        self.of_texels.par_iter().map(of_texel).collect()
    }

    /// Sum of a value of texels over every cell.
    pub fn sums<const N: usize>(&self, value: impl Fn(usize) -> [f32; N] + Sync) -> Values<N> {
        let mut sums: Values<N> = Vec::with_capacity(self.levels.len());
        for (number, level) in self.levels.iter().enumerate() {
            let own = level.places.par_iter().zip(&level.texels);
            let own = own.map(|(&place, &texel)| match texel {
                NONE => level.add_up(place, &self.levels[number - 1], &sums[number - 1]),
                texel => value(texel as usize),
            });
            sums.push(own.collect());
        }
        sums
    }

    /// Sum of a value of texels over every cell, per area [1/m²]; 0 where there is no surface.
    pub fn densities<const N: usize>(&self, value: impl Fn(usize) -> [f32; N] + Sync) -> Values<N> {
        let mut densities = self.sums(value);
        for (values, level) in densities.iter_mut().zip(&self.levels) {
            divide(values, &level.areas_m2);
        }
        densities
    }

    /// Densities interpolated at a level's cells from those of the next coarser level, which have to be known. Where
    /// that has no cell, the coarser texel there is used.
    pub fn between<const N: usize>(&self, level: usize, values: &Values<N>) -> Vec<[f32; N]> {
        self.interpolated(level, |mut column, mut row| {
            let coarser = (level + 1..self.levels.len()).find_map(|number| {
                let index = self.levels[number]
                    .index(column, row)
                    .map(|index| (number, index));
                (column, row) = (column / 2, row / 2);
                index
            });
            let (number, index) = coarser?;
            let level = &self.levels[number];
            Some((level.share(level.areas_m2[index]), values[number][index]))
        })
    }

    /// Surface area of a level's cells [m²], and of all that lie in each coarser cell, up to so many levels above.
    pub fn areas_above(&self, level: usize, steps: usize) -> Vec<Vec<[f32; 1]>> {
        let own = self.levels[level].areas_m2.par_iter().map(|area_m2| [*area_m2]);
        let mut areas = vec![own.collect::<Vec<_>>()];
        let last = (level + steps).min(self.levels.len() - 1);
        for number in level + 1..=last {
            let finer = &areas[number - level - 1];
            areas.push(self.added_up(number, finer));
        }
        areas
    }

    /// Sums over the cells of the next finer level in each of a level's.
    fn added_up<const N: usize>(&self, level: usize, finer: &[[f32; N]]) -> Vec<[f32; N]> {
        let places = self.levels[level].places.par_iter();
        let sum = |&place| self.levels[level].add_up(place, &self.levels[level - 1], finer);
        places.map(sum).collect()
    }

    /// Densities of a level's cells, averaged over cells as many levels coarser as `above` goes, which is of
    /// [`Self::areas_above`], and interpolated back.
    pub fn pooled<const N: usize>(
        &self,
        level: usize,
        values: Vec<[f32; N]>,
        above: &[Vec<[f32; 1]>],
    ) -> Vec<[f32; N]> {
        let last = level + above.len() - 1;
        let mut sums = values;
        let weighted = sums.par_iter_mut().zip(&above[0]);
        weighted.for_each(|(values, [area_m2])| values.iter_mut().for_each(|value| *value *= area_m2));
        for number in level + 1..=last {
            sums = self.added_up(number, &sums);
        }
        divide(&mut sums, bytemuck::cast_slice(&above[last - level]));
        for number in (level..last).rev() {
            let (coarse, areas) = (&self.levels[number + 1], &above[number + 1 - level]);
            sums = self.interpolated(number, |column, row| {
                let index = coarse.index(column, row)?;
                Some((coarse.share(areas[index][0]), sums[index]))
            });
        }
        sums
    }

    /// Area of a level's cells, relative to the harmonic mean of those around; `above` is of [`Self::areas_above`].
    pub fn relative_areas(&self, level: usize, above: &[Vec<[f32; 1]>]) -> Vec<f32> {
        let of_level = &self.levels[level];
        let shares = of_level
            .areas_m2
            .par_iter()
            .map(|area_m2| of_level.share(*area_m2));
        let shares: Vec<f32> = shares.collect();
        if shares.iter().all(|share| *share == 1.0) {
            return shares;
        }
        let per_share = shares
            .iter()
            .map(|share| [if *share > 0.0 { 1.0 / share } else { 0.0 }]);
        let around = self.pooled(level, per_share.collect(), surroundings(above));
        shares
            .iter()
            .zip(around)
            .map(|(share, [per_share])| share * per_share)
            .collect()
    }

    /// [`Self::pooled`] without a cell's own contribution, given [`Self::relative_areas`]; exact where the surface
    /// covers the coarser cells evenly.
    pub fn around<const N: usize>(
        &self,
        level: usize,
        values: &[[f32; N]],
        (areas, above): (&[f32], &[Vec<[f32; 1]>]),
    ) -> Vec<[f32; N]> {
        let mut means = self.pooled(level, values.to_vec(), surroundings(above));
        if level + STEPS_AROUND < self.levels.len() {
            let own = |place: u32| OWN_WEIGHTS[place as usize % OWN_WEIGHTS.len()];
            let places = areas.par_iter().zip(&self.levels[level].places);
            let cells = means.par_iter_mut().zip(values).zip(places);
            cells.for_each(|((means, values), (area, place))| {
                let weight = own(place.0) * own(place.1) * area;
                means
                    .iter_mut()
                    .zip(values)
                    .for_each(|(mean, value)| *mean -= weight * value);
            });
        }
        means
    }

    /// Values at the centres of a level's cells, interpolated linearly between the centres of the next coarser level's,
    /// whose weights are their shares of surface: a sliver says little about the cells around it.
    fn interpolated<const N: usize>(
        &self,
        level: usize,
        at: impl Fn(usize, usize) -> Option<(f32, [f32; N])> + Sync,
    ) -> Vec<[f32; N]> {
        let (width, height) = self.levels[level + 1].size;
        // The parent, and its neighbour on the side of the cell.
        let near = |place: u32, count: usize| {
            let own = place as usize / 2;
            let other = if place.is_multiple_of(2) {
                own.saturating_sub(1)
            } else {
                (own + 1).min(count - 1)
            };
            [(own, 0.75), (other, 0.25)]
        };

        // Bilinear weights, times shares of surface; cells that are missing leave their weight to the others.
        let places = self.levels[level].places.par_iter();
        let value = |&(column, row): &(u32, u32)| {
            let (mut sum, mut weights) = ([0.0; N], 0.0);
            for (row, down) in near(row, height) {
                for (column, across) in near(column, width) {
                    if let Some((share, values)) = at(column, row) {
                        let weight = down * across * share;
                        weights += weight;
                        sum.iter_mut()
                            .zip(values)
                            .for_each(|(sum, value)| *sum += weight * value);
                    }
                }
            }
            sum.map(|sum: f32| if weights > 0.0 { sum / weights } else { 0.0 })
        };
        places.map(value).collect()
    }
}

/// The levels of [`Cells::areas_above`] that the surroundings of a cell are averaged over.
fn surroundings(above: &[Vec<[f32; 1]>]) -> &[Vec<[f32; 1]>] {
    &above[..above.len().min(STEPS_AROUND + 1)]
}

fn divide<const N: usize>(values: &mut [[f32; N]], areas_m2: &[f32]) {
    let cells = values.par_iter_mut().zip(areas_m2);
    cells.for_each(|(values, area_m2)| {
        let per_m2 = if *area_m2 > 0.0 { 1.0 / area_m2 } else { 0.0 };
        values.iter_mut().for_each(|value| *value *= per_m2);
    });
}
