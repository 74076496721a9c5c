//! The visible error: relative to local brightness, and in the dark to what the exposure reveals. A bright focus does
//! not dominate a room by it, and invisible errors do not count.
//!
//! Over blocks of 8×8 texels of all maps, it is √(Σ w (ΔE/n)² / Σ w). E is the luminance of all layers, C that of
//! caustic and indirect light together, and ΔE the error of C. n is E in lit blocks, √(E·white) in dark ones, and
//! white/16 in the darkest. w is the block's area times min(1, C/n), so that missing light counts in full, however
//! small its place in the room. The square root is that of Dammertz et al., "A Hierarchical Automatic Stopping
//! Condition for Monte Carlo Global Illumination" (WSCG 2010), as used for adaptive sampling in path tracers.

use super::{Chart, IlluminationMap};
use crate::optics::luminance;
use crate::settings::LayerKind;

/// Side of a block [texels].
const SIDE: usize = 8;

/// Blocks darker than this fraction of the mean do not affect the exposure.
const NIGHT: f64 = 1e-4;

/// Share of the area among the darkest and among the brightest blocks that does not affect it, either.
const TRIMMED: f64 = 0.1;

/// Fraction of white to which exposure maps the log-average luminance: the 18 % grey card.
pub const MIDDLE_GREY: f64 = 0.18;

/// Luminance, relative to white, below which errors are relative to a constant: see [`BlockLight::scale`].
const DARKEST: f64 = 1.0 / 256.0;

/// The block that contains each texel of a map.
#[derive(Clone, Debug)]
pub struct Blocks {
    of_texel: Vec<u32>,
    areas_m2: Vec<f64>,
}

impl Blocks {
    /// Blocks of a chart, or of each tile of a tiled chart.
    pub fn new(chart: &Chart) -> Self {
        let mut of_texel = Vec::with_capacity(chart.texel_count());
        let mut count = 0;
        let mut add = |(width, height): (usize, usize)| {
            let across = width.div_ceil(SIDE);
            for texel in 0..width * height {
                of_texel.push((count + texel / width / SIDE * across + texel % width / SIDE) as u32);
            }
            count += across * height.div_ceil(SIDE);
        };
        match &chart.layout {
            Some(layout) => layout.tiles().for_each(|tile| add(tile.size)),
            None => add((chart.width, chart.height)),
        }
        let mut areas_m2 = vec![0.0; count];
        for (texel, &block) in of_texel.iter().enumerate() {
            areas_m2[block as usize] += chart.texel_area_m2(texel);
        }
        Self { of_texel, areas_m2 }
    }

    pub fn count(&self) -> usize {
        self.areas_m2.len()
    }

    /// Block index of each texel.
    pub fn of_texels(&self) -> &[u32] {
        &self.of_texel
    }

    /// Area-weighted mean over each block of a value per texel; 0 if the block is uncovered.
    pub fn means(&self, chart: &Chart, value: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut sums = vec![0.0; self.count()];
        for (texel, &block) in self.of_texel.iter().enumerate() {
            sums[block as usize] += value(texel) * chart.texel_area_m2(texel);
        }
        for (sum, area_m2) in sums.iter_mut().zip(&self.areas_m2) {
            *sum = if *area_m2 > 0.0 { *sum / area_m2 } else { 0.0 };
        }
        sums
    }

