//! Filters the noise of photons where the light is smooth.
//!
//! A map is decomposed into a coarse picture and details: on each level, the differences between cells and the
//! interpolation of coarser ones. Over two independent halves A and B, details have the mean product S = ⟨d_A d_B⟩, to
//! which noise adds nothing, and the noise N = ⟨(d_A − d_B)²⟩/4. A detail is scaled by S/(S + N), as by a Wiener filter
//! (Wiener 1949). The error is the part of S that is dropped and the part of N that is left. S and N are averaged over
//! the cells around: a cell that judged itself would keep whatever happens to agree in both halves, and its error would
//! be underestimated. Noise is inversely proportional to the surface in a cell, which at the edge of an island may be a
//! sliver: it is averaged as noise times area, and cells are weighted by the square of their area.

use rayon::prelude::*;

use super::cells::{Cells, Values};
use crate::illumination::Receiver;
use crate::illumination::accumulator::{FluxCount, FluxUnit};
use crate::light_pass::accuracy::Noise;
use crate::light_pass::receiver_maps::{ReceiverMap, ReceiverMaps};
use crate::optics::{LinearSrgb, luminance};

/// The noise per photon is averaged over cells this many levels coarser.
const PHOTONS_POOLED: usize = 5;

/// Products of details up to that of this many pairs of photons are attributed to chance: two photons in one texel.
const CHANCE_PAIRS: f32 = 2.0;

/// Among neighbouring texels, error is taken as proportional to this power of irradiance.
const ERROR_BY_LIGHT: f32 = 1.5;

/// Minimum fraction of a cell's luminance that its details leave, where channels may be negative.
const MIN_LEFT: f32 = 1e-5;

/// Cells of this level that no photon reached are dark if less than [`DARK`] of the map's mean is left there: their
/// light is a remainder of what coarser cells have. It lies below what exposure shows, but would lower the exposure.
const DARK_LEVEL: usize = 3;
const DARK: f32 = 1.0 / 256.0;

/// Floor of irradiance relative to the map's mean.
const DARKEST: f32 = 1e-4;

/// Maps of no more texels are filtered side by side, each taking some 150 bytes per texel; larger ones one after the
/// other, by all threads.
const SMALL_TEXELS: usize = 1 << 18;

/// Filters the photons of two halves, which a map holds together with twice the `bundles`, and returns the remaining
/// squared error of each texel [W²/m⁴]. `is_signed`: channels may be negative. Adds counts that a map could not take to
/// `left`.
pub fn filter(
    sum: &mut ReceiverMaps,
    halves: [&ReceiverMaps; 2],
    bundles: Option<&ReceiverMaps>,
    (unit, is_signed): (FluxUnit, bool),
    left: &mut Sums,
) -> Noise {
    let of_map = |(receiver, map): (Receiver, &mut ReceiverMap)| {
        let layers = [
            halves[0].get(receiver),
            halves[1].get(receiver),
            bundles.and_then(|maps| maps.get(receiver)),
        ];
        let details = Details::new(map, layers, unit, is_signed);
        let bundled = details.cells.texels(&details.bundled);
        let kept = details.filtered(&bundled);
        let squares = details.squares(&kept, &bundled, map);
        ((receiver, squares), details.put(&kept, &bundled, map, unit))
    };
    let is_small = |(_, map): &(Receiver, &mut ReceiverMap)| map.chart.texel_count() <= SMALL_TEXELS;
    let (small, large): (Vec<_>, Vec<_>) = sum.iter_mut().partition(is_small);
    let mut filtered: Vec<_> = small.into_par_iter().map(of_map).collect();
    filtered.extend(large.into_iter().map(of_map));
    let (noise, more): (Noise, Vec<Sums>) = filtered.into_iter().unzip();
    more.into_iter().for_each(|more| add(left, more));
    noise
}

/// Counts summed over many texels.
pub type Sums = [i128; 3];

fn add(sums: &mut Sums, more: Sums) {
    for (sum, more) in sums.iter_mut().zip(more) {
        *sum += more;
    }
}

/// Removes negative light, which the noise of bundles leaves in dark places, at the expense of all other texels. Adds
/// counts that a map could not absorb to `left`.
pub fn without_negative(maps: &mut ReceiverMaps, is_signed: bool, left: &mut Sums) {
    for (_, map) in maps.iter_mut() {
        let counts = map.levels()[0].texels();
        if counts.iter().any(|&count| lit(count, is_signed) != count) {
            let counts = counts.to_vec();
            let flux = |texel: usize| lit(counts[texel], is_signed).map(|count| count as f64);
            add(left, put(map, flux, flux, is_signed));
        }
    }
}

