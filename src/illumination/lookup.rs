//! Bilinear look-up in a map.

use glam::DVec2;

use super::Chart;
use super::tiles::{SIDE, TileLayout};
use crate::optics::LinearSrgb;

/// Bilinear lookup between texel centres of `width × height` values, clamped at the border. Texel (i, j) has its centre
/// at u = (i + ½)/width, v = (j + ½)/height.
pub fn bilinear(values: &[[f32; 3]], width: usize, height: usize, uv: DVec2) -> LinearSrgb {
    let texel = |column: usize, row: usize| LinearSrgb::from(values[row * width + column].map(f64::from));
    blend(DVec2::new(width as f64, height as f64), uv, texel)
}

/// [`bilinear`] for the values of a chart. In a tiled chart, the texel size is that of the tile at `uv`; neighbouring
/// tiles contribute their means over texels of that size.
pub fn in_chart(chart: &Chart, values: &[[f32; 3]], uv: DVec2) -> LinearSrgb {
    let Some(layout) = &chart.layout else {
        return bilinear(values, chart.width, chart.height, uv);
    };
    let within = |coordinate: f64, size: usize| ((coordinate * size as f64) as usize).min(size - 1);
    let level = layout.level_at(within(uv.x, chart.width), within(uv.y, chart.height));
    let size = DVec2::new(chart.width as f64, chart.height as f64) / f64::from(1_u32 << level);
    blend(size, uv, |column, row| mean(layout, values, level, (column, row)))
}

/// Mean over a texel of a level, given by its column and row in that level, as far as the map covers it.
pub fn mean(
    layout: &TileLayout,
    values: &[[f32; 3]],
    level: u8,
    (column, row): (usize, usize),
) -> LinearSrgb {
    // In a tile that is no finer than the level, one texel covers the place.
    let value = |texel: usize| LinearSrgb::from(values[texel].map(f64::from));
    let (column, row) = (column << level, row << level);
    let own = layout.level_at(column, row);
    if own >= level {
        return value(layout.texel(column, row));
    }

    // Otherwise the texels beneath are averaged by area, as far as the map goes.
    let (width, height) = layout.size();
    let (right, bottom) = (
        (column + (1 << level)).min(width),
        (row + (1 << level)).min(height),
    );
    let (mut sum, mut area) = (LinearSrgb::BLACK, 0.0);
    // Tiles under the texel may have different levels.
    for (top, next_top) in pieces(row, bottom) {
        for (left, next_left) in pieces(column, right) {
            let own = layout.level_at(left, top);
            let weight = f64::from(1_u32 << (2 * own));
            for row in (top..next_top).step_by(1 << own) {
                for column in (left..next_left).step_by(1 << own) {
                    sum += value(layout.texel(column, row)) * weight;
                    area += weight;
                }
            }
        }
    }
    sum * (1.0 / area)
}

/// Splits an interval of finest texels at tile borders.
fn pieces(begin: usize, end: usize) -> impl Iterator<Item = (usize, usize)> {
    (begin / SIDE..end.div_ceil(SIDE)).map(move |tile| (begin.max(tile * SIDE), end.min((tile + 1) * SIDE)))
}

/// Blends the four texels around a position on a map of `size` texels, the last of which may be partial.
pub fn blend(size: DVec2, uv: DVec2, texel: impl Fn(usize, usize) -> LinearSrgb) -> LinearSrgb {
    let (left, right, across) = between_centres(uv.x, size.x);
    let (top, bottom, down) = between_centres(uv.y, size.y);
    let row = |row: usize| texel(left, row) * (1.0 - across) + texel(right, row) * across;
    row(top) * (1.0 - down) + row(bottom) * down
}

/// The two texels along a side of `size` whose centres enclose a coordinate in [0, 1], and the position between them.
fn between_centres(coordinate: f64, size: f64) -> (usize, usize, f64) {
    let last = size.ceil() - 1.0;
    let position = (coordinate * size - 0.5).clamp(0.0, last);
    let low = position.floor();
    (low as usize, (low + 1.0).min(last) as usize, position - low)
}
