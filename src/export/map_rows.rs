//! Rows of a map's file, made one at a time: files are dense, however the map is kept.

use crate::illumination::Chart;

/// Gives the rows of a file of some size from the values of a chart's texels.
#[derive(Clone, Copy, Debug)]
pub struct MapRows<'a> {
    chart: &'a Chart,
    /// Texels across and down the file.
    size: (usize, usize),
}

impl<'a> MapRows<'a> {
    /// For a file of a chart's size, or a larger one where the map had to be made coarser.
    pub fn new(chart: &'a Chart, size: (usize, usize)) -> Self {
        Self { chart, size }
    }

    /// One row; `value` gives that of a texel of the chart. A texel of the file gets the mean over what it covers, so that
    /// all of them together hold the flux of the map.
    pub fn row(&self, row: usize, value: impl Fn(usize) -> f32) -> Vec<f32> {
        let (width, height) = (self.chart.width, self.chart.height);
        if let Some(layout) = &self.chart.layout {
            return layout.row_texels(row).map(value).collect();
        }
        if (width, height) == self.size {
            return (row * width..(row + 1) * width).map(value).collect();
        }
        let rows = shares(row, self.size.1, height);
        let mean = |column: usize| {
            let mut sum = 0.0;
            for (from, part) in shares(column, self.size.0, width) {
                for &(row, height) in &rows {
                    sum += part * height * f64::from(value(row * width + from));
                }
            }
            sum as f32
        };
        (0..self.size.0).map(mean).collect()
    }
}

/// Which of `coarse` cells of a line one of `fine` cells covers, and with which part of itself.
pub(super) fn shares(index: usize, fine: usize, coarse: usize) -> Vec<(usize, f64)> {
    // In units that are a whole number of both.
    let (begin, end) = (index * coarse, (index + 1) * coarse);
    let part = |cell: usize| end.min((cell + 1) * fine) - begin.max(cell * fine);
    (begin / fine..end.div_ceil(fine).min(coarse))
        .map(|cell| (cell, part(cell) as f64 / coarse as f64))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_a_line_add_up() {
        for (fine, coarse) in [(5, 3), (8, 2), (7, 7), (100, 13)] {
            let mut got = vec![0.0; coarse];
            for index in 0..fine {
                let shares = shares(index, fine, coarse);
                let all: f64 = shares.iter().map(|(_, part)| part).sum();
                assert!((all - 1.0).abs() < 1e-12, "{fine} of {coarse}: {all}");
                for (cell, part) in shares {
                    got[cell] += part;
                }
            }
            let whole = fine as f64 / coarse as f64;
            assert!(got.iter().all(|part| (part - whole).abs() < 1e-12), "{got:?}");
        }
    }
}
