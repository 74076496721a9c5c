//! Deposits into tiled maps: each tile is a small map in its own texels.
//!
//! Bands of rows of tiles are what threads divide among themselves. On one tile a triangle's shares are exact to the
//! last count; where it lies on several they are rounded down, and its largest share takes the few counts that are
//! left.

use std::ops::Range;

use glam::DVec2;
use rayon::prelude::*;

use super::bands::book_outside;
use super::report::book;
use super::row::{PreparedTriangle, RowShares, Sink, Span};
use super::shape::{Shape, rows_and_columns};
use super::{CoverageReport, FluxTriangle};
use crate::illumination::accumulator::FluxCount;
use crate::illumination::tiles::{SIDE, Tile, TileLayout};

/// Texel rows of a band.
const BAND_ROWS: usize = 16;

/// Bands of the finest tiles; coarser ones have fewer.
const BANDS: usize = SIDE / BAND_ROWS;

/// A triangle on a band of a tile.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Visit {
    /// Tile · BANDS + band.
    band: u32,
    triangle: u32,
}

/// What a triangle that lies on several tiles, or crosses the map's border, deposited in a band.
struct PartialDeposit {
    triangle: u32,
    added: FluxCount,
    /// Largest share in one texel, and the texel.
    largest: (f64, usize),
}

/// Adds triangles to the texels of a tiled map.
pub fn deposit(triangles: &[FluxTriangle], layout: &TileLayout, texels: &mut [FluxCount]) -> CoverageReport {
    // All flux counts as outside until texels take it.
    let mut report = CoverageReport::default();
    book_outside(triangles, &mut report);

    // Triangles are sorted by the bands that they may reach, tile by tile.
    let mut visits: Vec<Visit> = triangles
        .par_iter()
        .with_min_len(1024)
        .enumerate()
        .flat_map_iter(|(index, triangle)| visits(index, triangle, layout))
        .collect();
    visits.par_sort_unstable();
    let bands: Vec<&[Visit]> = visits.chunk_by(|a, b| a.band == b.band).collect();

    // Each task owns the texels of its band, so that none has to wait.
    let slices = split_texels(texels, layout, &bands);
    let done: Vec<([i128; 3], Vec<PartialDeposit>)> = bands
        .into_par_iter()
        .zip(slices)
        .map(|(visits, (tile, rows, texels))| add(visits, triangles, &tile, rows, texels))
        .collect();

    // Shares on several tiles were rounded down: the largest takes the rest, unless a part of the triangle lies beside
    // the map.
    let mut parts = Vec::new();
    for (added, more) in done {
        for (sum, channel) in report.deposited.iter_mut().zip(added) {
            *sum += channel;
        }
        parts.extend(more);
    }
    parts.sort_by_key(|part| part.triangle);
    for parts in parts.chunk_by(|a, b| a.triangle == b.triangle) {
        let triangle = &triangles[parts[0].triangle as usize];
        if is_inside(triangle, layout) {
            place_rest(triangle, parts, texels, &mut report);
        }
    }

    // What no texel took stays outside.
    for (outside, deposited) in report.outside.iter_mut().zip(report.deposited) {
        *outside -= deposited;
    }
    report
}

/// Bands that a triangle may reach.
fn visits<'a>(
    index: usize,
    triangle: &FluxTriangle,
    layout: &'a TileLayout,
) -> impl Iterator<Item = Visit> + 'a {
    let (rows, columns) = rows_and_columns(&triangle.corners, layout.size());
    let tiles = |range: &Range<usize>| {
        if range.is_empty() {
            0..0
        } else {
            range.start / SIDE..(range.end - 1) / SIDE + 1
        }
    };
    let (tile_rows, tile_columns) = (tiles(&rows), tiles(&columns));
    let (across, _) = layout.tile_counts();
    tile_rows.flat_map(move |row| {
        let (top, bottom) = (row * SIDE, row * SIDE + SIDE - 1);
        let (first, last) = (rows.start.max(top) - top, (rows.end - 1).min(bottom) - top);
        tile_columns.clone().flat_map(move |column| {
            let tile = row * across + column;
            let level = layout.level_at(column * SIDE, top);
            let bands = (first >> level) / BAND_ROWS..(last >> level) / BAND_ROWS + 1;
            bands.map(move |band| Visit {
                band: (tile * BANDS + band) as u32,
                triangle: index as u32,
            })
        })
    })
}

/// Tile, rows within the tile, and texels of each band.
fn split_texels<'a>(
    mut texels: &'a mut [FluxCount],
    layout: &TileLayout,
    bands: &[&[Visit]],
) -> Vec<(Tile, Range<usize>, &'a mut [FluxCount])> {
    let mut slices = Vec::with_capacity(bands.len());
    let mut begin = 0;
    for visits in bands {
        let band = visits[0].band as usize;
        let tile = layout.tile(band / BANDS);
        let first = band % BANDS * BAND_ROWS;
        let rows = first..(first + BAND_ROWS).min(tile.size.1);
        let start = tile.texels.start + rows.start * tile.size.0;
        let (_, rest) = texels.split_at_mut(start - begin);
        let (ours, others) = rest.split_at_mut(rows.len() * tile.size.0);
        begin = start + ours.len();
        texels = others;
        slices.push((tile, rows, ours));
    }
    slices
}

