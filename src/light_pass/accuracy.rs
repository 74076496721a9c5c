//! Error estimates without a reference, from the differences between maps of nested lattices.
//!
//! Let I be the map of a lattice, I₂ that of the lattice with twice the step, I₄ the next. The errors of successive
//! levels turn out to be independent (they depend on where cuts and cells happen to lie), so that
//! ⟨(I − I₂)²⟩ = e²(1 + R²) with R = e₂/e. Light that is cut off along lines converges at first order, R = 2. R is also
//! measured as √(⟨(I₂ − I₄)²⟩/⟨(I − I₂)²⟩). A single measurement is noisy, so R is the geometric mean of both.
//!
//! A difference does not show what all levels miss: truncated light (threshold, depth, unresolved) is added by its
//! watts.

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use super::ledger::EnergyLedger;
use super::receiver_maps::{ReceiverMap, ReceiverMaps};
use super::wavefront::refine::{RoughTiles, TILE_SIDE, TileSet, tile_counts};
use crate::illumination::accumulator::FluxUnit;
use crate::illumination::tiles::TileLayout;
use crate::illumination::{Chart, Receiver};

/// Error ratio of successive levels before it is measured: first order.
const PRIOR_RATIO: f64 = 2.0;

/// Measured ratios are clamped to this range.
const RATIO_RANGE: (f64, f64) = (1.5, 6.0);

/// Lower bound on a level's squared error, relative to that of the level before.
const MIN_GAIN: f64 = 1.0 / (RATIO_RANGE.1 * RATIO_RANGE.1);

/// Lower bound on a tile's squared error, relative to the mean of the tiles around it.
const MIN_SHARE_OF_NEIGHBOURS: f64 = 0.25;

/// Squared errors of texels are averaged up to this many texels away.
const WINDOW_TEXELS: usize = 2;

/// Irradiance of one map, for error estimates.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Texels across; in a tiled map, of the finest size.
    pub width: usize,
    pub height: usize,
    /// Luminance of E per texel [W/m², for a light of unit strength].
    pub luminance: Vec<f64>,
    /// Area under each texel [m²]; a single value if all are equal.
    pub texel_areas_m2: Vec<f64>,
    /// `None` for an untiled map.
    pub layout: Option<Arc<TileLayout>>,
}

/// Images of one level, by receiver.
pub type Images = BTreeMap<Receiver, Image>;

/// Error estimate of one map.
#[derive(Clone, Debug, PartialEq)]
pub struct MapError {
    /// Size of the map [texels].
    pub size: (usize, usize),
    /// Expected error of each texel's luminance, the root of variance and squared bias [W/m², for a light of unit
    /// strength].
    pub texels: Vec<f32>,
    /// Squared error times area, summed over each tile [W²/m²].
    pub tiles: Vec<f64>,
}

/// Error estimate of all maps of one light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightError {
    pub maps: BTreeMap<Receiver, MapError>,
    /// Root mean square error over all texels, weighted by area, relative to the mean irradiance.
    pub relative_rmse: f64,
    /// Error of the level before over that of the last level.
    pub ratio: f64,
}

impl LightError {
    /// Scales all errors up to a larger relative squared error.
    pub fn raise_to(&mut self, relative_square: f64) {
        let factor = relative_square.sqrt() / self.relative_rmse;
        if !(factor > 1.0 && factor.is_finite()) {
            return;
        }
        self.relative_rmse *= factor;
        for map in self.maps.values_mut() {
            let raise = |error: &mut f32| *error = single(f64::from(*error) * factor);
            map.texels.iter_mut().for_each(raise);
            map.tiles.iter_mut().for_each(|square| *square *= factor * factor);
        }
    }
}

/// Converts to the precision of an error, which may not become infinite.
fn single(error: f64) -> f32 {
    error.min(f64::from(f32::MAX)) as f32
}

pub fn images(maps: &ReceiverMaps, unit: FluxUnit) -> Images {
    let image = |(receiver, map): (Receiver, &ReceiverMap)| {
        let chart = &map.chart;
        let luminance = map
            .flux()
            .texels()
            .par_iter()
            .enumerate()
            .map(|(texel, &count)| {
                let area_m2 = chart.texel_area_m2(texel);
                if area_m2 > 0.0 {
                    unit.flux_w(count).luminance() / area_m2
                } else {
                    0.0
                }
            })
            .collect();
        (receiver, Image::new(chart, luminance))
    };
    maps.iter().map(image).collect()
}

