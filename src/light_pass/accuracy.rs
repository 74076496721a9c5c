//! Error estimates without a reference, from half sets of photons or rays.
//!
//! Two half sets differ by their noise. What both miss alike is added where it is known: the blur of splats, from a map of
//! fewer rays, and truncated light (threshold, depth, unresolved), by its watts.

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use super::ledger::EnergyLedger;
use super::receiver_maps::{ReceiverMap, ReceiverMaps};
use crate::illumination::accumulator::FluxUnit;
use crate::illumination::{Chart, Receiver};

/// Error of splats of every fourth ray relative to those of all: first order.
const RATIO_OF_THINNED: f64 = 2.0;

/// Squared errors of texels are averaged up to this many texels away.
const WINDOW_TEXELS: usize = 2;

/// Irradiance of one map, for error estimates.
#[derive(Clone, Debug)]
pub struct Image {
    pub chart: Arc<Chart>,
    /// Luminance of E per texel [W/m², for a light of unit strength].
    pub luminance: Vec<f64>,
}

/// Images of one level, by receiver.
pub type Images = BTreeMap<Receiver, Image>;

/// Error estimate of all maps of one light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightError {
    /// Expected error of each texel's luminance, the root of variance and squared bias [W/m², for a light of unit
    /// strength].
    pub maps: BTreeMap<Receiver, Vec<f32>>,
    /// Root mean square error over all texels, weighted by area, relative to the mean irradiance.
    pub relative_rmse: f64,
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
            map.iter_mut().for_each(raise);
        }
    }

    /// Adds errors whose squares are proportional to the light, as those of single photons, up to a larger relative
    /// squared error.
    pub fn add_to(&mut self, relative_square: f64, light: &Images) {
        let added = relative_square - self.relative_rmse * self.relative_rmse;
        let (flux_w, area_m2) = light.values().fold((0.0, 0.0), |(flux_w, area_m2), image| {
            let (map_w, map_m2) = image.sums();
            (flux_w + map_w, area_m2 + map_m2)
        });
        if !(added > 0.0 && flux_w > 0.0) {
            return;
        }
        self.relative_rmse = relative_square.sqrt();
        let per_light = added * flux_w / area_m2;
        for (receiver, map) in &mut self.maps {
            let Some(image) = light.get(receiver) else {
                continue;
            };
            for (error, value) in map.iter_mut().zip(&image.luminance) {
                *error = single((f64::from(*error).powi(2) + per_light * value.max(0.0)).sqrt());
            }
        }
    }
}

/// Converts to the precision of an error, which may not become infinite.
fn single(error: f64) -> f32 {
    error.min(f64::from(f32::MAX)) as f32
}

pub fn images(maps: &ReceiverMaps, unit: FluxUnit) -> Images {
    let image = |(receiver, map): (Receiver, &ReceiverMap)| {
        let chart = Arc::clone(&map.chart);
        let luminance = map
            .flux()
            .texels()
            .par_iter()
            .enumerate()
            .map(|(texel, &count)| chart.per_area(texel, unit.flux_w(count).luminance()))
            .collect();
        (receiver, Image { chart, luminance })
    };
    maps.iter().map(image).collect()
}

