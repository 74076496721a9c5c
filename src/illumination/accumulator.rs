//! Exact sums of flux: 64-bit integers in a fixed unit, so that neither the order of the deposits nor the number of
//! threads changes a bit of the result.

use super::Chart;
use crate::optics::LinearSrgb;

/// Unit in which flux is counted: a power of two of watts, 2⁻⁶⁰ of the maximum power that can be deposited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluxUnit {
    watts: f64,
    /// Exact as long as `watts` is a power of two.
    counts_per_watt: f64,
}

/// Flux per channel, counted in a [`FluxUnit`].
pub type FluxCount = [i64; 3];

impl FluxUnit {
    /// Unit for sums of up to `power_w` [W per channel, > 0]; they stay below 2⁶⁰ and cannot overflow.
    pub fn for_power(power_w: f64) -> Self {
        // Keeps the unit above zero for denormal powers.
        let exponent = (power_w.log2().ceil() - 60.0).clamp(-1022.0, 960.0);
        Self {
            watts: exponent.exp2(),
            counts_per_watt: (-exponent).exp2(),
        }
    }

    /// Unit in which the counts of a total are those of its mean over `sums` terms.
    #[must_use]
    pub fn per(self, sums: u64) -> Self {
        Self {
            watts: self.watts / sums as f64,
            counts_per_watt: self.counts_per_watt * sums as f64,
        }
    }

    /// Unit in which the counts of a mean are those of `factor` times that mean.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self {
            watts: self.watts * factor,
            counts_per_watt: self.counts_per_watt / factor,
        }
    }

    /// One count [W].
    pub fn watts(self) -> f64 {
        self.watts
    }

    /// The nearest count, per channel.
    pub fn count(self, flux_w: LinearSrgb) -> FluxCount {
        let [r, g, b] = flux_w.to_array();
        let count = |channel: f64| nearest(channel * self.counts_per_watt);
        let red = count(r);
        // Grey light is most common.
        let alike = |channel: f64| if channel == r { red } else { count(channel) };
        [red, alike(g), alike(b)]
    }

    /// Watts of a count.
    pub fn flux_w(self, count: FluxCount) -> LinearSrgb {
        LinearSrgb::from(count.map(|channel| channel as f64 * self.watts))
    }
}

/// Rounds to the nearest integer, halves away from zero, without a call into the mathematics library.
fn nearest(x: f64) -> i64 {
    let towards_zero = x as i64;
    let rest = x - towards_zero as f64;
    towards_zero + i64::from(rest >= 0.5) - i64::from(rest <= -0.5)
}

/// Flux per texel of a map, row 0 at v = 0. A tiled map is a single row, tile after tile.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FluxAccumulator {
    width: usize,
    height: usize,
    texels: Vec<FluxCount>,
}

impl FluxAccumulator {
    /// Without flux.
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            texels: vec![[0; 3]; width * height],
        }
    }

    /// Without flux, with the texels of a chart.
    pub fn for_chart(chart: &Chart) -> Self {
        match &chart.layout {
            Some(layout) => Self::new(layout.texel_count(), 1),
            None => Self::new(chart.width, chart.height),
        }
    }

    /// Texels across.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Texels down.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Counts row by row.
    pub fn texels(&self) -> &[FluxCount] {
        &self.texels
    }

    pub fn texels_mut(&mut self) -> &mut [FluxCount] {
        &mut self.texels
    }
}

/// The same sums in less memory: dark texels take a bit, grey light a single count per texel.
#[derive(Clone, Debug)]
pub struct PackedFlux {
    width: usize,
    height: usize,
    /// A bit per texel that has flux.
    lit: Vec<u64>,
    /// Whether all channels are alike; `counts` then has one of the three.
    is_grey: bool,
    counts: Vec<i64>,
}

impl PackedFlux {
    pub fn new(flux: &FluxAccumulator) -> Self {
        let is_lit = |texel: &&FluxCount| **texel != [0; 3];
        let bits = |texels: &[FluxCount]| {
            let bits = texels.iter().enumerate();
            bits.fold(0, |bits, (place, texel)| {
                bits | u64::from(is_lit(&texel)) << place
            })
        };
        let is_grey = flux.texels.iter().all(|[r, g, b]| r == g && g == b);
        let channels = if is_grey { 1 } else { 3 };
        let lit = flux.texels.iter().filter(is_lit);
        let mut counts = Vec::with_capacity(channels * lit.clone().count());
        lit.for_each(|texel| counts.extend_from_slice(&texel[..channels]));
        Self {
            width: flux.width,
            height: flux.height,
            lit: flux.texels.chunks(64).map(bits).collect(),
            is_grey,
            counts,
        }
    }

    pub fn unpacked(&self) -> FluxAccumulator {
        let mut flux = FluxAccumulator::new(self.width, self.height);
        let is_lit = |texel: usize| self.lit[texel / 64] >> (texel % 64) & 1 == 1;
        let lit = flux.texels.iter_mut().enumerate();
        let lit = lit.filter(|(texel, _)| is_lit(*texel)).map(|(_, count)| count);
        if self.is_grey {
            lit.zip(&self.counts)
                .for_each(|(texel, count)| *texel = [*count; 3]);
        } else {
            let (counts, _) = self.counts.as_chunks();
            lit.zip(counts).for_each(|(texel, count)| *texel = *count);
        }
        flux
    }

    /// Memory [bytes].
    pub fn bytes(&self) -> u64 {
        8 * (self.lit.len() + self.counts.len()) as u64
    }
}
