//! Noise of photons on maps in tiles: a tile becomes what a coarse picture of the whole map, filtered, says of it, where
//! that lowers its error.
//!
//! Tiles are too small for wide windows, and windows must not end at their borders. What is left of a tile's photons is
//! judged as in [`filter`](super::filter): by the bias that two halves show, against noise that is in proportion to light.

use glam::DVec2;
use rayon::prelude::*;

use super::filter::{Filter, box_sums, put};
use crate::illumination::accumulator::{FluxCount, FluxUnit};
use crate::illumination::lookup::bilinear;
use crate::illumination::tiles::{Tile, TileLayout};
use crate::light_pass::receiver_maps::ReceiverMap;
use crate::optics::LinearSrgb;

/// Longer side of the coarse picture, at most [texels].
const MOST_ACROSS: usize = 256;

/// Noise is learnt of texels of the coarse picture this far around [texels].
const POOL: usize = 32;

/// Filters tiles of a map that holds the light of both halves; its squared errors [W²/m⁴], by texel, become theirs.
pub(super) fn filter_tiles(
    map: &mut ReceiverMap,
    layout: &TileLayout,
    halves: [Option<&ReceiverMap>; 2],
    unit: FluxUnit,
    squares: &mut [f64],
) {
    let picture = Picture::new(map, layout, halves, unit);
    let counts = map.levels()[0].texels();
    let tiles: Vec<(Tile, Smooth)> = layout
        .tiles()
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|tile| {
            let own = picture.of_own(&tile, &counts[tile.texels.clone()]);
            let smooth = picture.smooth(&tile, &own).unwrap_or(own);
            (tile, smooth)
        })
        .collect();
    for (tile, smooth) in &tiles {
        squares[tile.texels.clone()].copy_from_slice(&smooth.squares);
    }
    let flux: Vec<[f64; 3]> = tiles.into_iter().flat_map(|(_, smooth)| smooth.flux).collect();
    put(map, &flux);
}

/// What a tile becomes.
struct Smooth {
    /// Counts, by texel.
    flux: Vec<[f64; 3]>,
    /// Squared errors [W²/m⁴].
    squares: Vec<f64>,
}

/// The whole map, coarse and filtered.
struct Picture {
    size: (usize, usize),
    /// Texels of the finest size across one of its own.
    side: usize,
    /// Counts per area [1/m²].
    channels: Vec<[f32; 3]>,
    /// Luminance of E by each half [W/m²], and noise of the map by light: squared difference of halves over E [W/m²].
    known: Vec<[f32; 3]>,
    /// Of the map's texels: luminance of E by each half [W/m²].
    raw: [Vec<f64>; 2],
    areas_m2: Vec<f64>,
}

impl Picture {
    fn new(
        map: &ReceiverMap,
        layout: &TileLayout,
        halves: [Option<&ReceiverMap>; 2],
        unit: FluxUnit,
    ) -> Self {
        let (width, height) = layout.size();
        let side = width.max(height).div_ceil(MOST_ACROSS).next_power_of_two();
        let size = (width.div_ceil(side), height.div_ceil(side));
        let texels = map.chart.texel_count();
        let areas_m2: Vec<f64> = (0..texels).map(|texel| map.chart.texel_area_m2(texel)).collect();
        let raw = halves.map(|half| match half {
            Some(half) => {
                let flux = half.levels()[0].texels().iter().zip(&areas_m2);
                flux.map(|(&count, area_m2)| 2.0 * unit.flux_w(count).luminance() / area_m2)
                    .collect()
            }
            None => vec![0.0; texels],
        });
        let gather = |value: &dyn Fn(usize) -> f64| coarse(layout, (size, side), value);
        let areas = gather(&|texel| areas_m2[texel]);
        let fluxes = raw
            .each_ref()
            .map(|e| gather(&|texel| e[texel] * areas_m2[texel]));
        let filter = Filter::of(size, areas.clone(), fluxes.clone());
        let (widths, _) = filter.choose();
        let [a, b] = fluxes.each_ref().map(|flux| filter.smoothed(flux, &widths));
        let [noise, light] = {
            let difference = gather(&|texel| 0.5 * (raw[0][texel] - raw[1][texel]).powi(2) * areas_m2[texel]);
            let light = gather(&|texel| 0.5 * (raw[0][texel] + raw[1][texel]) * areas_m2[texel]);
            [difference, light].map(|values| box_sums(&values, size, POOL))
        };
        let per_area = |value: f64, texel: usize| {
            if areas[texel] > 0.0 {
                (value / areas[texel]) as f32
            } else {
                0.0
            }
        };
        let ratio = |texel: usize| {
            if light[texel] > 0.0 {
                (noise[texel] / light[texel]) as f32
            } else {
                0.0
            }
        };
        let known = (0..areas.len())
            .map(|texel| [per_area(a[texel], texel), per_area(b[texel], texel), ratio(texel)]);
        let counts = map.levels()[0].texels();
        let channels = [0, 1, 2].map(|channel| {
            let flux = gather(&|texel| counts[texel][channel] as f64);
            filter.smoothed(&flux, &widths)
        });
        Self {
            size,
            side,
            known: known.collect(),
            channels: (0..areas.len())
                .map(|texel| [0, 1, 2].map(|channel: usize| per_area(channels[channel][texel], texel)))
                .collect(),
            raw,
            areas_m2,
        }
    }