impl Image {
    fn new(chart: &Chart, luminance: Vec<f64>) -> Self {
        Self {
            width: chart.width,
            height: chart.height,
            luminance,
            texel_areas_m2: chart.texel_areas_m2.clone(),
            layout: chart.layout.clone(),
        }
    }

    pub fn area_m2(&self, texel: usize) -> f64 {
        if self.texel_areas_m2.len() == 1 {
            self.texel_areas_m2[0]
        } else {
            self.texel_areas_m2[texel]
        }
    }

    /// The tile of [`TILE_SIDE`] in which each texel lies, or the first of several.
    fn tiles(&self) -> TileOf {
        match &self.layout {
            Some(layout) => TileOf::Listed(layout.blocks(TILE_SIDE)),
            None => TileOf::Counted {
                width: self.width,
                columns: tile_counts(self.width, self.height).0,
            },
        }
    }

    /// Flux [W] and area [m²] of all texels.
    fn sums(&self) -> (f64, f64) {
        (0..self.luminance.len()).fold((0.0, 0.0), |(flux, area), texel| {
            let texel_m2 = self.area_m2(texel);
            (flux + self.luminance[texel] * texel_m2, area + texel_m2)
        })
    }

    /// Squared difference of each texel from another map of the same surface; from black if there is none.
    fn squared_difference(&self, other: Option<&Self>) -> Vec<f64> {
        let square = |(texel, value): (usize, &f64)| {
            let before = other.map_or(0.0, |other| other.luminance[texel]);
            (value - before) * (value - before)
        };
        self.luminance.par_iter().enumerate().map(square).collect()
    }

    /// Sums over tiles, weighted by texel area.
    pub fn tile_sums(&self, squares: &[f64]) -> Vec<f64> {
        let (columns, rows) = tile_counts(self.width, self.height);
        let mut sums = vec![0.0; columns * rows];
        let tiles = self.tiles();
        let Some(layout) = &self.layout else {
            for (texel, square) in squares.iter().enumerate() {
                sums[tiles.of(texel)] += square * self.area_m2(texel);
            }
            return sums;
        };
        for tile in layout.tiles() {
            // A large texel covers several tiles.
            let side = (1_usize << tile.level).div_ceil(TILE_SIDE);
            let share = 1.0 / (side * side) as f64;
            for texel in tile.texels {
                let part = squares[texel] * self.area_m2(texel) * share;
                let first = tiles.of(texel);
                for row in 0..side {
                    let begin = first + row * columns;
                    sums[begin..begin + side].iter_mut().for_each(|sum| *sum += part);
                }
            }
        }
        sums
    }

    /// Raises each tile to at least a part of the mean around it: two levels may agree in a tile by chance.
    fn pooled(&self, tiles: &[f64]) -> Vec<f64> {
        let (columns, rows) = tile_counts(self.width, self.height);
        let around = |tile: usize| {
            let (column, row) = (tile % columns, tile / columns);
            let near = |index: usize, count: usize| index.saturating_sub(1)..=(index + 1).min(count - 1);
            let cells = near(row, rows).flat_map(|row| near(column, columns).map(move |c| row * columns + c));
            let (sum, count) = cells.fold((0.0, 0), |(sum, count), tile| (sum + tiles[tile], count + 1));
            sum / f64::from(count)
        };
        let least = |(tile, own): (usize, &f64)| own.max(MIN_SHARE_OF_NEIGHBOURS * around(tile));
        tiles.iter().enumerate().map(least).collect()
    }

    /// Means over a square window around each texel, clipped to the map or to the texel's tile.
    fn windowed(&self, squares: &[f64]) -> Vec<f64> {
        let mut means = vec![0.0; squares.len()];
        let Some(layout) = &self.layout else {
            let size = (self.width, self.height);
            let lines = means.par_chunks_mut(self.width).enumerate();
            lines.for_each(|(row, line)| window(squares, size, row, line));
            return means;
        };
        let mut rest = &mut means[..];
        let mut tiles = Vec::with_capacity(layout.tile_count());
        for tile in layout.tiles() {
            let (ours, others) = rest.split_at_mut(tile.texels.len());
            tiles.push((tile, ours));
            rest = others;
        }
        tiles.into_par_iter().for_each(|(tile, means)| {
            let squares = &squares[tile.texels];
            for (row, line) in means.chunks_mut(tile.size.0).enumerate() {
                window(squares, tile.size, row, line);
            }
        });
        means
    }
}

