//! Bins triangles by the bands of rows they reach.

use std::ops::Range;

use super::FluxTriangle;
use super::shape::rows_and_columns;

/// Cost of preparing a triangle, in texels.
const TRIANGLE_WORK: i64 = 8;

/// Cost of starting a row, in texels.
const ROW_WORK: i64 = 4;

/// Triangles sorted by the bands that they reach.
#[derive(Debug)]
pub struct Bins {
    /// First row and end of the rows, by triangle.
    rows: Vec<(u32, u32)>,
    /// Difference between the work of each row and that of the previous one; one more than there are rows.
    changes: Vec<i64>,
    /// Where the triangles of each band begin; the last entry is the end.
    begins: Vec<usize>,
    /// Triangles, band by band.
    indices: Vec<u32>,
}

impl Bins {
    pub fn new(triangles: &[FluxTriangle], size: (usize, usize)) -> Self {
        let mut changes = vec![0_i64; size.1 + 1];
        let rows = triangles
            .iter()
            .map(|triangle| {
                let (rows, columns) = rows_and_columns(&triangle.corners, size);
                if !rows.is_empty() {
                    // At most half of the texels between the borders are inside.
                    let row_work = ROW_WORK + columns.len() as i64 / 2;
                    changes[rows.start] += row_work + TRIANGLE_WORK;
                    changes[rows.start + 1] -= TRIANGLE_WORK;
                    changes[rows.end] -= row_work;
                }
                (rows.start as u32, rows.end as u32)
            })
            .collect();
        Self {
            rows,
            changes,
            begins: Vec::new(),
            indices: Vec::new(),
        }
    }

    /// Adds the work in each row.
    pub fn add_work(&self, work: &mut [u64]) {
        let mut here = 0;
        for (sum, change) in work.iter_mut().zip(&self.changes) {
            here += change;
            // Never negative: each decrease follows its increase.
            *sum += here as u64;
        }
    }

    /// Sorts the triangles by bands.
    pub fn sort(&mut self, bands: &[Range<usize>]) {
        let mut band_of_row = Vec::new();
        for (band, rows) in bands.iter().enumerate() {
            band_of_row.resize(rows.end, band);
        }
        let bands_of = |&(start, end): &(u32, u32)| {
            if start < end {
                band_of_row[start as usize]..band_of_row[end as usize - 1] + 1
            } else {
                0..0
            }
        };
        self.begins = vec![0; bands.len() + 1];
        for rows in &self.rows {
            for band in bands_of(rows) {
                self.begins[band + 1] += 1;
            }
        }
        for band in 0..bands.len() {
            self.begins[band + 1] += self.begins[band];
        }
        let mut next = self.begins.clone();
        self.indices = vec![0; self.begins[bands.len()]];
        for (index, rows) in self.rows.iter().enumerate() {
            for band in bands_of(rows) {
                self.indices[next[band]] = index as u32;
                next[band] += 1;
            }
        }
    }

    /// The triangles of a band, after [`Bins::sort`].
    pub fn band(&self, band: usize) -> &[u32] {
        &self.indices[self.begins[band]..self.begins[band + 1]]
    }
}

/// Divides all rows into at most `count` bands of about equal work.
pub fn split_rows(work: &[u64], count: usize) -> Vec<Range<usize>> {
    let total: u64 = work.iter().sum();
    let mut bands = Vec::new();
    let (mut start, mut done) = (0, 0);
    for (row, here) in work.iter().enumerate() {
        done += here;
        let share = total * (bands.len() as u64 + 1) / count as u64;
        if done >= share && bands.len() + 1 < count {
            bands.push(start..row + 1);
            start = row + 1;
        }
    }
    if start < work.len() {
        bands.push(start..work.len());
    }
    bands
}
