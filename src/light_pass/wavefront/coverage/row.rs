//! The texels of one row that a triangle reaches, and their flux.

use crate::illumination::accumulator::FluxCount;

/// The texels of one row that a triangle reaches, with cumulative shares of the triangle: what lies in the rows above,
/// and in this row to the left of a texel's border. From 0 to 1, never falling.
#[derive(Clone, Copy, Debug)]
pub struct Span<'a> {
    /// Column of the first texel.
    pub first: usize,
    /// Share before the first texel.
    pub start: f64,
    /// Share up to the right border of each texel; as many as texels.
    pub ends: &'a [f64],
}

/// Room for the shares of a row, reused from row to row.
#[derive(Debug)]
pub struct RowShares {
    /// What becomes [`Span::ends`].
    pub ends: Vec<f64>,
    /// Changes of coverage from texel to texel.
    pub changes: Vec<f64>,
}

/// Counts below this times a share are exact enough for the quick way of rounding.
const QUICK: i64 = 1 << 50;

/// Adding it leaves the nearest whole number of a value of up to ±2⁵⁰ in the lowest bits.
const ROUNDER: f64 = (3_u64 << 51) as f64;

/// The nearest whole number, as bits above those of [`ROUNDER`]: only differences make sense.
fn quick_round(value: f64) -> i64 {
    (value + ROUNDER).to_bits() as i64
}

/// Counts of a cumulative share; any flux.
fn careful_round(flux: i64, share: f64) -> i64 {
    if share >= 1.0 {
        flux
    } else {
        ((flux as f64 * share).round() as i64).clamp(flux.min(0), flux.max(0))
    }
}

impl RowShares {
    /// For maps of `width` texels across.
    pub fn new(width: usize) -> Self {
        Self {
            ends: vec![0.0; width],
            changes: vec![0.0; width + 2],
        }
    }
}

impl Span<'_> {
    /// Adds a triangle's flux to the texels of the row; returns what was added.
    ///
    /// Each texel gets the difference between the rounded cumulative fluxes at its borders, so that all texels of all
    /// rows together get exactly the triangle's flux.
    pub fn add(&self, flux: FluxCount, row: &mut [FluxCount]) -> FluxCount {
        let texels = &mut row[self.first..self.first + self.ends.len()];
        if flux.iter().any(|&channel| !(0..QUICK).contains(&channel)) {
            return self.add_carefully(flux, texels);
        }
        let counts = flux.map(|channel| channel as f64);
        if flux[0] == flux[1] && flux[1] == flux[2] {
            return [self.add_grey(counts[0], texels); 3];
        }
        let begin = counts.map(|count| quick_round(count * self.start));
        let mut before = begin;
        for (texel, &end) in texels.iter_mut().zip(self.ends) {
            for channel in 0..3 {
                let after = quick_round(counts[channel] * end);
                texel[channel] += after - before[channel];
                before[channel] = after;
            }
        }
        std::array::from_fn(|channel| before[channel] - begin[channel])
    }

    fn add_grey(&self, count: f64, texels: &mut [FluxCount]) -> i64 {
        let begin = quick_round(count * self.start);
        let mut before = begin;
        for (texel, &end) in texels.iter_mut().zip(self.ends) {
            let after = quick_round(count * end);
            let share = after - before;
            for channel in texel {
                *channel += share;
            }
            before = after;
        }
        before - begin
    }

    fn add_carefully(&self, flux: FluxCount, texels: &mut [FluxCount]) -> FluxCount {
        let begin = flux.map(|channel| careful_round(channel, self.start));
        let mut before = begin;
        for (texel, &end) in texels.iter_mut().zip(self.ends) {
            for channel in 0..3 {
                let after = careful_round(flux[channel], end);
                texel[channel] += after - before[channel];
                before[channel] = after;
            }
        }
        std::array::from_fn(|channel| before[channel] - begin[channel])
    }
}