/// A texel's counts without negative light: without negative channels or, if these are allowed, without negative
/// luminance.
fn lit(count: FluxCount, is_signed: bool) -> FluxCount {
    if !is_signed {
        return count.map(|count| count.max(0));
    }
    let luminance = LinearSrgb::from(count.map(|count| count as f64)).luminance();
    if luminance < 0.0 { [0; 3] } else { count }
}

/// Densities in a cell, relative to the map's mean: the channels of each half, as if it were all the light.
type Raw = [f32; 6];

/// A filtered cell: its channels, the luminance of each half, the squared bias.
type FilteredCell = [f32; 6];

/// A filtered cell with the light of bundles.
fn with_bundles(filtered: &FilteredCell, bundled: &[f32; 3]) -> FilteredCell {
    let [red, green, blue, a, b, missed] = *filtered;
    let bundled_luminance = luminance(bundled) as f32;
    [
        red + bundled[0],
        green + bundled[1],
        blue + bundled[2],
        a + bundled_luminance,
        b + bundled_luminance,
        missed,
    ]
}

/// Luminance of each half.
fn luminances(raw: &Raw) -> [f32; 2] {
    let [r, g, b, r2, g2, b2] = *raw;
    [luminance(&[r, g, b]) as f32, luminance(&[r2, g2, b2]) as f32]
}

/// Channels of both halves.
fn channels(raw: &Raw) -> [f32; 3] {
    [0, 1, 2].map(|channel| 0.5 * (raw[channel] + raw[3 + channel]))
}

/// Deviation of each half's details from grey ones, which have the colour of the smooth light around. Photons of single
/// wavelengths make it far noisier than luminance.
fn tints(detail: &Raw, smooth: &FilteredCell) -> [[f32; 3]; 2] {
    let light = luminance(&[smooth[0], smooth[1], smooth[2]]) as f32;
    let [a, b] = luminances(detail);
    let tint = |luminance: f32, first: usize| {
        [0, 1, 2].map(|channel| {
            let colour = if light > 0.0 { smooth[channel] / light } else { 1.0 };
            detail[first + channel] - luminance * colour
        })
    };
    [tint(a, 0), tint(b, 3)]
}

struct Details {
    cells: Cells,
    /// Light of photons.
    raw: Values<6>,
    /// Channels of light that bundles carry, which has no noise.
    bundled: Values<3>,
    /// Mean luminance of the map [W/m²].
    mean: f64,
    /// Channels may be negative, as those of pure colours are.
    is_signed: bool,
}

impl Details {
    /// Layers: photons of both halves, and bundles.
    fn new(map: &ReceiverMap, layers: [Option<&ReceiverMap>; 3], unit: FluxUnit, is_signed: bool) -> Self {
        let cells = Cells::new(&map.chart);
        let counts = map.levels()[0].texels();
        let layers = layers.map(|layer| layer.map(|layer| layer.levels()[0].texels()));
        let flux_w: f64 = counts.iter().map(|&count| unit.flux_w(count).luminance()).sum();
        let per_w = if flux_w > 0.0 {
            map.chart.area_m2() / flux_w
        } else {
            0.0
        };
        let relative = |layer: usize, texel: usize| {
            layers[layer].map_or([0.0; 3], |counts| {
                let flux_w = unit.flux_w(counts[texel]).to_array();
                flux_w.map(|watts| (2.0 * watts * per_w) as f32)
            })
        };
        let raw = cells.densities(|texel| {
            let [first, second] = [0, 1].map(|half| relative(half, texel));
            [first[0], first[1], first[2], second[0], second[1], second[2]]
        });
        let bundled = cells.densities(|texel| relative(2, texel));
        Self {
            cells,
            raw,
            bundled,
            mean: flux_w / map.chart.area_m2(),
            is_signed,
        }
    }