/// Means over a square window around each texel of one row of an image.
fn window(squares: &[f64], (width, height): (usize, usize), row: usize, line: &mut [f64]) {
    let near = |index: usize, count: usize| {
        index.saturating_sub(WINDOW_TEXELS)..(index + WINDOW_TEXELS + 1).min(count)
    };
    let rows = near(row, height);
    let mut columns = vec![0.0; width];
    for row in rows.clone() {
        for (sum, square) in columns.iter_mut().zip(&squares[row * width..][..width]) {
            *sum += square;
        }
    }
    for (column, mean) in line.iter_mut().enumerate() {
        let window = near(column, width);
        let texels = (window.len() * rows.len()) as f64;
        *mean = columns[window].iter().sum::<f64>() / texels;
    }
}

/// Maps texels to tiles.
enum TileOf {
    /// An untiled map.
    Counted { width: usize, columns: usize },
    /// A tiled map: the tile of each texel.
    Listed(Vec<u32>),
}

impl TileOf {
    fn of(&self, texel: usize) -> usize {
        match self {
            Self::Counted { width, columns } => {
                texel / width / TILE_SIDE * columns + texel % width / TILE_SIDE
            }
            Self::Listed(tiles) => tiles[texel] as usize,
        }
    }
}

/// The estimate of the round before this one, which refined only some tiles.
#[derive(Clone, Copy, Debug)]
pub struct PreviousRound<'a> {
    pub error: &'a LightError,
    /// Tiles that this round refined.
    pub refined: &'a RoughTiles,
}

/// The error of `fine`, from the two levels before it (`coarser[0]` is the finer one; the other may be missing). Tiles
/// that were not refined keep their former error. `None` without `coarser[0]`, or if no light arrived.
pub fn estimate(
    fine: &Images,
    coarser: [Option<&Images>; 2],
    before: Option<PreviousRound>,
    ledger: &EnergyLedger,
) -> Option<LightError> {
    let middle = coarser[0]?;
    let is_refined = |receiver: Receiver, tile: usize| {
        before.is_none_or(|before| {
            let tiles = before.refined.get(&receiver);
            tiles.is_some_and(|tiles| tiles.is_chosen(tile))
        })
    };
    let differences: BTreeMap<Receiver, (Vec<f64>, Vec<f64>)> = fine
        .iter()
        .map(|(&receiver, image)| {
            let squares = image.squared_difference(middle.get(&receiver));
            let tiles = image.pooled(&image.tile_sums(&squares));
            (receiver, (squares, tiles))
        })
        .collect();
    let ratio = match (coarser[1], before) {
        (Some(coarse), None) => measured_ratio(middle, coarse, &differences),
        // Later rounds keep the ratio of the first ones, since each refines different tiles.
        (_, Some(before)) => before.error.ratio,
        (None, None) => PRIOR_RATIO,
    };
    let share = 1.0 / (1.0 + ratio * ratio);
    let mut error = LightError {
        ratio,
        ..LightError::default()
    };
    let (mut squares_sum, mut flux_w, mut area_m2) = (0.0, 0.0, 0.0);
    for (&receiver, image) in fine {
        let (squares, tile_sums) = &differences[&receiver];
        let old = before.and_then(|before| before.error.maps.get(&receiver));
        let older_tiles = older_differences(receiver, middle, coarser[1]);
        let windowed = image.windowed(squares);
        let tiles_of = image.tiles();
        let texels = (0..windowed.len()).map(|texel| match old {
            Some(old) if !is_refined(receiver, tiles_of.of(texel)) => old.texels[texel],
            _ => single((windowed[texel] * share).sqrt()),
        });
        let tiles: Vec<f64> = (0..tile_sums.len())
            .map(|tile| match old {
                Some(old) if !is_refined(receiver, tile) => old.tiles[tile],
                // A difference may vanish by chance, or because both levels miss the same light.
                Some(old) => (tile_sums[tile] * share).max(old.tiles[tile] * MIN_GAIN),
                None => {
                    let older = older_tiles.as_ref().map_or(0.0, |tiles| tiles[tile]);
                    tile_sums[tile].max(older * MIN_GAIN) * share
                }
            })
            .collect();
        squares_sum += tiles.iter().sum::<f64>();
        let (map_w, map_m2) = image.sums();
        (flux_w, area_m2) = (flux_w + map_w, area_m2 + map_m2);
        let texels = texels.collect();
        let size = (image.width, image.height);
        error.maps.insert(receiver, MapError { size, texels, tiles });
    }
    let truncated = truncated_share(ledger);
    let mean = flux_w / area_m2;
    error.relative_rmse = (squares_sum / area_m2 / (mean * mean) + truncated * truncated).sqrt();
    (flux_w > 0.0).then_some(error)
}

