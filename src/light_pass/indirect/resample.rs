//! Resamples maps to grids and back, conserving flux, without crossing creases or the borders of solids.

use std::ops::Range;

use glam::DVec2;
use rayon::prelude::*;

use super::grid::Grid;
use crate::illumination::Chart;
use crate::illumination::gutter::fill_gutter;
use crate::illumination::parametrisation::coverage::{for_each_texel_in_row, rows};
use crate::illumination::tiles::Tile;
use crate::optics::LinearSrgb;

/// Overlap of a receiver's map with its grid.
#[derive(Debug)]
pub struct Resampling<'a> {
    grid: &'a Grid,
    chart: &'a Chart,
    /// The piece that covers most of each texel of the map; empty if there is a single piece.
    pieces: Vec<u32>,
}

impl<'a> Resampling<'a> {
    /// For a grid and a map of the same receiver.
    pub fn new(grid: &'a Grid, chart: &'a Chart) -> Self {
        let is_one = grid.pieces.iter().all(|&piece| piece == 0);
        let pieces = if is_one {
            Vec::new()
        } else {
            pieces_of_texels(grid, chart)
        };
        Self { grid, chart, pieces }
    }

    fn piece(&self, texel: usize) -> u32 {
        self.pieces.get(texel).copied().unwrap_or(0)
    }

    /// The map as rectangles of texels that are stored row by row: the whole map, or its tiles.
    fn blocks(&self) -> Vec<Block> {
        let (width, height) = (self.chart.width, self.chart.height);
        match &self.chart.layout {
            None => vec![Block {
                texels: 0..width * height,
                origin: (0, 0),
                across: width,
                side: 1,
            }],
            Some(layout) => {
                let block = |tile: Tile| Block {
                    texels: tile.texels,
                    origin: tile.origin,
                    across: tile.size.0,
                    side: 1 << tile.level,
                };
                layout.tiles().map(block).collect()
            }
        }
    }

    /// Mean E of each element [W/m²], from E of the map's texels: each texel gives its flux to the elements that it
    /// overlaps.
    pub fn to_grid(&self, irradiance: &[[f32; 3]]) -> Vec<LinearSrgb> {
        let elements = self.grid.elements.all();
        let mut flux = vec![LinearSrgb::BLACK; elements.len()];
        let mut area_m2 = vec![0.0; elements.len()];
        let (width, height) = (self.chart.width, self.chart.height);

        // The overlap of two rectangles is the product of those along both axes, found once per row and column of a
        // block.
        for block in self.blocks() {
            let lines = |first: usize, count: usize, from: usize, to: usize| -> Vec<Vec<(usize, f64)>> {
                let low = |index: usize| first + index * block.side;
                (0..count)
                    .map(|index| shares(low(index)..low(index + 1), from, to))
                    .collect()
            };
            let columns = lines(block.origin.0, block.across, width, self.grid.chart.width);
            let rows = lines(
                block.origin.1,
                block.texels.len() / block.across,
                height,
                self.grid.chart.height,
            );
            let places = rows
                .iter()
                .flat_map(|rows| columns.iter().map(move |columns| (rows, columns)));

            // A texel gives its flux only to elements of its own piece, so that no light crosses a crease.
            for (texel, (rows, columns)) in block.texels.zip(places) {
                let texel_m2 = self.chart.texel_area_m2(texel);
                if texel_m2 <= 0.0 {
                    continue;
                }
                let e = LinearSrgb::from(irradiance[texel].map(f64::from));
                for &(grid_row, down) in rows {
                    for &(grid_column, across) in columns {
                        let place = grid_row * self.grid.chart.width + grid_column;
                        if let Some(element) = self.grid.elements.find(place, self.piece(texel)) {
                            let part_m2 = texel_m2 * across * down;
                            flux[element] += e * part_m2;
                            area_m2[element] += part_m2;
                        }
                    }
                }
            }
        }

        // Flux over area is the mean E. An element that owns no texel of the map takes E at its centroid.
        let at_middle = |element: usize| {
            let size = DVec2::new(self.grid.chart.width as f64, self.grid.chart.height as f64);
            let place = elements[element].middle / size * DVec2::new(width as f64, height as f64);
            let [column, row] = [(place.x, width), (place.y, height)]
                .map(|(coordinate, count)| (coordinate.max(0.0) as usize).min(count - 1));
            LinearSrgb::from(irradiance[self.chart.texel_at(column, row)].map(f64::from))
        };
        (0..elements.len())
            .map(|element| match area_m2[element] {
                // A sliver that is not the main piece of any texel of the map.
                0.0 => at_middle(element),
                covered => flux[element] / covered,
            })
            .collect()
    }

