//! Deposits flux-carrying triangles into a map by exact area coverage.
//!
//! Texels are taken row by row, from left to right. Each gets the difference of two rounded cumulative shares of the
//! triangle's flux, so that the whole is exact to the last count; as the share above a row has a closed form, any
//! row can be had without those before it, and rows are the unit that threads divide among themselves.

mod area;
mod bands;
mod bins;
mod line;
mod report;
mod row;
mod shape;
mod sides;
mod tiles;

use glam::DVec2;

use super::receiver_maps::ReceiverMap;
use crate::illumination::accumulator::FluxCount;

pub use report::CoverageReport;

/// A piece of a bundle on a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluxTriangle {
    /// Texel coordinates: x across, y down; texel (i, j) covers [i, i + 1] × [j, j + 1]. May lie partly or wholly
    /// outside the map, with either winding. Should be finite.
    pub corners: [DVec2; 3],
    /// Non-negative counts, spread evenly over the triangle's area.
    pub flux: FluxCount,
    /// Island of the chart that the triangle lies on (`ReceiverMap::island`); 0 where there is only one.
    pub island: u32,
}

/// Adds triangles to a map and reports what became of their flux.
///
/// The counts in the map depend neither on the order of the triangles, nor on how they are divided into calls, nor on
/// the number of threads. The sums of all flux must stay below 2⁶³ counts, as [`FluxUnit`] sees to.
///
/// [`FluxUnit`]: crate::illumination::accumulator::FluxUnit
pub fn deposit_triangles(triangles: &[FluxTriangle], map: &mut ReceiverMap) -> CoverageReport {
    if let Some(layout) = map.chart.layout.clone() {
        return tiles::deposit(triangles, &layout, map.level(0).0.texels_mut());
    }
    let (flux, coverage) = map.level(0);
    let size = (flux.width(), flux.height());
    bands::deposit(triangles, size, flux.texels_mut(), &coverage)
}
