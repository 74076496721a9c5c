//! Divides integer counts of flux without losing one to rounding.

use crate::illumination::accumulator::FluxCount;
use crate::optics::LinearSrgb;

/// Mean of the colours at a patch's corners.
pub fn mean(colours: impl ExactSizeIterator<Item = LinearSrgb>) -> LinearSrgb {
    let count = colours.len() as f64;
    colours.fold(LinearSrgb::BLACK, |sum, colour| sum + colour) * count.recip()
}

/// Each channel times a factor in [0, 1], rounded.
pub fn scaled(flux: FluxCount, factor: LinearSrgb) -> FluxCount {
    let factors = factor.to_array();
    std::array::from_fn(|channel| {
        let count = flux[channel];
        ((count as f64 * factors[channel]).round() as i64).clamp(0, count.max(0))
    })
}

pub fn difference(a: FluxCount, b: FluxCount) -> FluxCount {
    std::array::from_fn(|channel| a[channel] - b[channel])
}

/// Splits a count by shares that sum to 1; the parts add up exactly.
pub fn parted(flux: FluxCount, shares: impl Iterator<Item = f64>) -> impl Iterator<Item = FluxCount> {
    let (mut given, mut sum) = ([0; 3], 0.0);
    shares.map(move |share| {
        sum += share;
        let upto = scaled(flux, LinearSrgb::grey(if sum > 1.0 - 1e-9 { 1.0 } else { sum }));
        let part = difference(upto, given);
        given = upto;
        part
    })
}

/// Splits a count into parts whose sum is exact.
pub struct Shares {
    flux: FluxCount,
    given: FluxCount,
    /// Cumulative share, by channel.
    sum: [f64; 3],
    /// Share of a part of unit colour, by channel.
    scale: [f64; 3],
    left: usize,
    /// Whether all channels were equal so far.
    is_grey: bool,
}

impl Shares {
    /// For `parts` parts of equal area whose mean colour is known. The last part absorbs rounding and any error of the
    /// mean.
    pub fn new(flux: FluxCount, parts: usize, mean: LinearSrgb) -> Self {
        let scale = mean.to_array().map(|mean| {
            if mean > 0.0 {
                1.0 / (mean * parts as f64)
            } else {
                0.0
            }
        });
        Self {
            flux,
            given: [0; 3],
            sum: [0.0; 3],
            scale,
            left: parts,
            is_grey: flux[0] == flux[1] && flux[1] == flux[2] && scale[0] == scale[1] && scale[1] == scale[2],
        }
    }

    /// The next part, of the given colour.
    pub fn next(&mut self, colour: LinearSrgb) -> FluxCount {
        self.left -= 1;
        let colour = colour.to_array();
        let is_grey = self.is_grey && colour[0] == colour[1] && colour[1] == colour[2];
        if is_grey {
            return [self.next_of(0, colour[0]); 3];
        }
        // Grey parts are summed in the first channel alone.
        if self.is_grey {
            self.is_grey = false;
            self.sum = [self.sum[0]; 3];
            self.given = [self.given[0]; 3];
        }
        std::array::from_fn(|channel| self.next_of(channel, colour[channel]))
    }

    fn next_of(&mut self, channel: usize, colour: f64) -> i64 {
        self.sum[channel] += colour * self.scale[channel];
        let upto = if self.left == 0 {
            self.flux[channel]
        } else {
            // Cumulative, so that rounding errors do not accumulate. Non-negative, so that truncation rounds down.
            ((self.flux[channel] as f64 * self.sum[channel].min(1.0) + 0.5) as i64).min(self.flux[channel])
        };
        let part = upto - self.given[channel];
        self.given[channel] = upto;
        part
    }
}
