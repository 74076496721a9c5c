//! The texels of one row that a triangle reaches, and their flux.

use super::shape::most;
use crate::illumination::accumulator::FluxCount;

/// The texels of one row that a triangle reaches, with cumulative shares of the triangle: the part in the rows above,
/// and in this row left of a texel's border. From 0 to 1; rounding may make them decrease slightly.
#[derive(Clone, Copy, Debug)]
pub struct Span<'a> {
    /// Column of the first texel.
    pub first: usize,
    /// Share before the first texel.
    pub start: f64,
    /// Share up to the right border of each texel, one per texel.
    pub ends: &'a [f64],
}

/// Receives the rows of a triangle.
pub trait Sink {
    fn add(&mut self, row: usize, span: Span);
}

/// Buffer for the shares of a row, reused from row to row.
#[derive(Debug)]
pub struct RowShares {
    /// Storage of [`Span::ends`], padded to a multiple of four.
    pub ends: Vec<f64>,
}

impl RowShares {
    /// For maps of `width` texels across.
    pub fn new(width: usize) -> Self {
        Self {
            ends: vec![0.0; width.next_multiple_of(4)],
        }
    }
}

/// A triangle's flux, prepared for division.
#[derive(Clone, Copy, Debug)]
pub struct PreparedTriangle {
    flux: FluxCount,
    counts: [f64; 3],
    way: RowMethod,
}

#[derive(Clone, Copy, Debug)]
enum RowMethod {
    /// All channels are equal.
    Grey,
    Colour,
    /// Counts too large for the fast rounding.
    Careful,
}

/// Smallest count that is too large for the fast rounding.
const QUICK: i64 = 1 << 48;

/// Adding this puts the nearest integer of a value up to 2⁵⁰ into the lowest bits.
const ROUNDER: f64 = (3_u64 << 51) as f64;

/// The nearest integer in the bits of a double offset by [`ROUNDER`]: only differences are meaningful.
#[inline(always)]
fn quick_round(value: f64) -> i64 {
    (value + ROUNDER).to_bits() as i64
}

/// Cumulative shares from here on are 1 up to rounding.
const NEARLY_ALL: f64 = 1.0 - 2e-15;

/// Counts of a cumulative share, for any flux.
fn careful_round(flux: i64, share: f64) -> i64 {
    if share >= NEARLY_ALL {
        flux
    } else {
        ((flux as f64 * share).round() as i64).clamp(flux.min(0), flux.max(0))
    }
}

impl PreparedTriangle {
    #[inline(always)]
    pub fn new(flux: FluxCount) -> Self {
        let quick = flux.iter().all(|channel| (0..QUICK).contains(channel));
        let grey = flux[0] == flux[1] && flux[1] == flux[2];
        Self {
            flux,
            counts: flux.map(|channel| channel as f64),
            way: match (quick, grey) {
                (true, true) => RowMethod::Grey,
                (true, false) => RowMethod::Colour,
                (false, _) => RowMethod::Careful,
            },
        }
    }

    /// Adds the flux of a span to the texels of its row; returns what was added.
    ///
    /// Each texel gets the difference of the rounded cumulative fluxes at its borders, so that all texels of all rows
    /// together get exactly the triangle's flux.
    #[inline(always)]
    pub fn add(&self, span: Span, row: &mut [FluxCount]) -> FluxCount {
        let texels = &mut row[span.first..span.first + span.ends.len()];
        match self.way {
            RowMethod::Grey => [self.add_grey(span, texels); 3],
            RowMethod::Colour => self.add_colour(span, texels),
            RowMethod::Careful => self.add_carefully(span, texels),
        }
    }

    #[inline(always)]
    fn add_grey(&self, span: Span, texels: &mut [FluxCount]) -> i64 {
        let count = self.counts[0];
        let begin = quick_round(count * span.start);
        let (mut before, mut share_before) = (begin, span.start);
        for (texel, &end) in texels.iter_mut().zip(span.ends) {
            share_before = most(end, share_before);
            let after = quick_round(count * share_before);
            let share = after - before;
            for channel in texel {
                *channel += share;
            }
            before = after;
        }
        before - begin
    }

    fn add_colour(&self, span: Span, texels: &mut [FluxCount]) -> FluxCount {
        let begin = self.counts.map(|count| quick_round(count * span.start));
        let (mut before, mut share_before) = (begin, span.start);
        for (texel, &end) in texels.iter_mut().zip(span.ends) {
            share_before = most(end, share_before);
            for channel in 0..3 {
                let after = quick_round(self.counts[channel] * share_before);
                texel[channel] += after - before[channel];
                before[channel] = after;
            }
        }
        std::array::from_fn(|channel| before[channel] - begin[channel])
    }

    #[cold]
    fn add_carefully(&self, span: Span, texels: &mut [FluxCount]) -> FluxCount {
        let begin = self.flux.map(|channel| careful_round(channel, span.start));
        let (mut before, mut share_before) = (begin, span.start);
        for (texel, &end) in texels.iter_mut().zip(span.ends) {
            share_before = most(end, share_before);
            for channel in 0..3 {
                let after = careful_round(self.flux[channel], share_before);
                texel[channel] += after - before[channel];
                before[channel] = after;
            }
        }
        std::array::from_fn(|channel| before[channel] - begin[channel])
    }
}