impl Image {
    /// Flux [W] and area [m²] of all texels.
    fn sums(&self) -> (f64, f64) {
        (0..self.luminance.len()).fold((0.0, 0.0), |(flux, area), texel| {
            let texel_m2 = self.chart.texel_area_m2(texel);
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

    /// The sum of these values of texels, weighted by their areas.
    fn integral(&self, values: &[f64]) -> f64 {
        let by_area = values.iter().enumerate();
        by_area
            .map(|(texel, value)| value * self.chart.texel_area_m2(texel))
            .sum()
    }

    /// Means over a square window around each texel, clipped to the map or to the texel's tile.
    fn windowed(&self, squares: &[f64]) -> Vec<f64> {
        let mut means = vec![0.0; squares.len()];
        let Some(layout) = &self.chart.layout else {
            let size = (self.chart.width, self.chart.height);
            let lines = means.par_chunks_mut(self.chart.width).enumerate();
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

/// Squared relative error of `light` to be expected from noise, where `shown` is what half sets show, perhaps after a
/// filter.
///
/// Few texels, or few photons in them, tell little: the halves of a single texel may agree by chance. So `by_photons`, the
/// squared relative error that the flux of single photons tells, counts as one more texel. And two standard deviations
/// are added, since of levels that differ by chance, one that looks good ends the bake: the squares d² of differences
/// have the variance 2v² if d is normal, and then d⁴ is 3v² in the mean.
pub fn expected_noise(shown: f64, [a, b]: [&Images; 2], light: &Images, by_photons: f64) -> f64 {
    let (mut squares, mut fourths, mut flux_w, mut area_m2) = (0.0, 0.0, 0.0, 0.0);
    for (receiver, image) in light {
        let (map_w, map_m2) = image.sums();
        (flux_w, area_m2) = (flux_w + map_w, area_m2 + map_m2);
        let differences = match (a.get(receiver), b.get(receiver)) {
            (Some(first), second) => first.squared_difference(second),
            (None, Some(second)) => second.squared_difference(None),
            (None, None) => continue,
        };
        for (texel, square) in differences.iter().enumerate() {
            let by_area = square * image.chart.texel_area_m2(texel);
            squares += by_area;
            fourths += by_area * by_area;
        }
    }
    if squares <= 0.0 || flux_w <= 0.0 {
        return shown.max(by_photons);
    }

    let of_halves = squares * area_m2 / (flux_w * flux_w);
    let texels = squares * squares / fourths;
    let with_photons = (texels * of_halves + by_photons) / ((texels + 1.0) * of_halves);
    let deviation = (2.0 / 3.0 * fourths).sqrt() / squares;
    shown * (with_photons.max(1.0) + 2.0 * deviation)
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
    let blur = 1.0 / ((RATIO_OF_THINNED - 1.0) * (RATIO_OF_THINNED - 1.0));
    let share = 0.5 * (blur + 1.0 / (1.0 + RATIO_OF_THINNED * RATIO_OF_THINNED));
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

/// The error from its square around each texel, map by map.
fn by_squares(
    fine: &Images,
    ledger: &EnergyLedger,
    mut squares: impl FnMut(Receiver, &Image) -> Option<Vec<f64>>,
) -> Option<LightError> {
    let mut error = LightError::default();
    let (mut squares_sum, mut flux_w, mut area_m2) = (0.0, 0.0, 0.0);
    for (&receiver, image) in fine {
        let squares = squares(receiver, image)?;
        squares_sum += image.integral(&squares);
        let (map_w, map_m2) = image.sums();
        (flux_w, area_m2) = (flux_w + map_w, area_m2 + map_m2);
        let map = squares.iter().map(|square| single(square.sqrt()));
        error.maps.insert(receiver, map.collect());
    }
    let mean = flux_w / area_m2;
    error.relative_rmse = (squares_sum / area_m2 / (mean * mean))
        .sqrt()
        .hypot(truncated_share(ledger));
    (flux_w > 0.0).then_some(error)
}

/// Share of the light that is missing from the maps. Light that ended by depth or threshold is assumed to divide like
/// the rest between maps, absorption and escape; all that could not be resolved, to be missing from the maps.
pub fn truncated_share(ledger: &EnergyLedger) -> f64 {
    let truncated = &ledger.truncated;
    let arrived = ledger.deposited + ledger.absorbed + ledger.escaped;
    let ended = truncated.depth + truncated.threshold;
    let lost = truncated.non_finite + truncated.unresolved;
    if ledger.deposited > 0.0 {
        ended / arrived + lost / ledger.deposited
    } else {
        0.0
    }
}