    fn at(&self, values: &[[f32; 3]], place: DVec2) -> LinearSrgb {
        let uv = place / (DVec2::new(self.size.0 as f64, self.size.1 as f64) * self.side as f64);
        bilinear(values, self.size.0, self.size.1, uv)
    }

    /// A tile filtered by itself.
    fn of_own(&self, tile: &Tile, counts: &[FluxCount]) -> Smooth {
        let own = tile.texels.clone();
        if counts.iter().all(|count| *count == [0; 3]) {
            return Smooth {
                flux: vec![[0.0; 3]; own.len()],
                squares: vec![0.0; own.len()],
            };
        }
        let areas_m2 = &self.areas_m2[own.clone()];
        let flux = |e: &Vec<f64>| {
            e[own.clone()]
                .iter()
                .zip(areas_m2)
                .map(|(e, m2)| e * m2)
                .collect()
        };
        let filter = Filter::of(tile.size, areas_m2.to_vec(), self.raw.each_ref().map(flux));
        let (widths, squares) = filter.choose();
        let channels = [0, 1, 2].map(|channel| {
            let flux: Vec<f64> = counts.iter().map(|count| count[channel] as f64).collect();
            filter.smoothed(&flux, &widths)
        });
        Smooth {
            flux: (0..own.len())
                .map(|texel| channels.each_ref().map(|flux| flux[texel]))
                .collect(),
            squares,
        }
    }

    /// What the picture makes of a tile; `None` where the tile by itself is better.
    fn smooth(&self, tile: &Tile, own: &Smooth) -> Option<Smooth> {
        let step = f64::from(1_u32 << tile.level);
        let origin = DVec2::new(tile.origin.0 as f64, tile.origin.1 as f64);
        let place = |texel: usize| {
            let within = DVec2::new((texel % tile.size.0) as f64, (texel / tile.size.0) as f64);
            origin + (within + 0.5) * step
        };
        let (mut bias, mut variance, mut noise, mut area_m2) = (0.0, 0.0, 0.0, 0.0);
        let half_square = |a: f64, b: f64| 0.5 * (a - b) * (a - b);
        for texel in tile.texels.clone() {
            let known = self.at(&self.known, place(texel - tile.texels.start));
            let (a, b) = (self.raw[0][texel], self.raw[1][texel]);
            let own_m2 = self.areas_m2[texel];
            variance += half_square(known.r, known.g) * own_m2;
            bias += (half_square(known.r, b) + half_square(known.g, a)
                - half_square(a, b)
                - half_square(known.r, known.g))
                * own_m2;
            noise += known.b * 0.5 * (known.r + known.g) * own_m2;
            area_m2 += own_m2;
        }
        let square = bias.max(0.0) + 0.5 * variance;
        // Filtered, a tile has less noise than its photons, but not where it has next to none of them.
        let shares = tile.texels.clone().zip(&own.squares);
        let own_square: f64 = shares.map(|(texel, square)| square * self.areas_m2[texel]).sum();
        let is_known = tile.texels.len() > 1 && own_square > 0.0;
        let least = if is_known { own_square } else { 0.5 * noise };
        if area_m2 <= 0.0 || square > least {
            return None;
        }
        let flux = tile.texels.clone().map(|texel| {
            let density = self.at(&self.channels, place(texel - tile.texels.start));
            density.to_array().map(|density| density * self.areas_m2[texel])
        });
        Some(Smooth {
            flux: flux.collect(),
            squares: vec![square / area_m2; tile.texels.len()],
        })
    }
}

/// Sums of a value of a map's texels over those of a coarse picture, whose texels are `side` of the finest long.
fn coarse(
    layout: &TileLayout,
    ((width, height), side): ((usize, usize), usize),
    value: &dyn Fn(usize) -> f64,
) -> Vec<f64> {
    let mut sums = vec![0.0; width * height];
    for tile in layout.tiles() {
        let own = 1_usize << tile.level;
        // A texel that covers several is shared out among them.
        let pieces = own.div_ceil(side);
        let share = 1.0 / (pieces * pieces) as f64;
        for texel in tile.texels.clone() {
            let index = texel - tile.texels.start;
            let column = (tile.origin.0 + index % tile.size.0 * own) / side;
            let row = (tile.origin.1 + index / tile.size.0 * own) / side;
            let value = value(texel) * share;
            for piece in 0..pieces * pieces {
                sums[(row + piece / pieces) * width + column + piece % pieces] += value;
            }
        }
    }
    sums
}
