//! Noise of photons, taken out where the light is smooth.
//!
//! A map is taken apart into a coarse picture and, level by level, what finer cells differ by from what lies between
//! coarser ones. Of two independent halves A and B, such details have the mean product S = ⟨d_A d_B⟩, which noise adds
//! nothing to, and the noise N = ⟨(d_A − d_B)²⟩/4. Each is kept in part, S/(S + N), which is what a Wiener filter keeps
//! (Wiener 1949). What is dropped of S, and what is left of N, is the error. S and N are those of the cells around: a cell
//! that judged itself would keep what happens to be alike in both halves, and its error would look smaller than it is.

use rayon::prelude::*;

use super::cells::{Cells, Values};
use crate::illumination::accumulator::{FluxCount, FluxUnit};
use crate::light_pass::accuracy::Noise;
use crate::light_pass::receiver_maps::{ReceiverMap, ReceiverMaps};
use crate::optics::{LinearSrgb, luminance};

/// What a photon brings is a mean over cells so many levels coarser.
const PHOTONS_POOLED: usize = 5;

/// Products of details as large as by so many pairs of photons are taken for chance: two photons in one texel.
const CHANCE_PAIRS: f32 = 2.0;

/// The error of a texel is in proportion to this power of its light, among the texels around it.
const ERROR_BY_LIGHT: f32 = 1.5;

/// Details take no more of the light of a cell than leaves this part of it, where channels may be negative.
const LEAST_LEFT: f32 = 1e-5;

/// Light is told from none down to this part of the map's mean.
const DARKEST: f32 = 1e-4;

/// Whether a map can be filtered: charts of several islands without tiles stay as they are, and keep their noise.
pub fn takes(map: &ReceiverMap) -> bool {
    map.chart.layout.is_some() || map.is_one_piece()
}

/// Filters the sum of two halves, and gives the squared error of each texel that is left [W²/m⁴]. `sum` holds the light of
/// both; `is_signed`: channels of its light may be negative.
pub fn filter(sum: &mut ReceiverMaps, halves: [&ReceiverMaps; 2], unit: FluxUnit, is_signed: bool) -> Noise {
    let mut noise = Noise::new();
    for (receiver, map) in sum.iter_mut().filter(|(_, map)| takes(map)) {
        let details = Details::new(map, halves.map(|half| half.get(receiver)), unit, is_signed);
        let kept = details.filtered();
        noise.insert(receiver, details.squares(&kept, map));
        details.put(&kept, map, unit);
    }
    noise
}

/// Takes negative counts, which the noise of bundles leaves where there is little light, out of all others.
pub fn without_negative(maps: &mut ReceiverMaps) {
    for (_, map) in maps.iter_mut() {
        let counts = map.levels()[0].texels();
        if counts.iter().flatten().any(|count| *count < 0) {
            let positive: Vec<[f64; 3]> = counts
                .iter()
                .map(|texel| texel.map(|count| count.max(0) as f64))
                .collect();
            put(map, |texel| positive[texel], false);
        }
    }
}

/// Densities in a cell, in means of the map: luminance of each half as if it were all the light, and the channels.
type Raw = [f32; 5];

/// The same after the filter, channels first, and the squared bias.
type Kept = [f32; 6];

struct Details {
    cells: Cells,
    raw: Values<5>,
    /// Luminance [W/m²].
    mean: f64,
    /// Channels may be negative, as those of pure colours are.
    is_signed: bool,
}

impl Details {
    fn new(map: &ReceiverMap, halves: [Option<&ReceiverMap>; 2], unit: FluxUnit, is_signed: bool) -> Self {
        let cells = Cells::new(&map.chart);
        let counts = map.levels()[0].texels();
        let halves = halves.map(|half| half.map(|half| half.levels()[0].texels()));
        let flux_w: f64 = counts.iter().map(|&count| unit.flux_w(count).luminance()).sum();
        let per_w = if flux_w > 0.0 {
            map.chart.area_m2() / flux_w
        } else {
            0.0
        };
        let raw = cells.densities(|texel| {
            let half = |half: Option<&[FluxCount]>| {
                half.map_or(0.0, |counts| 2.0 * unit.flux_w(counts[texel]).luminance() * per_w) as f32
            };
            let [red, green, blue] = unit
                .flux_w(counts[texel])
                .to_array()
                .map(|watts| (watts * per_w) as f32);
            [half(halves[0]), half(halves[1]), red, green, blue]
        });
        Self {
            cells,
            raw,
            mean: flux_w / map.chart.area_m2(),
            is_signed,
        }
    }

    /// Every texel: coarse cells as they are, finer ones with what is kept of their details.
    fn filtered(&self) -> Vec<Kept> {
        let coarsest = self.raw.len() - 1;
        let mut kept: Values<6> = vec![Vec::new(); self.raw.len()];
        let as_is = |&[a, b, red, green, blue]: &Raw| [red, green, blue, a, b, 0.0];
        kept[coarsest] = self.raw[coarsest].iter().map(as_is).collect();
        for level in (0..coarsest).rev() {
            kept[level] = self.refined(level, &kept);
        }
        self.cells.texels(&kept)
    }

