//! The mip levels of a tiled map: each tile is uploaded from its own resolution downwards.

use glam::DVec2;
use rayon::prelude::*;

use super::maps::{Texel, half_floats};
use super::paging::{Level, TILE, is_halved, stored};
use crate::illumination::Chart;
use crate::illumination::lookup::{in_chart, mean};
use crate::illumination::tiles::{SIDE, TileLayout};

/// Mip levels of a map of values [W/m²], divided by `scale`, from fine to coarse.
pub(super) fn levels(
    chart: &Chart,
    layout: &TileLayout,
    values: &[[f32; 3]],
    scale: f32,
) -> Vec<Level<Texel>> {
    let mut levels = Vec::new();
    let mut size = [chart.width, chart.height];
    loop {
        let index = levels.len() as u32;
        levels.push(level((chart, layout, values), index, size, scale));
        if !is_halved(size) {
            return levels;
        }
        size = size.map(|side| side.div_ceil(2));
    }
}

fn level(map: (&Chart, &TileLayout, &[[f32; 3]]), index: u32, size: [usize; 2], scale: f32) -> Level<Texel> {
    let (chart, layout, _) = map;
    let [across, down] = size.map(|side| side.div_ceil(TILE));
    let is_last = !is_halved(size);
    let tile = |tile: usize| {
        let place = [tile % across, tile / across];
        let is_held = is_last || is_as_fine(layout, index, place);
        is_held.then(|| texels(map, index, size, place, scale))
    };
    Level {
        size,
        extent: [chart.width, chart.height].map(|side| side as f32 * (-(index as f32)).exp2()),
        tiles: (0..across * down).into_par_iter().map(tile).collect(),
    }
}

/// Whether a tile of a level covers any tile of the map that is at least as fine as the level.
fn is_as_fine(layout: &TileLayout, index: u32, [column, row]: [usize; 2]) -> bool {
    let (width, height) = layout.size();
    let under = |tile: usize, size: usize| {
        let first = (tile * TILE) << index;
        (first, (first + (TILE << index)).min(size) - 1)
    };
    let ((left, right), (top, bottom)) = (under(column, width), under(row, height));
    u32::from(layout.finest_between((left, top), (right, bottom))) <= index
}

/// The stored texels of a tile.
fn texels(
    (chart, layout, values): (&Chart, &TileLayout, &[[f32; 3]]),
    index: u32,
    size: [usize; 2],
    place: [usize; 2],
    scale: f32,
) -> Vec<Texel> {
    let map_size = DVec2::new(chart.width as f64, chart.height as f64);
    let [columns, rows] = [0, 1].map(|axis| {
        let first = place[axis] * TILE;
        // Beyond the map, its border is repeated.
        (first..first + stored(place[axis], size[axis])).map(move |at| at.min(size[axis] - 1))
    });
    let value = |column: usize, row: usize| {
        let (x, y) = (column << index, row << index);
        if u32::from(layout.level_at(x, y)) <= index {
            return mean(layout, values, index as u8, (column, row));
        }
        let middle = (DVec2::new(column as f64, row as f64) + 0.5) * f64::from(1_u32 << index);
        in_chart(chart, values, middle / map_size)
    };
    let irradiance: Vec<[f32; 3]> = rows
        .flat_map(|row| columns.clone().map(move |column| (column, row)))
        .map(|(column, row)| value(column, row).to_array().map(|channel| channel as f32))
        .collect();
    half_floats(&irradiance, scale)
}

const _: () = assert!(
    TILE == SIDE,
    "one tile of the map under one tile of the finest level"
);