    /// All texels: the coarsest cells as they are, plus the filtered details of each finer level, and what is
    /// `bundled`.
    fn filtered(&self, bundled: &[[f32; 3]]) -> Vec<FilteredCell> {
        let coarsest = self.raw.len() - 1;
        let mut kept: Values<6> = vec![Vec::new(); self.raw.len()];
        let as_is = |raw: &Raw| {
            let ([a, b], [red, green, blue]) = (luminances(raw), channels(raw));
            [red, green, blue, a, b, 0.0]
        };
        kept[coarsest] = self.raw[coarsest].iter().map(as_is).collect();
        for level in (0..coarsest).rev() {
            kept[level] = self.refined(level, &kept);
        }
        let mut texels = self.cells.texels(&kept);
        let is_reached = |level: usize, cell: usize| {
            let layers = self.raw[level][cell].iter().chain(&self.bundled[level][cell]);
            layers.copied().any(|channel| channel != 0.0)
        };
        let reached = self.cells.inherited(DARK_LEVEL.min(coarsest), is_reached);
        let layers = texels.par_iter_mut().zip(reached).zip(bundled);
        layers.for_each(|((texel, is_reached), bundled)| {
            *texel = with_bundles(texel, bundled);
            let [.., a, b, _] = *texel;
            if !is_reached && 0.5 * (a + b) < DARK {
                *texel = [0.0; 6];
            }
        });
        texels
    }

    /// The filtered cells of a level, given those of all coarser levels.
    fn refined(&self, level: usize, kept: &Values<6>) -> Vec<FilteredCell> {
        // Details are what this level adds to the interpolation of the coarser one, in each half.
        let mut details: Vec<Raw> = self.cells.between(level, &self.raw);
        let cells = details.par_iter_mut().zip(&self.raw[level]);
        cells.for_each(|(detail, raw)| *detail = [0, 1, 2, 3, 4, 5].map(|i| raw[i] - detail[i]));

        // Filtered details are added to the filtered light of the coarser levels. Noise and tint are judged by all
        // light that is seen: bundles have no noise, but belong to it.
        let mut refined = self.cells.between(level, kept);
        let whole: Vec<FilteredCell> = refined
            .par_iter()
            .zip(&self.bundled[level])
            .map(|(filtered, bundled)| with_bundles(filtered, bundled))
            .collect();

        // Slivers at the edge of an island are noisier in inverse proportion to their area, and say less about others.
        let above = self.cells.areas_above(level, PHOTONS_POOLED);
        let areas = self.cells.relative_areas(level, &above);
        let power = self.power(level, [&details, &whole], (&areas, &above));

        // The mean over the surroundings leaves the cell itself out: it would keep whatever agrees in both halves by
        // chance.
        let pooled = self.cells.around(level, &power, (&areas, &above));
        drop(power);

        // Wiener's share of each detail is added to the light of the coarser levels. What is dropped of a detail that
        // both halves have is bias.
        let cells = refined
            .par_iter_mut()
            .zip(&whole)
            .zip(&details)
            .zip(&pooled)
            .zip(&areas);
        cells.for_each(
            |((((kept, whole), detail), [signal, noise, tint_signal, tint_noise]), area)| {
                let part = |signal: f32, noise: f32| {
                    if signal > 0.0 && *area > 0.0 {
                        signal / (signal + noise.max(0.0) / area)
                    } else {
                        0.0
                    }
                };
                let share = part(*signal, *noise);
                let [first, second] = luminances(detail);
                let missed = (1.0 - share) * (1.0 - share) * first * second;
                let lit = self.channels_of(whole, detail, [share, part(*tint_signal, *tint_noise)]);
                for channel in 0..3 {
                    kept[channel] += lit[channel] - whole[channel];
                }
                kept[3] += share * first;
                kept[4] += share * second;
                kept[5] += missed;
            },
        );
        refined
    }

