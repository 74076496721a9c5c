//! Gaussian smoothing of a map's flux that moves integer counts between texels and loses none.
//!
//! A wide Gaussian works on a coarser map: blocks of 2ⁿ × 2ⁿ texels are summed, the sums are smoothed, and the result
//! is distributed by linear interpolation. Summation and interpolation add a variance of a quarter of a coarse texel's
//! squared side.

use rayon::prelude::*;

use super::accumulator::{FluxAccumulator, FluxCount};
use super::tiles::TileLayout;

/// The Gaussian is cut off at this many standard deviations.
const CUT_SPREADS: f64 = 4.0;

/// Smallest standard deviation that has an effect [texels]: below, less than 10⁻⁸ of a texel's flux would move.
const MIN_SPREAD_TEXELS: f64 = 1e-4;

/// Standard deviation, relative to the length of a line, from which the result is constant.
const FLAT_SPREADS: f64 = 2.0;

/// Minimum number of coarse texels per standard deviation: with fewer, the interpolation becomes visible.
const COARSE_PER_SPREAD: f64 = 2.0;

/// Coarsest level: its texels are 2 to this times as long as the finest. Rounding then stays below 2⁻³⁴ of the light's
/// power.
const COARSEST: u32 = 6;

/// Maximum number of texels of a tiled map that are smoothed at once.
const MAX_AT_ONCE: usize = 2048 * 2048;

/// Smooths flux in both directions with a Gaussian of standard deviation `spread_texels` [texels of the finest size],
/// cut off at four standard deviations and mirrored at borders. Does nothing if the deviation is NaN or not positive,
/// or on a tiled map so large that it is below half a 2048th of the side.
///
/// Conserves the counts of each channel. The result does not depend on the number of threads.
pub fn smooth(flux: &mut FluxAccumulator, layout: Option<&TileLayout>, spread_texels: f64) {
    if spread_texels < MIN_SPREAD_TEXELS || spread_texels.is_nan() {
        return;
    }
    let (width, height) = layout.map_or((flux.width(), flux.height()), TileLayout::size);
    if width == 0 || height == 0 {
        return;
    }
    let whole = (width | height).trailing_zeros().min(COARSEST);
    let most_at_once = if layout.is_some() { MAX_AT_ONCE } else { usize::MAX };
    let mut level = 0;
    while level < whole
        && (spread_texels >= COARSE_PER_SPREAD * f64::from(2_u32 << level)
            || (width >> level) * (height >> level) > most_at_once)
    {
        level += 1;
    }
    if level == 0 && layout.is_none() {
        return smooth_evenly(flux, spread_texels);
    }
    let side = f64::from(1_u32 << level);
    let added = if level == 0 { 0.0 } else { 0.25 };
    let left = (spread_texels / side).powi(2) - added;
    if left >= 0.0 {
        let mut coarse = summed(flux, layout, level);
        smooth_evenly(&mut coarse, left.sqrt());
        spread(&coarse, flux, layout, level);
    }
}

/// Texels of one size, row by row: a tile, or a row of a map without tiles.
struct Block {
    /// Its texels are 2^level times as long as the finest.
    level: u32,
    /// First column and row [finest texels].
    origin: (usize, usize),
    /// Columns and rows [its own texels].
    size: (usize, usize),
}

/// All texels, in storage order.
fn blocks(flux: &FluxAccumulator, layout: Option<&TileLayout>) -> Vec<Block> {
    match layout {
        Some(layout) => layout
            .tiles()
            .map(|tile| Block {
                level: u32::from(tile.level),
                origin: tile.origin,
                size: tile.size,
            })
            .collect(),
        None => (0..flux.height())
            .map(|row| Block {
                level: 0,
                origin: (0, row),
                size: (flux.width(), 1),
            })
            .collect(),
    }
}

impl Block {
    /// Positions of its texels [finest texels].
    fn places(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let place = |origin: usize, index: usize| origin + (index << self.level);
        let (columns, rows) = self.size;
        (0..rows).flat_map(move |row| {
            (0..columns).map(move |column| (place(self.origin.0, column), place(self.origin.1, row)))
        })
    }
}

