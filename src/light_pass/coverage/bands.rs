//! Divides triangles among tasks, each of which owns a band of rows.

use std::ops::Range;

use rayon::prelude::*;

use super::bins::{Bins, split_rows};
use super::report::book;
use super::row::{PreparedTriangle, RowShares, Sink, Span};
use super::shape::{Shape, is_finite};
use super::{CoverageReport, FluxTriangle};
use crate::illumination::accumulator::FluxCount;
use crate::light_pass::receiver_maps::Coverage;

/// Triangles sorted by bands at a time.
const TRIANGLES_PER_CHUNK: usize = 8192;

/// Fewer triangles are not worth dividing among threads.
const MIN_TRIANGLES: usize = 1024;

/// Bands per thread, for load balance.
const BANDS_PER_THREAD: usize = 4;

/// Adds triangles to the texels of a map of `size`. Returns what went where, with everything not added counted as
/// outside.
pub fn deposit(
    triangles: &[FluxTriangle],
    size: (usize, usize),
    texels: &mut [FluxCount],
    coverage: &impl Coverage,
) -> CoverageReport {
    let mut report = CoverageReport::default();
    if triangles.len() < MIN_TRIANGLES || rayon::current_num_threads() == 1 {
        book_outside(triangles, &mut report);
        report.deposited = add(triangles.iter(), size, 0..size.1, texels, coverage);
    } else {
        add_in_bands(triangles, size, texels, coverage, &mut report);
    }
    for (outside, deposited) in report.outside.iter_mut().zip(report.deposited) {
        *outside -= deposited;
    }
    report
}

/// Books all flux as outside, except that of non-finite triangles.
pub(super) fn book_outside(triangles: &[FluxTriangle], report: &mut CoverageReport) {
    for triangle in triangles {
        let account = if is_finite(&triangle.corners) {
            &mut report.outside
        } else {
            &mut report.non_finite
        };
        book(account, triangle.flux);
    }
}

/// Adds triangles with one task per band of rows.
fn add_in_bands(
    triangles: &[FluxTriangle],
    size: (usize, usize),
    texels: &mut [FluxCount],
    coverage: &impl Coverage,
    report: &mut CoverageReport,
) {
    // Chunks find out in parallel which rows their triangles reach, and at what cost.
    let chunks: Vec<&[FluxTriangle]> = triangles.chunks(TRIANGLES_PER_CHUNK).collect();
    let prepare = |chunk: &&[FluxTriangle]| {
        let mut report = CoverageReport::default();
        book_outside(chunk, &mut report);
        (Bins::new(chunk, size), report)
    };
    let (mut bins, reports): (Vec<Bins>, Vec<CoverageReport>) = chunks.par_iter().map(prepare).unzip();
    reports.iter().for_each(|part| report.merge(part));

    // Bands are of about equal work, several for each thread.
    let mut work = vec![0; size.1];
    bins.iter().for_each(|part| part.add_work(&mut work));
    let bands = split_rows(&work, BANDS_PER_THREAD * rayon::current_num_threads());
    bins.par_iter_mut().for_each(|part| part.sort(&bands));

    // Each task owns the texels of its band, so that none has to wait.
    let parts: Vec<[i128; 3]> = split_texels(texels, size.0, &bands)
        .into_par_iter()
        .zip(bands)
        .enumerate()
        .map(|(band, (texels, rows))| {
            let ours = bins.iter().enumerate().flat_map(|(chunk, part)| {
                let first = chunk * TRIANGLES_PER_CHUNK;
                part.band(band)
                    .iter()
                    .map(move |&index| &triangles[first + index as usize])
            });
            add(ours, size, rows, texels, coverage)
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

/// Adds triangles to the texels of some rows. Returns what was added.
fn add<'a>(
    triangles: impl Iterator<Item = &'a FluxTriangle>,
    size: (usize, usize),
    rows: Range<usize>,
    texels: &mut [FluxCount],
    coverage: &impl Coverage,
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
            coverage,
            flux: PreparedTriangle::new(triangle.flux),
            island: triangle.island,
            added: [0; 3],
        };
        shape.for_each_row(ours, &mut shares, &mut target);
        book(&mut added, target.added);
    }
    added
}

/// Texels of some rows, to which one triangle is added.
struct Rows<'a, C> {
    width: usize,
    /// The first of the rows.
    first: usize,
    texels: &'a mut [FluxCount],
    coverage: &'a C,
    flux: PreparedTriangle,
    island: u32,
    added: FluxCount,
}

impl<C: Coverage> Sink for Rows<'_, C> {
    #[inline(always)]
    fn add(&mut self, row: usize, span: Span) {
        let begin = (row - self.first) * self.width;
        let texels = &mut self.texels[begin..begin + self.width];
        let covers = |column: usize| self.coverage.covers(column, row, self.island);
        let is_covered = || self.coverage.is_full() || (span.first..span.first + span.ends.len()).all(covers);
        if is_covered() {
            let here = self.flux.add(span, texels);
            for (sum, part) in self.added.iter_mut().zip(here) {
                *sum += part;
            }
            return;
        }

        // Flux on texels that the island does not cover is left out.
        let mut shares = vec![[0; 3]; span.ends.len()];
        self.flux.add(Span { first: 0, ..span }, &mut shares);
        for (column, share) in (span.first..).zip(&shares) {
            if covers(column) {
                for channel in 0..3 {
                    texels[column][channel] += share[channel];
                    self.added[channel] += share[channel];
                }
            }
        }
    }
}
