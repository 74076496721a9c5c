//! Maps that are covered everywhere: tasks own bands of rows.

use std::ops::Range;

use rayon::prelude::*;

use super::bins::{Bins, split_rows};
use super::report::book;
use super::row::{Divided, RowShares, Sink, Span};
use super::shape::{Shape, is_finite};
use super::{CoverageReport, FluxTriangle};
use crate::illumination::accumulator::FluxCount;

/// Triangles that are sorted by bands in one go.
const TRIANGLES_PER_CHUNK: usize = 8192;

/// Fewer triangles are not worth dividing.
const LEAST_TRIANGLES: usize = 1024;

/// Bands per thread, so that none waits long for the last.
const BANDS_PER_THREAD: usize = 4;

/// Adds triangles to all texels of a map of `size`.
pub fn deposit(triangles: &[FluxTriangle], size: (usize, usize), texels: &mut [FluxCount]) -> CoverageReport {
    let mut report = CoverageReport::default();
    if triangles.len() < LEAST_TRIANGLES || rayon::current_num_threads() == 1 {
        book_outside(triangles, &mut report);
        report.deposited = add(triangles.iter(), size, 0..size.1, texels);
    } else {
        add_in_bands(triangles, size, texels, &mut report);
    }
    for (outside, deposited) in report.outside.iter_mut().zip(report.deposited) {
        *outside -= deposited;
    }
    report
}

/// Books all flux as outside, but for that of triangles without place.
fn book_outside(triangles: &[FluxTriangle], report: &mut CoverageReport) {
    for triangle in triangles {
        let account = if is_finite(&triangle.corners) {
            &mut report.outside
        } else {
            &mut report.non_finite
        };
        book(account, triangle.flux);
    }
}

/// Adds triangles, each band of rows in a task of its own.
fn add_in_bands(
    triangles: &[FluxTriangle],
    size: (usize, usize),
    texels: &mut [FluxCount],
    report: &mut CoverageReport,
) {
    let chunks: Vec<&[FluxTriangle]> = triangles.chunks(TRIANGLES_PER_CHUNK).collect();
    let prepare = |chunk: &&[FluxTriangle]| {
        let mut report = CoverageReport::default();
        book_outside(chunk, &mut report);
        (Bins::new(chunk, size), report)
    };
    let (mut bins, reports): (Vec<Bins>, Vec<CoverageReport>) = chunks.par_iter().map(prepare).unzip();
    reports.iter().for_each(|part| report.merge(part));
    let mut work = vec![0; size.1];
    bins.iter().for_each(|part| part.add_work(&mut work));
    let bands = split_rows(&work, BANDS_PER_THREAD * rayon::current_num_threads());
    bins.par_iter_mut().for_each(|part| part.sort(&bands));
    let parts: Vec<[i128; 3]> = split_texels(texels, size.0, &bands)
        .into_par_iter()
        .zip(bands)
        .enumerate()
        .map(|(band, (texels, rows))| {
            let ours = chunks.iter().zip(&bins).flat_map(|(chunk, part)| {
                let indices = part.band(band).iter();
                indices.map(|&index| &chunk[index as usize])
            });
            add(ours, size, rows, texels)
        })
        .collect();
    for part in parts {
        for (sum, channel) in report.deposited.iter_mut().zip(part) {
            *sum += channel;
        }
    }
}

/// The texels of each band.
fn split_texels<'a>(
    mut texels: &'a mut [FluxCount],
    width: usize,
    bands: &[Range<usize>],
) -> Vec<&'a mut [FluxCount]> {
    let mut parts = Vec::new();
    for rows in bands {
        let (ours, others) = texels.split_at_mut(rows.len() * width);
        parts.push(ours);
        texels = others;
    }
    parts
}

/// Adds triangles to the texels of some rows; returns what was added.
fn add<'a>(
    triangles: impl Iterator<Item = &'a FluxTriangle>,
    size: (usize, usize),
    rows: Range<usize>,
    texels: &mut [FluxCount],
) -> [i128; 3] {
    let mut added = [0; 3];
    let mut shares = RowShares::new(size.0);
    for triangle in triangles {
        let shape = Shape::new(&triangle.corners, size);
        let reached = shape.rows();
        let ours = reached.start.max(rows.start)..reached.end.min(rows.end);
        let mut target = Rows {
            width: size.0,
            first: rows.start,
            texels,
            flux: Divided::new(triangle.flux),
            added: [0; 3],
        };
        shape.for_each_row(ours, &mut shares, &mut target);
        book(&mut added, target.added);
    }
    added
}

/// Texels of some rows, to which one triangle is added.
struct Rows<'a> {
    width: usize,
    /// The first of the rows.
    first: usize,
    texels: &'a mut [FluxCount],
    flux: Divided,
    added: FluxCount,
}

impl Sink for Rows<'_> {
    #[inline(always)]
    fn add(&mut self, row: usize, span: Span) {
        let begin = (row - self.first) * self.width;
        let here = self.flux.add(span, &mut self.texels[begin..begin + self.width]);
        for (sum, part) in self.added.iter_mut().zip(here) {
            *sum += part;
        }
    }
}
