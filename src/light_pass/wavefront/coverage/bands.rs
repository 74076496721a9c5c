//! Maps that are covered everywhere: threads own bands of rows.

use super::report::book;
use super::row::{Divided, RowShares, Sink, Span};
use super::shape::Shape;
use super::{CoverageReport, FluxTriangle};
use crate::illumination::accumulator::FluxCount;

/// Texels that one triangle is added to.
struct Rows<'a> {
    width: usize,
    texels: &'a mut [FluxCount],
    flux: Divided,
    added: FluxCount,
}

impl Sink for Rows<'_> {
    #[inline(always)]
    fn add(&mut self, row: usize, span: Span) {
        let texels = &mut self.texels[row * self.width..(row + 1) * self.width];
        let here = self.flux.add(span, texels);
        for (sum, part) in self.added.iter_mut().zip(here) {
            *sum += part;
        }
    }
}

/// Adds triangles to all texels of a map of `size`.
pub fn deposit(triangles: &[FluxTriangle], size: (usize, usize), texels: &mut [FluxCount]) -> CoverageReport {
    let mut report = CoverageReport::default();
    let mut shares = RowShares::new(size.0);
    for triangle in triangles {
        let shape = Shape::new(&triangle.corners, size);
        if matches!(shape, Shape::NonFinite) {
            book(&mut report.non_finite, triangle.flux);
            continue;
        }
        book(&mut report.outside, triangle.flux);
        let mut rows = Rows {
            width: size.0,
            texels,
            flux: Divided::new(triangle.flux),
            added: [0; 3],
        };
        shape.for_each_row(shape.rows(), &mut shares, &mut rows);
        book(&mut report.deposited, rows.added);
    }
    for (outside, deposited) in report.outside.iter_mut().zip(report.deposited) {
        *outside -= deposited;
    }
    report
}