    /// Signal and noise of luminance and of tint in the details of each cell of a level, given all light of the coarser
    /// levels there.
    fn power(
        &self,
        level: usize,
        [details, whole]: [&[[f32; 6]]; 2],
        (areas, above): (&[f32], &[Vec<[f32; 1]>]),
    ) -> Vec<[f32; 4]> {
        let noise = |detail: &Raw| {
            let [a, b] = luminances(detail);
            0.25 * (a - b) * (a - b)
        };
        // Noise is proportional to light where photons carry equal flux.
        let light = |smooth: &FilteredCell| (0.5 * (smooth[3] + smooth[4])).max(1e-2 * DARKEST);

        // Photons of luminance p make halves of light L differ by a variance of 2pL: the ratio of noise to light tells
        // p. It is averaged over a wide region, since a cell with few photons cannot tell.
        let cells = details.par_iter().zip(whole).zip(areas);
        let both = cells
            .clone()
            .map(|((detail, smooth), area)| [noise(detail) * area, light(smooth)]);
        let by_light = self.cells.pooled(level, both.collect(), above);

        // A few photons that fall into one cell in both halves by chance would pass for signal.
        let power = cells
            .zip(&by_light)
            .map(|(((detail, smooth), area), [noise_of_all, light])| {
                let photon = if *light > 0.0 && *area > 0.0 {
                    2.0 * noise_of_all / (light * area)
                } else {
                    0.0
                };
                let [a, b] = luminances(detail);
                let product = a * b;
                let [first, second] = tints(detail, smooth);
                let chance = CHANCE_PAIRS * photon * photon;
                let signal = if product > 0.0 {
                    (product - chance).max(0.0)
                } else {
                    product
                };
                [
                    signal * area,
                    noise(detail) * area * area,
                    (0..3).map(|i| first[i] * second[i]).sum::<f32>() * area,
                    (0..3).map(|i| 0.25 * (first[i] - second[i]).powi(2)).sum::<f32>() * area * area,
                ]
            });
        power.collect()
    }

    /// Channels of a cell with one share of its detail's luminance and another of its tint, both reduced where too
    /// little light would be left.
    fn channels_of(&self, smooth: &FilteredCell, detail: &Raw, [share, of_tint]: [f32; 2]) -> [f32; 3] {
        let [first, second] = tints(detail, smooth);
        let tint = [0, 1, 2].map(|channel| 0.5 * (first[channel] + second[channel]));
        let whole = channels(detail);
        let detail =
            [0, 1, 2].map(|channel| share * (whole[channel] - tint[channel]) + of_tint * tint[channel]);
        let with = |part: f32| [0, 1, 2].map(|channel| smooth[channel] + part * detail[channel]);
        if !self.is_signed {
            return with(1.0).map(|value| value.max(0.0));
        }
        let [before, after] = [0.0, 1.0].map(|part| luminance(&with(part)) as f32);
        let least = MIN_LEFT * before.max(0.0);
        let lit = if after >= least {
            with(1.0)
        } else {
            with(((before - least) / (before - after)).clamp(0.0, 1.0))
        };
        // Luminance that rounds below 0 becomes grey.
        if luminance(&lit) < 0.0 { [least; 3] } else { lit }
    }

    /// The squared error of each texel [W²/m⁴], bias and remaining noise: averaged over the texels around, weighted by
    /// the square of their area, and distributed among them by their irradiance.
    fn squares(&self, of_texels: &[FilteredCell], bundled: &[[f32; 3]], map: &ReceiverMap) -> Vec<f64> {
        // Errors are averaged relative to a power of irradiance; slivers count by the square of their area.
        let expected = |[.., a, b, _]: &FilteredCell| (0.5 * (a + b)).max(DARKEST).powf(ERROR_BY_LIGHT);
        let shares = self.cells.shares();
        let area_of = |texel: usize| shares[texel] * map.chart.texel_area_m2(texel) as f32;

        // What the filter took from both halves alike is its bias, of whatever levels it is made. Levels by themselves
        // tell of less, as those details are dropped that happen to disagree.
        let raw = self.cells.texels(&self.raw);
        let untold = |texel: usize| {
            let [.., a, b, missed] = of_texels[texel];
            let [first, second] = luminances(&raw[texel]);
            let bundled = luminance(&bundled[texel]) as f32;
            (a - bundled - first) * (b - bundled - second) - missed
        };

        // Squared bias plus the variance of the mean of both halves, beside the error that the light there lets expect.
        let mut ratios = self.cells.densities(|texel| {
            let kept = &of_texels[texel];
            let [.., a, b, missed] = *kept;
            let square = missed + 0.25 * (a - b) * (a - b);
            [square, expected(kept), untold(texel)].map(|value| value * area_of(texel))
        });

        // Single cells hardly know their error: it is averaged over coarse ones, and interpolated back.
        let pool = self.cells.pool();
        add_untold(&mut ratios[pool], self.cells.areas_m2(pool));
        for level in (0..pool).rev() {
            ratios[level] = self.cells.between(level, &ratios);
        }
        let ratios = self.cells.texels(&ratios);
        let squares = of_texels
            .par_iter()
            .zip(&ratios)
            .map(|(kept, [square, expected_there, _])| {
                let ratio = if *expected_there > 0.0 {
                    (square / expected_there).max(0.0)
                } else {
                    0.0
                };
                f64::from(ratio * expected(kept)) * self.mean * self.mean
            });
        squares.collect()
    }

