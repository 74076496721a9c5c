//! Totals of a deposit: flux on texels, beside the chart, and of invalid triangles.

use crate::illumination::accumulator::FluxCount;

/// What became of the flux of triangles. The three sums add up exactly to the flux of the triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CoverageReport {
    /// Counts on texels.
    pub deposited: [i128; 3],
    /// Counts beside the map's rectangle, and on texels that the triangle's island does not cover.
    pub outside: [i128; 3],
    /// Counts of triangles with a non-finite corner.
    pub non_finite: [i128; 3],
}

impl CoverageReport {
    /// Adds the sums of another deposit.
    pub fn merge(&mut self, other: &Self) {
        for channel in 0..3 {
            self.deposited[channel] += other.deposited[channel];
            self.outside[channel] += other.outside[channel];
            self.non_finite[channel] += other.non_finite[channel];
        }
    }
}

/// Adds counts to an exact sum.
pub(super) fn book(sum: &mut [i128; 3], flux: FluxCount) {
    for channel in 0..3 {
        sum[channel] += i128::from(flux[channel]);
    }
}
