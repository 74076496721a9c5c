//! Totals of a deposit: flux on texels, past the edge of the map, beyond the chart, and of invalid triangles.

use crate::illumination::accumulator::FluxCount;

/// What became of the flux of triangles; the four sums together are exactly the flux that they carried.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CoverageReport {
    /// Counts that texels got.
    pub deposited: [i128; 3],
    /// Counts that fell beside the map's rectangle: light past the receiver's edge.
    pub outside: [i128; 3],
    /// Counts that fell where the chart covers nothing, too far from anything that it covers.
    pub unplaced: [i128; 3],
    /// Counts of triangles with a corner that is not finite.
    pub non_finite: [i128; 3],
}

impl CoverageReport {
    /// Adds what another deposit did.
    pub fn merge(&mut self, other: &Self) {
        for channel in 0..3 {
            self.deposited[channel] += other.deposited[channel];
            self.outside[channel] += other.outside[channel];
            self.unplaced[channel] += other.unplaced[channel];
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
