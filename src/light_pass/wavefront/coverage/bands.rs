//! Maps that are covered everywhere: threads own bands of rows.

use super::report::book;
use super::row::RowShares;
use super::shape::Shape;
use super::{CoverageReport, FluxTriangle};
use crate::illumination::accumulator::FluxCount;

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
        let mut added = [0; 3];
        shape.for_each_row(shape.rows(), &mut shares, |row, span| {
            let texels = &mut texels[row * size.0..(row + 1) * size.0];
            let here = span.add(triangle.flux, texels);
            for (sum, part) in added.iter_mut().zip(here) {
                *sum += part;
            }
        });
        book(&mut report.deposited, added);
    }
    for (outside, deposited) in report.outside.iter_mut().zip(report.deposited) {
        *outside -= deposited;
    }
    report
}