    /// Values of the map's texels, interpolated between the elements around each. Hidden elements count only where
    /// there are no others, so that visible light extends slightly beneath an occluder. The gutter is filled.
    pub fn to_map(&self, values: &[[f64; 3]], is_hidden: impl Fn(usize) -> bool + Sync) -> Vec<[f32; 3]> {
        let (width, height) = (self.chart.width, self.chart.height);
        let scale = DVec2::new(
            self.grid.chart.width as f64 / width as f64,
            self.grid.chart.height as f64 / height as f64,
        );
        let mut map = vec![[0.0; 3]; self.chart.texel_count()];
        for block in self.blocks() {
            let (first, side) = (block.texels.start, block.side as f64);
            let origin = DVec2::new(block.origin.0 as f64, block.origin.1 as f64);
            let lines = map[block.texels].par_chunks_mut(block.across).enumerate();
            lines.for_each(|(row, line)| {
                for (column, value) in line.iter_mut().enumerate() {
                    let texel = first + row * block.across + column;
                    if self.chart.texel_area_m2(texel) > 0.0 {
                        let middle = DVec2::new(column as f64 + 0.5, row as f64 + 0.5) * side + origin;
                        let found = self.between(middle * scale, self.piece(texel), values, &is_hidden);
                        *value = found.map(|channel| channel as f32);
                    }
                }
            });
        }
        fill_gutter(self.chart, &mut map);
        map
    }

    /// Interpolates between the four elements around a position [texels of the grid] that belong to a piece.
    fn between(
        &self,
        place: DVec2,
        piece: u32,
        values: &[[f64; 3]],
        is_hidden: &impl Fn(usize) -> bool,
    ) -> [f64; 3] {
        // Only elements of the texel's own piece take part: light is not interpolated across creases. Bilinear weights
        // are divided by the sum of those in use: at the border of a piece some of the four are missing.
        let low = (place - 0.5).floor();
        let part = place - 0.5 - low;
        // Weighted values and weights: of visible elements, then of hidden ones.
        let mut sums = [([0.0; 3], 0.0); 2];
        for (right, across) in [(0, 1.0 - part.x), (1, part.x)] {
            for (down, along) in [(0, 1.0 - part.y), (1, part.y)] {
                let weight = across * along;
                let texel = [low.x as i64 + right, low.y as i64 + down];
                let Some(found) = self.grid.element_in(texel, piece) else {
                    continue;
                };
                let (sum, weights) = &mut sums[usize::from(is_hidden(found))];
                for channel in 0..3 {
                    sum[channel] += weight * values[found][channel];
                }
                *weights += weight;
            }
        }

        // Hidden elements are dark, as they lie within solids or see nothing. They count only where no visible one is
        // near.
        if let Some((sum, weights)) = sums.into_iter().find(|(_, weights)| *weights > 0.0) {
            return sum.map(|channel| channel / weights);
        }
        // A sliver beyond the last element centre of its piece.
        let nearest = self.grid.nearest(place.floor().as_i64vec2().to_array(), piece);
        nearest.map_or([0.0; 3], |found| values[found])
    }
}

/// Texels of a map that are stored row by row.
struct Block {
    texels: Range<usize>,
    /// First column and row [texels of the finest size].
    origin: (usize, usize),
    /// Texels per row.
    across: usize,
    /// Side of each texel [texels of the finest size].
    side: usize,
}

/// Texels of a line of `to` that a range out of `from` overlaps, each with its share of the range.
fn shares(texels: Range<usize>, from: usize, to: usize) -> Vec<(usize, f64)> {
    // In units of 1/(from·to) of the line, all borders are integers.
    let count = texels.len();
    let (low, high) = (texels.start * to, texels.end * to);
    (low / from..high.div_ceil(from))
        .map(|texel| {
            let overlap = high.min((texel + 1) * from) - low.max(texel * from);
            (texel, overlap as f64 / (to * count) as f64)
        })
        .collect()
}

fn pieces_of_texels(grid: &Grid, chart: &Chart) -> Vec<u32> {
    // The piece that overlaps a texel most owns it, as far as that shows without memory per piece: only the leader's
    // area is summed, and others compete triangle by triangle.
    let (width, height) = (chart.width, chart.height);
    let size = DVec2::new(width as f64, height as f64);
    let mut best = vec![(0.0_f32, 0_u32); width * height];
    for (uvs, &piece) in chart.corner_uvs.iter().zip(&grid.pieces) {
        let corners = uvs.map(|uv| uv * size);
        for row in rows(corners, height) {
            for_each_texel_in_row(corners, row, width, |column, part| {
                let (most, owner) = &mut best[row * width + column];
                let area = part.area() as f32;
                if *owner == piece {
                    *most += area;
                } else if area > *most {
                    (*most, *owner) = (area, piece);
                }
            });
        }
    }
    let piece = |texel: usize| best[texel].1;
    match &chart.layout {
        None => (0..best.len()).map(piece).collect(),
        Some(layout) => {
            // The piece at the centre of a larger texel.
            let middles = layout.tiles().flat_map(|tile| {
                let side = 1_usize << tile.level;
                (0..tile.texels.len()).map(move |index| {
                    let column = tile.origin.0 + index % tile.size.0 * side + side / 2;
                    let row = tile.origin.1 + index / tile.size.0 * side + side / 2;
                    row * width + column
                })
            });
            middles.map(piece).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::shares;

    #[test]
    fn shares_of_a_texel_add_up_to_it() {
        for (from, to) in [(64, 16), (16, 64), (10, 7), (7, 10), (1, 1), (5, 5)] {
            let mut into = vec![0.0; to];
            for index in 0..from {
                let shares = shares(index..index + 1, from, to);
                assert!((shares.iter().map(|(_, share)| share).sum::<f64>() - 1.0).abs() < 1e-12);
                shares.iter().for_each(|(texel, share)| into[*texel] += share);
            }
            assert!(
                into.iter()
                    .all(|sum| (sum - from as f64 / to as f64).abs() < 1e-12)
            );
        }
    }
}
