//! Noise of photons, taken out where the light is smooth: every texel becomes a mean over as wide a window as lowers its
//! error.
//!
//! Of two independent halves A and B and their means A', B' over a window, E(A' − B)² = bias² + var A' + var B, so that
//! the window's bias shows without a reference. Expectations are means over a neighbourhood that is wider than the
//! window. Windows never reach beyond a chart; charts of several islands stay as they are.

use rayon::prelude::*;

use super::tiled_filter::filter_tiles;
use crate::illumination::Receiver;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::accuracy::Noise;
use crate::light_pass::receiver_maps::{ReceiverMap, ReceiverMaps};

/// Radii of windows [texels]; each is a box, applied twice.
const RADII: [usize; 6] = [0, 1, 2, 4, 8, 16];

/// Expectations are taken over windows of at least this radius [texels].
const LEAST_POOL: usize = 10;

/// And of at least so many times the window's own.
const POOL_PER_RADIUS: usize = 3;

/// Filters the sum of two halves, and gives the squared error of each texel that is left [W²/m⁴]. `sum` holds the light of
/// both; maps that are not filtered keep their noise.
pub fn filter(sum: &mut ReceiverMaps, halves: [&ReceiverMaps; 2], unit: FluxUnit, noise: &mut Noise) {
    let receivers: Vec<Receiver> = sum.iter().map(|(receiver, _)| receiver).collect();
    for receiver in receivers {
        let [a, b] = halves.map(|half| half.get(receiver));
        let Some(map) = sum.get_mut(receiver) else {
            continue;
        };
        if let (Some(layout), Some(squares)) = (map.chart.layout.clone(), noise.get_mut(&receiver)) {
            filter_tiles(map, &layout, [a, b], unit, squares);
        }
        if !map.is_one_piece() {
            continue;
        }
        let filtered = Filter::new(map, [a, b], unit);
        let (widths, squares) = filtered.choose();
        filtered.apply(map, &widths);
        noise.insert(receiver, squares);
    }
}

/// One map under work.
pub(super) struct Filter {
    size: (usize, usize),
    areas_m2: Vec<f64>,
    /// Flux of each half as if it were all the light [W].
    halves: [Vec<f64>; 2],
}

impl Filter {
    pub(super) fn of(size: (usize, usize), areas_m2: Vec<f64>, halves: [Vec<f64>; 2]) -> Self {
        Self {
            size,
            areas_m2,
            halves,
        }
    }

    fn new(map: &ReceiverMap, halves: [Option<&ReceiverMap>; 2], unit: FluxUnit) -> Self {
        let chart = &map.chart;
        let texels = chart.texel_count();
        let luminance = |half: Option<&ReceiverMap>| match half {
            Some(half) => {
                let flux = half.levels()[0].texels().par_iter();
                flux.map(|&count| 2.0 * unit.flux_w(count).luminance()).collect()
            }
            None => vec![0.0; texels],
        };
        Self {
            size: (chart.width, chart.height),
            areas_m2: (0..texels).map(|texel| chart.texel_area_m2(texel)).collect(),
            halves: halves.map(luminance),
        }
    }

    /// For each texel the index of its radius, and its squared error [W²/m⁴]: that of its neighbourhood, shared out there as
    /// the light is, whose variance is in proportion to it where photons carry alike.
    pub(super) fn choose(&self) -> (Vec<u8>, Vec<f64>) {
        let raw = self
            .halves
            .each_ref()
            .map(|flux| self.per_area(flux, &self.areas_m2));
        let mut widths = vec![0_u8; self.areas_m2.len()];
        let mut least = vec![f64::INFINITY; self.areas_m2.len()];
        let mut squares = least.clone();
        for (index, &radius) in RADII.iter().enumerate() {
            let area = blurred(&self.areas_m2, self.size, radius);
            let means = self
                .halves
                .each_ref()
                .map(|flux| self.per_area(&blurred(flux, self.size, radius), &area));
            let pool = LEAST_POOL.max(POOL_PER_RADIUS * radius);
            let pooled_area = box_sums(&self.areas_m2, self.size, pool);
            let expected = |square: &(dyn Fn(usize) -> f64 + Sync)| {
                let squares: Vec<f64> = (0..self.areas_m2.len())
                    .into_par_iter()
                    .map(|texel| square(texel) * self.areas_m2[texel])
                    .collect();
                self.per_area(&box_sums(&squares, self.size, pool), &pooled_area)
            };
            let half_square = |a: f64, b: f64| 0.5 * (a - b) * (a - b);
            let across = expected(&|texel| {
                half_square(means[0][texel], raw[1][texel]) + half_square(means[1][texel], raw[0][texel])
            });
            let variance = expected(&|texel| half_square(means[0][texel], means[1][texel]));
            let raw_variance = expected(&|texel| half_square(raw[0][texel], raw[1][texel]));
            let light = self.light(radius);
            let pooled_light = expected(&|texel| light[texel]);
            // All light of a pool in one texel; running sums of what cancels may say more.
            let most = ((2 * pool + 1) * (2 * pool + 1)) as f64;
            for texel in 0..squares.len() {
                let bias = (across[texel] - variance[texel] - raw_variance[texel]).max(0.0);
                // Running sums of what cancels may end below nothing.
                let square = bias + 0.5 * variance[texel].max(0.0);
                if square <= least[texel] {
                    (least[texel], widths[texel]) = (square, index as u8);
                    let share = light[texel] / pooled_light[texel];
                    squares[texel] = square
                        * if share.is_finite() {
                            share.clamp(0.0, most)
                        } else {
                            1.0
                        };
                }
            }
        }
        (widths, squares)
    }