    /// Replaces a map's counts by the filtered light.
    fn put(
        &self,
        of_texels: &[FilteredCell],
        bundled: &[[f32; 3]],
        map: &mut ReceiverMap,
        unit: FluxUnit,
    ) -> Sums {
        let counts_per_mean = self.mean / unit.watts();
        let chart = map.chart.clone();
        let counts =
            |texel: usize, relative: f32| f64::from(relative) * chart.texel_area_m2(texel) * counts_per_mean;
        let flux = |texel: usize| [0, 1, 2].map(|channel| counts(texel, of_texels[texel][channel]));
        // Bundles have no noise: photons alone take what is missing.
        let of_photons = |texel: usize| {
            [0, 1, 2].map(|channel| counts(texel, of_texels[texel][channel] - bundled[texel][channel]).abs())
        };
        put(map, flux, of_photons, self.is_signed)
    }
}

/// Adds the bias that levels do not tell of to the squared errors of cells. Over the whole map,
/// noise cancels from its products; they tell where it lies as far as they are positive.
fn add_untold(cells: &mut [[f32; 3]], areas_m2: &[f32]) {
    let (mut sum, mut positive) = (0.0, 0.0);
    for ([_, _, untold], area_m2) in cells.iter().zip(areas_m2) {
        sum += f64::from(untold * area_m2);
        positive += f64::from(untold.max(0.0) * area_m2);
    }
    if sum > 0.0 {
        for [square, _, untold] in cells {
            *square += (sum / positive) as f32 * untold.max(0.0);
        }
    }
}

/// Replaces a map's counts; each channel keeps its sum. The difference is distributed in proportion to the flux of
/// `takers` in the channel, or to its luminance where channels may be negative: luminance stays above 0. Returns what
/// no texel could take.
fn put(
    map: &mut ReceiverMap,
    flux: impl Fn(usize) -> [f64; 3] + Sync,
    takers: impl Fn(usize) -> [f64; 3] + Sync,
    is_signed: bool,
) -> Sums {
    // Flux only moves from texel to texel: sums of counts are exact, but for what no texel can take.
    let texels = map.texels_mut();
    let sums = |texels: &[FluxCount]| {
        let counts = texels.par_iter().map(|count| count.map(i128::from));
        counts.reduce(|| [0; 3], |a, b| [0, 1, 2].map(|channel| a[channel] + b[channel]))
    };
    let share = |texel: usize| match is_signed {
        true => [LinearSrgb::from(takers(texel)).luminance(); 3],
        false => takers(texel),
    };

    // Floating-point sums are taken in the order of the texels, so that the number of threads changes nothing.
    let before = sums(texels);
    let (mut after, mut size) = ([0.0; 3], [0.0; 3]);
    for texel in 0..texels.len() {
        let (flux, share) = (flux(texel), share(texel));
        for channel in 0..3 {
            after[channel] += flux[channel];
            size[channel] += share[channel];
        }
    }

    // Each taker gets the same fraction of its flux more or less.
    let missing = [0, 1, 2].map(|channel| match size[channel] > 0.0 {
        true => (before[channel] as f64 - after[channel]) / size[channel],
        false => 0.0,
    });

    // Light that becomes negative is cut off, which adds to the rounding error of the sums.
    texels.par_iter_mut().enumerate().for_each(|(texel, count)| {
        let (flux, share) = (flux(texel), share(texel));
        let wanted = [0, 1, 2].map(|channel| flux[channel] + share[channel] * missing[channel]);
        *count = lit(wanted.map(|wanted| wanted.round() as i64), is_signed);
    });
    // The brightest texel takes the rounding error.
    let rounded = sums(texels);
    let left = [0, 1, 2].map(|channel| before[channel] - rounded[channel]);
    let brightness = |count: &&mut FluxCount| count.iter().map(|&count| i128::from(count)).sum::<i128>();
    if let Some(brightest) = texels.iter_mut().max_by_key(brightness) {
        let with = [0, 1, 2].map(|channel| brightest[channel] + left[channel] as i64);
        if lit(with, is_signed) == with {
            *brightest = with;
            return [0; 3];
        }
    }
    left
}
