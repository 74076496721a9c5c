//! Moves flux from texels that the surface does not cover to covered ones nearby.

use std::collections::VecDeque;

use rayon::prelude::*;

use super::bands::{self, TexelAccess};
use super::report::book;
use super::row::{PreparedTriangle, RowShares, Sink, Span};
use super::shape::Shape;
use super::{Coverage, CoverageReport, FluxTriangle};
use crate::illumination::accumulator::FluxCount;

/// Farthest that a share moves to a texel that its triangle does not touch [texels, in both directions].
const REACH: usize = 2;

/// Restricts flux to texels that the triangle's island covers.
struct CoveredOnly<'a, C>(&'a C);

impl<C: Coverage> TexelAccess for CoveredOnly<'_, C> {
    fn add(
        &self,
        flux: &PreparedTriangle,
        island: u32,
        row: usize,
        span: Span,
        texels: &mut [FluxCount],
    ) -> (FluxCount, bool) {
        let covers = |column: usize| self.0.covers(column, row, island);
        if (span.first..span.first + span.ends.len()).all(covers) {
            return (flux.add(span, texels), true);
        }
        let mut shares = vec![[0; 3]; span.ends.len()];
        flux.add(Span { first: 0, ..span }, &mut shares);
        let mut added = [0; 3];
        for (offset, share) in shares.iter().enumerate() {
            if covers(span.first + offset) {
                add(&mut texels[span.first + offset], share);
                add(&mut added, share);
            }
        }
        (added, false)
    }
}

/// Adds triangles to the texels that `coverage` allows.
pub fn deposit(
    triangles: &[FluxTriangle],
    coverage: &impl Coverage,
    texels: &mut [FluxCount],
) -> CoverageReport {
    let size = coverage.size();
    let (mut report, incomplete) = bands::deposit(triangles, size, texels, &CoveredOnly(coverage));
    let moves: Vec<Vec<Move>> = incomplete
        .into_par_iter()
        .map(|index| moves(&triangles[index], coverage))
        .collect();
    for Move { to, share } in moves.into_iter().flatten() {
        match to {
            Some(texel) => {
                add(&mut texels[texel], &share);
                book(&mut report.deposited, share);
            }
            None => book(&mut report.unplaced, share),
        }
        for (outside, channel) in report.outside.iter_mut().zip(share) {
            *outside -= i128::from(channel);
        }
    }
    report
}

fn add(texel: &mut FluxCount, share: &FluxCount) {
    for (sum, part) in texel.iter_mut().zip(share) {
        *sum += part;
    }
}

/// The share of an uncovered texel, and the texel that takes it.
struct Move {
    to: Option<usize>,
    share: FluxCount,
}

/// Targets for the shares of a triangle's uncovered texels: the nearest covered texel that the triangle touches,
/// counted in steps to any of the eight neighbours, or else the nearest covered texel around.
fn moves(triangle: &FluxTriangle, coverage: &impl Coverage) -> Vec<Move> {
    let width = coverage.size().0;
    let mut touched = Touched::new(triangle, coverage.size());
    let covered = |texel: usize| coverage.covers(texel % width, texel / width, triangle.island);
    touched.spread(covered);
    let mut moves = Vec::new();
    for row in &touched.rows {
        for (offset, &share) in row.shares.iter().enumerate() {
            let texel = row.texel + offset;
            if share != [0; 3] && !covered(texel) {
                let to = row.homes[offset].or_else(|| nearest(texel, coverage, triangle.island));
                moves.push(Move { to, share });
            }
        }
    }
    moves
}

/// Nearest texel within [`REACH`] that an island covers; the first in row-major order among equals.
fn nearest(texel: usize, coverage: &impl Coverage, island: u32) -> Option<usize> {
    let (width, height) = coverage.size();
    let (column, row) = (texel % width, texel / width);
    let rows = row.saturating_sub(REACH)..(row + REACH + 1).min(height);
    let columns = column.saturating_sub(REACH)..(column + REACH + 1).min(width);
    let distance = |&(x, y): &(usize, usize)| x.abs_diff(column).pow(2) + y.abs_diff(row).pow(2);
    rows.flat_map(|row| columns.clone().map(move |column| (column, row)))
        .filter(|&(column, row)| coverage.covers(column, row, island))
        .min_by_key(distance)
        .map(|(column, row)| row * width + column)
}

/// All texels that a triangle touches.
struct Touched {
    width: usize,
    flux: PreparedTriangle,
    /// Row of the map that `rows` starts at.
    first: usize,
    rows: Vec<TouchedRow>,
}

/// The touched texels of one row.
#[derive(Default)]
struct TouchedRow {
    /// The first texel.
    texel: usize,
    shares: Vec<FluxCount>,
    /// Nearest covered texel of each, once known.
    homes: Vec<Option<usize>>,
}

impl Sink for Touched {
    fn add(&mut self, row: usize, span: Span) {
        let mut shares = vec![[0; 3]; span.ends.len()];
        self.flux.add(Span { first: 0, ..span }, &mut shares);
        self.rows.resize_with(row - self.first, TouchedRow::default);
        self.rows.push(TouchedRow {
            texel: row * self.width + span.first,
            homes: vec![None; shares.len()],
            shares,
        });
    }
}

impl Touched {
    fn new(triangle: &FluxTriangle, size: (usize, usize)) -> Self {
        let shape = Shape::new(&triangle.corners, size);
        let rows = shape.rows();
        let mut touched = Self {
            width: size.0,
            flux: PreparedTriangle::new(triangle.flux),
            first: rows.start,
            rows: Vec::new(),
        };
        shape.for_each_row(rows, &mut RowShares::new(size.0), &mut touched);
        touched
    }

    /// Finds the home of every texel by a search outwards from the covered texels with a share.
    fn spread(&mut self, covered: impl Fn(usize) -> bool) {
        let mut queue = VecDeque::new();
        for (row, texels) in self.rows.iter_mut().enumerate() {
            for (offset, share) in texels.shares.iter().enumerate() {
                let texel = texels.texel + offset;
                if *share != [0; 3] && covered(texel) {
                    texels.homes[offset] = Some(texel);
                    queue.push_back((row, texel));
                }
            }
        }
        while let Some((row, texel)) = queue.pop_front() {
            let home = self.home(row, texel).and_then(|home| *home);
            for beside in row.saturating_sub(1)..(row + 2).min(self.rows.len()) {
                // The texel of that row in the same column, and its left and right neighbours.
                let middle = texel + beside * self.width - row * self.width;
                for place in [middle, middle.wrapping_sub(1), middle + 1] {
                    if let Some(unknown @ None) = self.home(beside, place) {
                        *unknown = home;
                        queue.push_back((beside, place));
                    }
                }
            }
        }
    }

    /// The home of a texel in a row, if the triangle touches it.
    fn home(&mut self, row: usize, texel: usize) -> Option<&mut Option<usize>> {
        let row = &mut self.rows[row];
        row.homes.get_mut(texel.checked_sub(row.texel)?)
    }
}