/// Adds triangles to a band of a tile.
fn add(
    visits: &[Visit],
    triangles: &[FluxTriangle],
    tile: &Tile,
    rows: Range<usize>,
    texels: &mut [FluxCount],
) -> ([i128; 3], Vec<PartialDeposit>) {
    // A tile is a small map, with its own origin and size of texels.
    let mut added = [0; 3];
    let mut parts = Vec::new();
    let mut shares = RowShares::new(tile.size.0);
    let origin = DVec2::new(tile.origin.0 as f64, tile.origin.1 as f64);
    let scale = 1.0 / f64::from(1_u32 << tile.level);
    let first_texel = tile.texels.start + rows.start * tile.size.0;
    for visit in visits {
        let triangle = &triangles[visit.triangle as usize];
        // Both operations are exact for everything on the tile.
        let corners = triangle.corners.map(|corner| (corner - origin) * scale);
        let shape = Shape::new(&corners, tile.size);
        let reached = shape.rows();
        let ours = reached.start.max(rows.start)..reached.end.min(rows.end);
        if ours.is_empty() {
            continue;
        }

        // Triangles within the tile are divided exactly; of others, the largest share is noted for the rest.
        let mut target = Rows {
            width: tile.size.0,
            first: rows.start,
            texels,
            flux: triangle.flux,
            divided: PreparedTriangle::new(triangle.flux),
            added: [0; 3],
            is_whole: is_on_tile(triangle, tile),
            largest: (0.0, 0),
        };
        shape.for_each_row(ours, &mut shares, &mut target);
        book(&mut added, target.added);
        if !target.is_whole {
            parts.push(PartialDeposit {
                triangle: visit.triangle,
                added: target.added,
                largest: (target.largest.0, first_texel + target.largest.1),
            });
        }
    }
    (added, parts)
}

/// Whether a triangle lies within one tile.
fn is_on_tile(triangle: &FluxTriangle, tile: &Tile) -> bool {
    let low = DVec2::new(tile.origin.0 as f64, tile.origin.1 as f64);
    let size = DVec2::new(
        (tile.size.0 << tile.level) as f64,
        (tile.size.1 << tile.level) as f64,
    );
    let is_on = |corner: &DVec2| corner.cmpge(low).all() && corner.cmple(low + size).all();
    triangle.corners.iter().all(is_on)
}

/// Whether all corners of a triangle lie on the map.
fn is_inside(triangle: &FluxTriangle, layout: &TileLayout) -> bool {
    let (width, height) = layout.size();
    let size = DVec2::new(width as f64, height as f64);
    let is_on = |corner: &DVec2| corner.cmpge(DVec2::ZERO).all() && corner.cmple(size).all();
    triangle.corners.iter().all(is_on)
}

/// Adds what rounding down left of a triangle to its largest share, the first among equals.
fn place_rest(
    triangle: &FluxTriangle,
    parts: &[PartialDeposit],
    texels: &mut [FluxCount],
    report: &mut CoverageReport,
) {
    let mut rest = triangle.flux;
    let mut largest = parts[0].largest;
    for part in parts {
        for (left, channel) in rest.iter_mut().zip(part.added) {
            *left -= channel;
        }
        if part.largest.0 > largest.0 {
            largest = part.largest;
        }
    }
    for (count, channel) in texels[largest.1].iter_mut().zip(rest) {
        *count += channel;
    }
    book(&mut report.deposited, rest);
}

/// Texels of some rows of a tile, to which one triangle is added.
struct Rows<'a> {
    width: usize,
    /// The first of the rows.
    first: usize,
    texels: &'a mut [FluxCount],
    flux: FluxCount,
    divided: PreparedTriangle,
    added: FluxCount,
    /// Whether the whole triangle lies on this tile.
    is_whole: bool,
    /// Largest share in one texel, and the texel.
    largest: (f64, usize),
}

impl Sink for Rows<'_> {
    #[inline(always)]
    fn add(&mut self, row: usize, span: Span) {
        let begin = (row - self.first) * self.width;
        let here = if self.is_whole {
            self.divided
                .add(span, &mut self.texels[begin..begin + self.width])
        } else {
            self.add_part(begin, span)
        };
        for (sum, part) in self.added.iter_mut().zip(here) {
            *sum += part;
        }
    }
}

impl Rows<'_> {
    /// For a triangle that lies on other tiles too.
    fn add_part(&mut self, begin: usize, span: Span) -> FluxCount {
        let mut added = [0; 3];
        let mut before = span.start;
        for (offset, &end) in span.ends.iter().enumerate() {
            let share = (end - before).max(0.0);
            before = before.max(end);
            let place = begin + span.first + offset;
            if share > self.largest.0 {
                self.largest = (share, place);
            }
            let counts = self.flux.map(|channel| (channel as f64 * share) as i64);
            for (sum, count) in self.texels[place]
                .iter_mut()
                .chain(&mut added)
                .zip(counts.iter().cycle())
            {
                *sum += count;
            }
        }
        added
    }
}