/// Squared differences between the two coarser levels, by tile.
fn older_differences(receiver: Receiver, middle: &Images, coarse: Option<&Images>) -> Option<Vec<f64>> {
    let image = middle.get(&receiver)?;
    Some(image.tile_sums(&image.squared_difference(coarse?.get(&receiver))))
}

/// Squared difference between half sets of rays, around each texel, by receiver [W²/m⁴, for a light of unit strength].
pub type Noise = BTreeMap<Receiver, Vec<f64>>;

/// The noise of the sum of two half sets, whose difference has the same variance.
pub fn half_set_noise(a: &Images, b: &Images) -> Noise {
    let of = |(&receiver, image): (&Receiver, &Image), other: &Images| {
        let squares = image.squared_difference(other.get(&receiver));
        (receiver, image.windowed(&squares))
    };
    let mut noise: Noise = a.iter().map(|map| of(map, b)).collect();
    let only_second = b.iter().filter(|(receiver, _)| !a.contains_key(receiver));
    noise.extend(only_second.map(|map| of(map, a)));
    noise
}

/// How much larger the squared noise may be than half sets show, by two standard deviations: few texels, or few photons
/// in them, tell little, and of levels that differ by chance, one that looks good ends the bake. The squares d² of
/// differences have the variance 2v² if d is normal, and then d⁴ is 3v² in the mean.
pub fn doubt_of_halves(a: &Images, b: &Images) -> f64 {
    let (mut squares, mut fourths) = (0.0, 0.0);
    for (&receiver, image) in a {
        let differences = image.squared_difference(b.get(&receiver));
        for (texel, square) in differences.iter().enumerate() {
            let by_area = square * image.area_m2(texel);
            squares += by_area;
            fourths += by_area * by_area;
        }
    }
    if squares > 0.0 {
        2.0 * (2.0 / 3.0 * fourths).sqrt() / squares
    } else {
        0.0
    }
}

/// Noise of a map's difference from the map of every fourth ray, relative to the map's own noise.
const NOISE_OF_DIFFERENCE: f64 = 1.5;

/// The error of splats. Half sets give the noise. The rest of the difference D from `thinner`, the map of every fourth
/// ray, is attributed half to blur, which levels share (e = D/(R − 1)), and half to the pattern of the lattice, which
/// they do not (e = D/√(1 + R²)), both of first order. `None` if no light arrived.
pub fn estimate_splats(
    fine: &Images,
    thinner: &Images,
    noise: &Noise,
    ledger: &EnergyLedger,
) -> Option<LightError> {
    let blur = 1.0 / ((PRIOR_RATIO - 1.0) * (PRIOR_RATIO - 1.0));
    let share = 0.5 * (blur + 1.0 / (1.0 + PRIOR_RATIO * PRIOR_RATIO));
    by_squares(fine, ledger, |receiver, image| {
        let differences = image.windowed(&image.squared_difference(thinner.get(&receiver)));
        let pairs = differences.iter().zip(noise.get(&receiver)?);
        let square = |(difference, noise): (&f64, &f64)| {
            noise + (difference - NOISE_OF_DIFFERENCE * noise).max(0.0) * share
        };
        Some(pairs.map(square).collect())
    })
}

/// The error of photons: half sets give the noise. Maps that no photon changed have none. `None` if no light arrived.
pub fn by_noise(fine: &Images, mut noise: Noise, ledger: &EnergyLedger) -> Option<LightError> {
    by_squares(fine, ledger, |receiver, image| {
        let quiet = || vec![0.0; image.luminance.len()];
        Some(noise.remove(&receiver).unwrap_or_else(quiet))
    })
}

/// The error of `fine`, whose square is a share of the squared difference from `other`. `None` if no light arrived.
pub fn by_difference(fine: &Images, other: &Images, share: f64, ledger: &EnergyLedger) -> Option<LightError> {
    by_squares(fine, ledger, |receiver, image| {
        let squares = image.windowed(&image.squared_difference(other.get(&receiver)));
        Some(squares.iter().map(|square| square * share).collect())
    })
}