    /// Means of both halves over a window that is no smaller than a texel's neighbours [W/m²].
    fn light(&self, radius: usize) -> Vec<f64> {
        let both: Vec<f64> = self.halves[0]
            .iter()
            .zip(&self.halves[1])
            .map(|(a, b)| 0.5 * (a + b))
            .collect();
        let radius = radius.max(1);
        let area = blurred(&self.areas_m2, self.size, radius);
        self.per_area(&blurred(&both, self.size, radius), &area)
    }

    /// Means in the place of the map's flux.
    fn apply(&self, map: &mut ReceiverMap, widths: &[u8]) {
        let counts = map.levels()[0].texels();
        let means = [0, 1, 2].map(|channel| {
            let flux: Vec<f64> = counts.iter().map(|count| count[channel] as f64).collect();
            self.smoothed(&flux, widths)
        });
        let flux: Vec<[f64; 3]> = (0..counts.len())
            .map(|texel| means.each_ref().map(|means| means[texel]))
            .collect();
        put(map, &flux);
    }

    /// Flux whose density in each texel is the mean over its window.
    pub(super) fn smoothed(&self, flux: &[f64], widths: &[u8]) -> Vec<f64> {
        let mut means = flux.to_vec();
        for (index, &radius) in RADII.iter().enumerate().skip(1) {
            if !widths.contains(&(index as u8)) {
                continue;
            }
            let area = blurred(&self.areas_m2, self.size, radius);
            let mean = self.per_area(&blurred(flux, self.size, radius), &area);
            let chosen = means
                .iter_mut()
                .enumerate()
                .filter(|(texel, _)| widths[*texel] == index as u8);
            chosen.for_each(|(texel, value)| *value = mean[texel] * self.areas_m2[texel]);
        }
        means
    }

    /// Flux over area; nothing where there is none.
    fn per_area(&self, flux: &[f64], area: &[f64]) -> Vec<f64> {
        let of = |((flux, area), own): ((&f64, &f64), &f64)| {
            if *own > 0.0 { flux / area } else { 0.0 }
        };
        flux.par_iter().zip(area).zip(&self.areas_m2).map(of).collect()
    }
}

/// Puts other counts in the place of a map's; each channel keeps its sum, to which roundings add up to nothing.
pub(super) fn put(map: &mut ReceiverMap, flux: &[[f64; 3]]) {
    let texels = map.levels_mut()[0].texels_mut();
    for channel in 0..3 {
        let before: f64 = texels.iter().map(|count| count[channel] as f64).sum();
        let after: f64 = flux.iter().map(|flux| flux[channel]).sum();
        let size: f64 = flux.iter().map(|flux| flux[channel].abs()).sum();
        // Channels of pure colours are negative in places.
        let missing = if size > 0.0 { (before - after) / size } else { 0.0 };
        let mut left = 0.0;
        for (count, flux) in texels.iter_mut().zip(flux) {
            let wanted = flux[channel] + flux[channel].abs() * missing + left;
            count[channel] = wanted.round() as i64;
            left = wanted - count[channel] as f64;
        }
    }
}

/// Sums over a square window, applied twice: weights fall towards its ends.
fn blurred(values: &[f64], size: (usize, usize), radius: usize) -> Vec<f64> {
    if radius == 0 {
        return values.to_vec();
    }
    let once = box_sums(values, size, radius);
    box_sums(&once, size, radius)
}

/// Sums over a square window around each texel.
pub(super) fn box_sums(values: &[f64], (width, height): (usize, usize), radius: usize) -> Vec<f64> {
    let mut across = vec![0.0; values.len()];
    across
        .par_chunks_mut(width)
        .zip(values.par_chunks(width))
        .for_each(|(sums, line)| line_sums(line, sums, radius));
    // Running sums begin anew at fixed rows, so that rounding does not depend on the number of threads.
    let mut down = vec![0.0; values.len()];
    down.par_chunks_mut(width * ROWS_PER_BAND)
        .enumerate()
        .for_each(|(band, rows)| {
            let first = band * ROWS_PER_BAND;
            let row_of = |row: usize| &across[row * width..(row + 1) * width];
            let mut sums = vec![0.0; width];
            for row in first.saturating_sub(radius)..(first + radius).min(height) {
                sums.iter_mut()
                    .zip(row_of(row))
                    .for_each(|(sum, value)| *sum += value);
            }
            for (row, line) in rows.chunks_mut(width).enumerate() {
                let row = first + row;
                if row + radius < height {
                    sums.iter_mut()
                        .zip(row_of(row + radius))
                        .for_each(|(sum, value)| *sum += value);
                }
                line.copy_from_slice(&sums);
                if row >= radius {
                    sums.iter_mut()
                        .zip(row_of(row - radius))
                        .for_each(|(sum, value)| *sum -= value);
                }
            }
        });
    down
}

/// Rows whose running sums begin together.
const ROWS_PER_BAND: usize = 64;

fn line_sums(line: &[f64], sums: &mut [f64], radius: usize) {
    let mut sum: f64 = line.iter().take(radius).sum();
    for index in 0..line.len() {
        sum += line.get(index + radius).unwrap_or(&0.0);
        sums[index] = sum;
        if index >= radius {
            sum -= line[index - radius];
        }
    }
}
