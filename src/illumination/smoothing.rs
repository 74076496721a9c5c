//! Smoothing of a map's flux: a gaussian that moves counts between texels and loses none.

use rayon::prelude::*;

use super::accumulator::{FluxAccumulator, FluxCount};

/// Spreads at which the gaussian is cut off.
const CUT_SPREADS: f64 = 4.0;

/// Spreads [texels] below which nothing is moved: not even 10⁻⁸ of a texel's flux would be.
const LEAST_SPREAD_TEXELS: f64 = 1e-4;

/// Spreads over the map's side from which a line becomes flat.
const FLAT_SPREADS: f64 = 2.0;

/// Smooths flux with a gaussian of standard deviation `spread_texels` [texels], cut off at four of them, across and
/// down; borders mirror. Nothing happens at 0 (or less, or at what is no number).
///
/// No count is lost, in no channel of any row: a texel gets the difference of two rounded cumulative sums. The result
/// does not depend on the number of threads.
pub fn smooth(flux: &mut FluxAccumulator, spread_texels: f64) {
    if spread_texels < LEAST_SPREAD_TEXELS || spread_texels.is_nan() {
        return;
    }
    let (width, height) = (flux.width(), flux.height());
    if width == 0 || height == 0 {
        return;
    }
    let texels = flux.texels_mut();
    smooth_lines(texels, width, spread_texels);
    let mut columns = transposed(texels, width, height);
    smooth_lines(&mut columns, height, spread_texels);
    texels.copy_from_slice(&transposed(&columns, height, width));
}

/// Rows become columns.
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

/// Smooths each of the lines of `length` texels along itself.
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

/// What a texel takes of those around it.
struct Kernel {
    /// How far before the texel it begins.
    reach: usize,
    /// From there on; the sum is 1.
    weights: Vec<f64>,
}

impl Kernel {
    /// The gaussian for lattices (T. Lindeberg, "Scale-space for discrete signals", 1990): weights proportional to the
    /// modified Bessel functions I_n(σ²), whose variance is σ² even where samples of the gaussian are too coarse.
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
        // A mirrored line repeats after twice its length.
        let mut weights = vec![0.0; 2 * length];
        for offset in 0..=2 * reach {
            weights[(offset + 2 * length * reach - reach) % (2 * length)] += weight(offset);
        }
        Self { reach: 0, weights }
    }
}

/// I_n(`x`) for n from 0 to `last`, but for a common factor: by Miller's algorithm, downwards from `beyond`, where
/// they are as good as nothing.
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

/// Room for one channel of a line.
struct Line {
    /// Counts, with what the kernel takes from beyond the borders.
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