/// The error from its square around each texel, map by map.
fn by_squares(
    fine: &Images,
    ledger: &EnergyLedger,
    mut squares: impl FnMut(Receiver, &Image) -> Option<Vec<f64>>,
) -> Option<LightError> {
    let mut error = LightError {
        ratio: PRIOR_RATIO,
        ..LightError::default()
    };
    let (mut squares_sum, mut flux_w, mut area_m2) = (0.0, 0.0, 0.0);
    for (&receiver, image) in fine {
        let squares = squares(receiver, image)?;
        let tiles = image.tile_sums(&squares);
        squares_sum += tiles.iter().sum::<f64>();
        let (map_w, map_m2) = image.sums();
        (flux_w, area_m2) = (flux_w + map_w, area_m2 + map_m2);
        let map = MapError {
            size: (image.width, image.height),
            texels: squares.iter().map(|square| single(square.sqrt())).collect(),
            tiles,
        };
        error.maps.insert(receiver, map);
    }
    let mean = flux_w / area_m2;
    error.relative_rmse = (squares_sum / area_m2 / (mean * mean))
        .sqrt()
        .hypot(truncated_share(ledger));
    (flux_w > 0.0).then_some(error)
}

/// R = e₂/e from three levels: the geometric mean of the measured and the first-order ratio.
fn measured_ratio(middle: &Images, coarse: &Images, fine: &BTreeMap<Receiver, (Vec<f64>, Vec<f64>)>) -> f64 {
    let newer: f64 = fine.values().flat_map(|(_, tiles)| tiles).sum();
    let older: f64 = middle
        .iter()
        .map(|(receiver, image)| {
            let squares = image.squared_difference(coarse.get(receiver));
            image.tile_sums(&squares).iter().sum::<f64>()
        })
        .sum();
    let measured = (older / newer).sqrt().clamp(RATIO_RANGE.0, RATIO_RANGE.1);
    if measured.is_nan() {
        PRIOR_RATIO
    } else {
        (measured * PRIOR_RATIO).sqrt()
    }
}

/// Share of the light that is missing from the maps. Light that ended by depth or threshold is assumed to divide like
/// the rest between maps, absorption and escape; all that could not be resolved, to be missing from the maps.
pub fn truncated_share(ledger: &EnergyLedger) -> f64 {
    let truncated = &ledger.truncated;
    let arrived = ledger.deposited + ledger.absorbed + ledger.escaped;
    let ended = truncated.depth + truncated.threshold;
    let lost = truncated.non_finite + truncated.unresolved + truncated.quadrature.abs();
    if ledger.deposited > 0.0 {
        ended / arrived + lost / ledger.deposited
    } else {
        0.0
    }
}

/// The roughest tiles, as many as have to be refined for a relative RMSE of `goal`, if refinement divides their error
/// by the ratio of the levels; all tiles with an error if that is not enough. `counted`: squared errors of tiles to be
/// used instead, where tiles do not all count alike.
pub fn rough_tiles(
    error: &LightError,
    goal: f64,
    counted: Option<&BTreeMap<Receiver, Vec<f64>>>,
) -> RoughTiles {
    let mut tiles: Vec<(f64, Receiver, usize)> = Vec::new();
    for (&receiver, map) in &error.maps {
        let squares = counted
            .and_then(|counted| counted.get(&receiver))
            .unwrap_or(&map.tiles);
        let with_error = squares.iter().enumerate().filter(|(_, square)| **square > 0.0);
        tiles.extend(with_error.map(|(tile, &square)| (square, receiver, tile)));
    }
    // Roughest first, ties by position.
    tiles.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let total: f64 = tiles.iter().map(|(square, ..)| square).sum();
    let wanted = total * (goal / error.relative_rmse) * (goal / error.relative_rmse);
    let gain = 1.0 - 1.0 / (error.ratio * error.ratio);
    let mut chosen = RoughTiles::new();
    let mut left = total;
    for (square, receiver, tile) in tiles {
        if left <= wanted {
            break;
        }
        left -= square * gain;
        let (width, height) = error.maps[&receiver].size;
        chosen
            .entry(receiver)
            .or_insert_with(|| TileSet::none(width, height))
            .choose(tile);
    }
    chosen
}