    /// Each block with its light, given means per block.
    pub fn lit(&self, all: &[f64], traced: &[f64]) -> impl Iterator<Item = BlockLight> {
        let light = all.iter().zip(traced);
        let blocks = light.zip(&self.areas_m2);
        blocks.map(|((&all, &traced), &area_m2)| BlockLight { area_m2, all, traced })
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BlockLight {
    /// Surface area of the block [m²].
    pub area_m2: f64,
    /// Mean luminance of E over all layers [W/m²].
    pub all: f64,
    /// Mean luminance of caustic and indirect light [W/m²].
    pub traced: f64,
}

impl BlockLight {
    /// Luminance that errors are relative to here [W/m²].
    pub fn scale(&self, white: f64) -> f64 {
        if self.all >= white {
            self.all
        } else {
            (self.all.max(DARKEST * white) * white).sqrt()
        }
    }

    /// Weight of an error here [m²].
    pub fn weight_m2(&self, white: f64) -> f64 {
        self.area_m2 * (self.traced / self.scale(white)).clamp(0.0, 1.0)
    }
}

/// Luminance of E that exposure maps to white [W/m²], from the log-average over the area without its darkest and
/// brightest tenth, and without blocks below `NIGHT`. `None` without light.
pub fn white(blocks: impl Iterator<Item = BlockLight>) -> Option<f64> {
    let mut blocks: Vec<BlockLight> = blocks.filter(|block| block.area_m2 > 0.0).collect();
    let (sum, area_m2) = blocks.iter().fold((0.0, 0.0), |(sum, area_m2), block| {
        (sum + block.all * block.area_m2, area_m2 + block.area_m2)
    });
    let night = NIGHT * sum / area_m2;
    blocks.retain(|block| block.all > night);
    blocks.sort_by(|a, b| a.all.total_cmp(&b.all));
    let area_m2: f64 = blocks.iter().map(|block| block.area_m2).sum();
    let (low_m2, high_m2) = (TRIMMED * area_m2, (1.0 - TRIMMED) * area_m2);
    let (mut logarithms, mut counted_m2, mut before_m2) = (0.0, 0.0, 0.0);
    for block in &blocks {
        let after_m2 = before_m2 + block.area_m2;
        let part_m2 = (after_m2.min(high_m2) - f64::max(before_m2, low_m2)).max(0.0);
        logarithms += block.all.ln() * part_m2;
        counted_m2 += part_m2;
        before_m2 = after_m2;
    }
    let white = (logarithms / counted_m2).exp() / MIDDLE_GREY;
    (counted_m2 > 0.0 && white.is_finite() && white > 0.0).then_some(white)
}

/// Visible error of all maps together, and of each: that of the layers `of` beside the light of all. `truncated` is the
/// share of traced light that was truncated, which the error of the maps does not include. `None` if the error of a lit
/// map is unknown, or if these layers hold no light.
pub fn visible_error(
    maps: &[IlluminationMap],
    of: &[LayerKind],
    truncated: f64,
) -> (Option<f64>, Vec<Option<f64>>) {
    let none = || (None, vec![None; maps.len()]);

    // For each block: the light of all layers, that of the layers in question, and its mean squared error.
    let mut lit = Vec::with_capacity(maps.len());
    for map in maps {
        let traced_of_texels = map.luminance_of(of);
        if map.error.is_none() && traced_of_texels.iter().any(|e| *e > 0.0) {
            return none();
        }
        let blocks = Blocks::new(&map.chart);
        let all = map.luminance_of(&LayerKind::ALL);
        let [all, traced] =
            [&all, &traced_of_texels].map(|values| blocks.means(&map.chart, |texel| values[texel]));
        let squares = blocks.means(&map.chart, |texel| {
            let error = map.error.as_ref().map_or(0.0, |error| f64::from(error[texel]));
            error * error + (truncated * traced_of_texels[texel]).powi(2)
        });
        let light: Vec<BlockLight> = blocks.lit(&all, &traced).collect();
        lit.push((light, squares));
    }

    // One exposure for all maps, as for an eye that sees the whole scene.
    let Some(white) = white(lit.iter().flat_map(|(light, _)| light.iter().copied())) else {
        return none();
    };

    // Errors are relative to the scale of the light that they are seen in, and weigh by the part of it that these
    // layers make.
    let sums = lit.iter().map(|(light, squares)| {
        light
            .iter()
            .zip(squares)
            .fold((0.0, 0.0), |sums, (block, square)| {
                let weight_m2 = block.weight_m2(white);
                (
                    sums.0 + weight_m2 * square / block.scale(white).powi(2),
                    sums.1 + weight_m2,
                )
            })
    });
    let sums: Vec<(f64, f64)> = sums.collect();
    let root = |(squares, weight_m2): (f64, f64)| (weight_m2 > 0.0).then(|| (squares / weight_m2).sqrt());
    let all = sums
        .iter()
        .fold((0.0, 0.0), |all, one| (all.0 + one.0, all.1 + one.1));
    (root(all), sums.into_iter().map(root).collect())
}

impl IlluminationMap {
    /// Luminance of E of several layers together, per texel [W/m²].
    fn luminance_of(&self, kinds: &[LayerKind]) -> Vec<f64> {
        let mut sums = vec![0.0; self.chart.texel_count()];
        for layer in kinds.iter().filter_map(|&kind| self.layer(kind)) {
            for (sum, e) in sums.iter_mut().zip(&layer.irradiance) {
                *sum += luminance(e);
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn even(all: f64, traced: f64) -> BlockLight {
        BlockLight {
            area_m2: 2.0,
            all,
            traced,
        }
    }

    #[test]
    fn white_is_what_exposure_makes_of_an_even_light() {
        let found = white([even(0.36, 0.0); 5].into_iter()).expect("it is lit");
        assert!((found - 2.0).abs() < 1e-12, "{found}");
        assert_eq!(white([even(0.0, 0.0); 3].into_iter()), None);
        assert_eq!(white(std::iter::empty()), None);
    }

    /// A tenth of the area at either end is left out, and so are blocks in the night.
    #[test]
    fn the_ends_tell_nothing() {
        let mut blocks = vec![even(0.18, 0.0); 8];
        blocks.extend([even(0.01, 0.0), even(100.0, 0.0), even(1e-9, 0.0)]);
        let found = white(blocks.into_iter()).expect("it is lit");
        assert!((found - 1.0).abs() < 1e-12, "{found}");
    }

    #[test]
    fn errors_are_relative_to_what_the_eye_makes_out() {
        for (all, scale) in [
            (4.0, 4.0),
            (1.0, 1.0),
            (0.25, 0.5),
            (1.0 / 256.0, 1.0 / 16.0),
            (0.0, 1.0 / 16.0),
        ] {
            assert!((even(all, 0.0).scale(1.0) - scale).abs() < 1e-12, "{all}");
        }
        assert_eq!(even(0.25, 0.1).weight_m2(1.0), 0.4);
        assert_eq!(even(4.0, 8.0).weight_m2(1.0), 2.0);
    }
}
