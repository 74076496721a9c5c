//! Maps with texels that the surface does not cover.

use super::report::book;
use super::row::{Divided, RowShares, Sink, Span};
use super::shape::Shape;
use super::{Coverage, CoverageReport, FluxTriangle};
use crate::illumination::accumulator::FluxCount;

/// How far a share goes at most to a texel that its triangle does not touch [texels, either way].
const REACH: usize = 2;

/// The shares of one triangle, reused from triangle to triangle.
struct Shares {
    /// Column, row, counts of the texels that its island covers.
    covered: Vec<(usize, usize, FluxCount)>,
    /// Those of the others.
    uncovered: Vec<(usize, usize, FluxCount)>,
    row: RowShares,
    line: Vec<FluxCount>,
}

/// Adds triangles to those texels that `coverage` lets grow.
pub fn deposit(
    triangles: &[FluxTriangle],
    coverage: &impl Coverage,
    texels: &mut [FluxCount],
) -> CoverageReport {
    let size = coverage.size();
    let mut report = CoverageReport::default();
    let mut shares = Shares::new(size.0);
    for triangle in triangles {
        let shape = Shape::new(&triangle.corners, size);
        if matches!(shape, Shape::NonFinite) {
            book(&mut report.non_finite, triangle.flux);
            continue;
        }
        let inside = shares.collect(&shape, triangle, coverage);
        book(&mut report.outside, triangle.flux);
        for (outside, inside) in report.outside.iter_mut().zip(inside) {
            *outside -= inside;
        }
        for &(column, row, share) in &shares.uncovered {
            match shares.home(column, row, coverage, triangle.island) {
                Some((column, row)) => {
                    add(&mut texels[row * size.0 + column], share);
                    book(&mut report.deposited, share);
                }
                None => book(&mut report.unplaced, share),
            }
        }
        for &(column, row, share) in &shares.covered {
            add(&mut texels[row * size.0 + column], share);
            book(&mut report.deposited, share);
        }
    }
    report
}

fn add(texel: &mut FluxCount, share: FluxCount) {
    for (sum, part) in texel.iter_mut().zip(share) {
        *sum += part;
    }
}

impl Shares {
    fn new(width: usize) -> Self {
        Self {
            covered: Vec::new(),
            uncovered: Vec::new(),
            row: RowShares::new(width),
            line: Vec::new(),
        }
    }

    /// Lists the shares of a triangle; returns their sum.
    fn collect(&mut self, shape: &Shape, triangle: &FluxTriangle, coverage: &impl Coverage) -> [i128; 3] {
        self.covered.clear();
        self.uncovered.clear();
        let mut inside = [0; 3];
        shape.for_each_row(
            shape.rows(),
            &mut self.row,
            &mut Places {
                flux: Divided::new(triangle.flux),
                island: triangle.island,
                coverage,
                covered: &mut self.covered,
                uncovered: &mut self.uncovered,
                line: &mut self.line,
                inside: &mut inside,
            },
        );
        inside
    }

    /// Where the share of an uncovered texel goes: to the nearest covered one that the triangle touches, else to the
    /// nearest around; the first in the order of rows and columns where several are as near.
    fn home(
        &self,
        column: usize,
        row: usize,
        coverage: &impl Coverage,
        island: u32,
    ) -> Option<(usize, usize)> {
        let distance = |place: (usize, usize)| {
            let (x, y) = (place.0.abs_diff(column) as u64, place.1.abs_diff(row) as u64);
            x * x + y * y
        };
        let touched = self.covered.iter().map(|&(column, row, _)| (column, row));
        if let Some(nearest) = touched.min_by_key(|&place| distance(place)) {
            return Some(nearest);
        }
        let (width, height) = coverage.size();
        let rows = row.saturating_sub(REACH)..(row + REACH + 1).min(height);
        let columns = column.saturating_sub(REACH)..(column + REACH + 1).min(width);
        rows.flat_map(|row| columns.clone().map(move |column| (column, row)))
            .filter(|&(column, row)| coverage.covers(column, row, island))
            .min_by_key(|&place| distance(place))
    }
}

/// Sorts the texels of one triangle.
struct Places<'a, C> {
    flux: Divided,
    island: u32,
    coverage: &'a C,
    covered: &'a mut Vec<(usize, usize, FluxCount)>,
    uncovered: &'a mut Vec<(usize, usize, FluxCount)>,
    line: &'a mut Vec<FluxCount>,
    inside: &'a mut [i128; 3],
}

impl<C: Coverage> Sink for Places<'_, C> {
    fn add(&mut self, row: usize, span: Span) {
        self.line.clear();
        self.line.resize(span.ends.len(), [0; 3]);
        book(self.inside, self.flux.add(Span { first: 0, ..span }, self.line));
        for (offset, &share) in self.line.iter().enumerate() {
            let column = span.first + offset;
            let list = if self.coverage.covers(column, row, self.island) {
                &mut *self.covered
            } else {
                &mut *self.uncovered
            };
            list.push((column, row, share));
        }
    }
}