/// Sums flux into a map whose texels are all 2^level times as long as the finest.
fn summed(flux: &FluxAccumulator, layout: Option<&TileLayout>, level: u32) -> FluxAccumulator {
    let (width, height) = layout.map_or((flux.width(), flux.height()), TileLayout::size);
    let mut coarse = FluxAccumulator::new(width >> level, height >> level);
    let across = coarse.width();
    let sums = coarse.texels_mut();
    let mut texels = flux.texels().iter();
    for block in blocks(flux, layout) {
        for ((column, row), counts) in block.places().zip(&mut texels) {
            if *counts == [0; 3] {
                continue;
            }
            let first = (row >> level) * across + (column >> level);
            let under = 1 << block.level.saturating_sub(level);
            let share = counts.map(|count| count / (under * under) as i64);
            for below in 0..under {
                for sum in &mut sums[first + below * across..][..under] {
                    add(sum, share);
                }
            }
            let rest =
                std::array::from_fn(|channel| counts[channel] - share[channel] * (under * under) as i64);
            add(&mut sums[first], rest);
        }
    }
    coarse
}

pub fn add(sum: &mut FluxCount, more: FluxCount) {
    for (sum, more) in sum.iter_mut().zip(more) {
        *sum += more;
    }
}

/// Replaces the flux of a map by that of one that is 2^level times as coarse, linearly interpolated. Remainders of
/// rounding go to the first texel under each coarse texel.
pub fn spread(coarse: &FluxAccumulator, flux: &mut FluxAccumulator, layout: Option<&TileLayout>, level: u32) {
    // Counts are divided before they are weighted: with integer weights of a fixed sum, interpolation loses no flux.
    let (across, down) = (coarse.width(), coarse.height());
    let side = 1_i64 << level;
    let whole = weight(side, 2 * side).pow(2);
    let shares: Vec<FluxCount> = coarse
        .texels()
        .iter()
        .map(|counts| counts.map(|count| count / whole))
        .collect();

    // Each texel gathers the tents of the coarse texels that reach it, mirrored at the map's borders.
    let texels: Vec<FluxCount> = blocks(flux, layout)
        .par_iter()
        .flat_map_iter(|block| {
            let shares = &shares;
            let length = 1_i64 << block.level;
            block.places().map(move |(column, row)| {
                let mut sum = [0; 3];
                for (y, weight_y) in weights(row as i64, length, side) {
                    let line = y.clamp(0, down as i64 - 1) as usize * across;
                    for (x, weight_x) in weights(column as i64, length, side) {
                        let share = shares[line + x.clamp(0, across as i64 - 1) as usize];
                        add(&mut sum, share.map(|share| share * weight_x * weight_y));
                    }
                }
                sum
            })
        })
        .collect();
    flux.texels_mut().copy_from_slice(&texels);
    let width = flux.width();
    for (index, (counts, share)) in coarse.texels().iter().zip(&shares).enumerate() {
        let (column, row) = ((index % across) << level, (index / across) << level);
        let texel = layout.map_or(row * width + column, |layout| layout.texel(column, row));
        let rest = std::array::from_fn(|channel| counts[channel] - share[channel] * whole);
        add(&mut flux.texels_mut()[texel], rest);
    }
}

/// Coarse texels that contribute to an interval of `length` finest texels, with their weights. Those beyond a border
/// stand for their mirror images.
fn weights(begin: i64, length: i64, side: i64) -> impl Iterator<Item = (i64, i64)> {
    let end = begin + length;
    // The tent of a coarse texel extends by half its side beyond it.
    let reach = side / 2;
    let first = (begin - reach).div_euclid(side);
    let last = (end - 1 + reach).div_euclid(side);
    (first..=last).map(move |coarse| {
        let origin = coarse * side - reach;
        (coarse, weight(side, end - origin) - weight(side, begin - origin))
    })
}

/// Weight of a coarse texel in all finest texels before `place`, counted from the first that it reaches: the integral
/// of a tent of twice its side; for a single finest texel, a step.
fn weight(side: i64, place: i64) -> i64 {
    if side == 1 {
        return place.clamp(0, 1);
    }
    let place = place.clamp(0, 2 * side);
    if place <= side {
        place * place
    } else {
        2 * side * side - (2 * side - place).pow(2)
    }
}

/// [`smooth`] on a map whose texels are all of one size, at that size.
fn smooth_evenly(flux: &mut FluxAccumulator, spread_texels: f64) {
    if spread_texels < MIN_SPREAD_TEXELS {
        return;
    }
    let (width, height) = (flux.width(), flux.height());
    let texels = flux.texels_mut();
    smooth_lines(texels, width, spread_texels);
    let mut columns = transposed(texels, width, height);
    smooth_lines(&mut columns, height, spread_texels);
    texels.copy_from_slice(&transposed(&columns, height, width));
}