    /// One level, of all coarser ones.
    fn refined(&self, level: usize, kept: &Values<6>) -> Vec<Kept> {
        let mut details: Vec<Raw> = self.cells.between(level, &self.raw);
        let cells = details.par_iter_mut().zip(&self.raw[level]);
        cells.for_each(|(detail, raw)| *detail = [0, 1, 2, 3, 4].map(|i| raw[i] - detail[i]));
        let mut refined = self.cells.between(level, kept);
        let noise = |[a, b, ..]: &Raw| 0.25 * (a - b) * (a - b);
        // Noise is in proportion to light where photons bring alike.
        let light = |smooth: &Kept| (0.5 * (smooth[3] + smooth[4])).max(1e-2 * DARKEST);
        let both = details
            .par_iter()
            .zip(&refined)
            .map(|(detail, smooth)| [noise(detail), light(smooth)]);
        let by_light = self.cells.pooled(level, both.collect(), PHOTONS_POOLED);
        let power = details
            .par_iter()
            .zip(&by_light)
            .map(|(detail, [noise_of_all, light])| {
                let photon = if *light > 0.0 {
                    2.0 * noise_of_all / light
                } else {
                    0.0
                };
                let product = detail[0] * detail[1];
                let chance = CHANCE_PAIRS * photon * photon;
                [
                    if product > 0.0 {
                        (product - chance).max(0.0)
                    } else {
                        product
                    },
                    noise(detail),
                ]
            });
        let power: Vec<[f32; 2]> = power.collect();
        drop(by_light);
        let pooled = self.cells.around(level, &power);
        drop(power);
        let cells = refined.par_iter_mut().zip(&details).zip(&pooled);
        cells.for_each(|((kept, detail), [signal, noise])| {
            let share = if *signal > 0.0 {
                signal / (signal + noise.max(0.0))
            } else {
                0.0
            };
            let missed = (1.0 - share) * (1.0 - share) * detail[0] * detail[1];
            let [red, green, blue] = self.lit(kept, detail, share);
            let [.., a, b, missed_before] = *kept;
            let [a, b] = [a + share * detail[0], b + share * detail[1]];
            *kept = [red, green, blue, a, b, missed_before + missed];
        });
        refined
    }

    /// The channels of a cell with a share of its detail, less where nothing would be left of its light.
    fn lit(&self, smooth: &Kept, detail: &Raw, share: f32) -> [f32; 3] {
        let with = |share: f32| [0, 1, 2].map(|channel| smooth[channel] + share * detail[2 + channel]);
        if !self.is_signed {
            return with(share).map(|value| value.max(0.0));
        }
        let [before, after] = [0.0, share].map(|share| luminance(&with(share)) as f32);
        let least = LEAST_LEFT * before.max(0.0);
        if after >= least.min(before) {
            return with(share);
        }
        with(share * (before - least).max(0.0) / (before - after))
    }

    /// The squared error of each texel [W²/m⁴]: what was missed and what is left of the noise, among the texels around it as
    /// their light is.
    fn squares(&self, of_texels: &[Kept], map: &ReceiverMap) -> Vec<f64> {
        let expected = |[.., a, b, _]: &Kept| (0.5 * (a + b)).max(DARKEST).powf(ERROR_BY_LIGHT);
        let square = |[.., a, b, missed]: &Kept| missed + 0.25 * (a - b) * (a - b);
        let mut ratios = self.cells.densities(|texel| {
            let area_m2 = map.chart.texel_area_m2(texel) as f32;
            [
                square(&of_texels[texel]) * area_m2,
                expected(&of_texels[texel]) * area_m2,
            ]
        });
        let pool = self.cells.pool();
        for level in (0..pool).rev() {
            ratios[level] = self.cells.between(level, &ratios);
        }
        let ratios = self.cells.texels(&ratios);
        let squares = of_texels
            .iter()
            .zip(&ratios)
            .map(|(kept, [square, expected_there])| {
                let ratio = if *expected_there > 0.0 {
                    (square / expected_there).max(0.0)
                } else {
                    0.0
                };
                f64::from(ratio * expected(kept)) * self.mean * self.mean
            });
        squares.collect()
    }

    /// Puts what was kept in the place of a map's counts.
    fn put(&self, of_texels: &[Kept], map: &mut ReceiverMap, unit: FluxUnit) {
        let counts_per_mean = self.mean / unit.watts();
        let chart = map.chart.clone();
        let flux = |texel: usize| {
            let counts = chart.texel_area_m2(texel) * counts_per_mean;
            [0, 1, 2].map(|channel| f64::from(of_texels[texel][channel]) * counts)
        };
        put(map, flux, self.is_signed);
    }
}

/// Puts other counts in the place of a map's; each channel keeps its sum. What is missing is shared out as the channel is, or
/// as luminance is where channels may be negative: that stays above 0.
fn put(map: &mut ReceiverMap, flux: impl Fn(usize) -> [f64; 3], is_signed: bool) {
    let texels = map.texels_mut();
    for channel in 0..3 {
        let share = |flux: &[f64; 3]| match is_signed {
            true => LinearSrgb::from(*flux).luminance(),
            false => flux[channel],
        };
        let before: f64 = texels.iter().map(|count| count[channel] as f64).sum();
        let (mut after, mut size) = (0.0, 0.0);
        for flux in (0..texels.len()).map(&flux) {
            after += flux[channel];
            size += share(&flux);
        }
        let missing = if size > 0.0 { (before - after) / size } else { 0.0 };
        // Roundings add up to nothing.
        let mut left = 0.0;
        for (texel, count) in texels.iter_mut().enumerate() {
            let flux = flux(texel);
            let wanted = flux[channel] + share(&flux) * missing + left;
            count[channel] = wanted.round() as i64;
            left = wanted - count[channel] as f64;
        }
    }
}