fn transposed(texels: &[FluxCount], width: usize, height: usize) -> Vec<FluxCount> {
    let mut turned = vec![[0; 3]; texels.len()];
    turned
        .par_chunks_mut(height)
        .enumerate()
        .for_each(|(column, line)| {
            for (row, texel) in line.iter_mut().enumerate() {
                *texel = texels[row * width + column];
            }
        });
    turned
}

/// Smooths each line of `length` texels.
fn smooth_lines(texels: &mut [FluxCount], length: usize, spread: f64) {
    let kernel = Kernel::new(spread.min(FLAT_SPREADS * length as f64), length);
    texels
        .par_chunks_mut(length)
        .filter(|line| line.iter().any(|texel| *texel != [0; 3]))
        .for_each_init(
            || Line::new(length, &kernel),
            |room, line| {
                for channel in 0..3 {
                    room.smooth(line, channel, &kernel);
                }
            },
        );
}

/// Weights of a texel's neighbourhood.
struct Kernel {
    /// Distance of the first weight before the centre [texels].
    reach: usize,
    /// In order; they add up to 1.
    weights: Vec<f64>,
}

impl Kernel {
    /// The discrete Gaussian (T. Lindeberg, "Scale-space for discrete signals", 1990): weights proportional to the
    /// modified Bessel functions I_n(σ²). Its variance is σ² even where a sampled Gaussian would be too coarse.
    fn new(spread: f64, length: usize) -> Self {
        let reach = (CUT_SPREADS * spread).ceil() as usize + 1;
        let side = bessel(spread * spread, reach, (10.0 * spread) as usize + 20);
        let sum = side[0] + 2.0 * side[1..].iter().sum::<f64>();
        let weight = |offset: usize| side[offset.abs_diff(reach)] / sum;
        if reach < length {
            return Self {
                reach,
                weights: (0..=2 * reach).map(weight).collect(),
            };
        }
        // A mirrored line repeats with twice its length.
        let mut weights = vec![0.0; 2 * length];
        for offset in 0..=2 * reach {
            weights[(offset + 2 * length * reach - reach) % (2 * length)] += weight(offset);
        }
        Self { reach: 0, weights }
    }
}

/// I_n(`x`) for n from 0 to `last`, up to a common factor, by Miller's algorithm: downwards from `beyond`, where they
/// are negligible.
fn bessel(x: f64, last: usize, beyond: usize) -> Vec<f64> {
    let mut values = vec![0.0; last + 1];
    let (mut above, mut here) = (0.0, f64::MIN_POSITIVE);
    for order in (0..=beyond).rev() {
        if order <= last {
            values[order] = here;
        }
        (above, here) = (here, above + 2.0 * order as f64 / x * here);
    }
    values
}

/// Scratch space for one channel of a line.
struct Line {
    /// Counts, extended by the kernel's reach beyond the borders.
    counts: Vec<f64>,
    smoothed: Vec<f64>,
}

impl Line {
    fn new(length: usize, kernel: &Kernel) -> Self {
        Self {
            counts: vec![0.0; length + kernel.weights.len()],
            smoothed: vec![0.0; length],
        }
    }

    fn smooth(&mut self, line: &mut [FluxCount], channel: usize, kernel: &Kernel) {
        let period = 2 * line.len();
        let first = period * kernel.reach - kernel.reach;
        for (offset, count) in self.counts.iter_mut().enumerate() {
            let place = (first + offset) % period;
            *count = line[place.min(period - 1 - place)][channel] as f64;
        }
        self.smoothed.fill(0.0);
        for (offset, weight) in kernel.weights.iter().enumerate() {
            for (sum, count) in self.smoothed.iter_mut().zip(&self.counts[offset..]) {
                *sum += weight * count;
            }
        }
        let total: i64 = line.iter().map(|texel| texel[channel]).sum();
        let (mut sum, mut before) = (0.0, 0);
        let last = line.len() - 1;
        for (index, texel) in line.iter_mut().enumerate() {
            sum += self.smoothed[index];
            let rounded = ((sum + 0.5) as i64).min(total);
            let after = if index == last { total } else { rounded };
            texel[channel] = after - before;
            before = after;
        }
    }
}
