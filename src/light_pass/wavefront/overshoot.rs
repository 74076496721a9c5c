//! Patches that land where none of their traced rays did: near silhouettes and foci, cubic interpolation may overshoot.
//! Refinement of those places divides the cells of these patches.

use crate::illumination::Receiver;
use glam::DVec2;

use super::coverage::FluxTriangle;

/// Tolerated distance of light from where the traced rays land [texels].
const TOLERATED_TEXELS: f64 = 8.0;

/// A patch that reaches farther than its traced rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchOvershoot {
    /// Face of the launch domain.
    pub face: u32,
    /// Middle of the patch in the unit square.
    pub middle: DVec2,
    /// Receiver of the map that it reaches.
    pub receiver: Receiver,
    /// Low corner of the bounding box of its light on the map [texels].
    pub low: DVec2,
    /// High corner of the bounding box [texels].
    pub high: DVec2,
}

impl PatchOvershoot {
    /// Of a patch with the given triangles on one map, whose traced rays land at `traced` [texels]; `None` where it
    /// stays close to them.
    pub fn of(
        face: u32,
        middle: DVec2,
        receiver: Receiver,
        triangles: &[FluxTriangle],
        traced: impl Iterator<Item = DVec2>,
    ) -> Option<Self> {
        let (low, high) = bounds(triangles.iter().flat_map(|triangle| triangle.corners));
        let (traced_low, traced_high) = bounds(traced);
        let keeps = low.cmpge(traced_low - TOLERATED_TEXELS).all()
            && high.cmple(traced_high + TOLERATED_TEXELS).all();
        (!triangles.is_empty() && !keeps).then_some(Self {
            face,
            middle,
            receiver,
            low,
            high,
        })
    }
}

fn bounds(points: impl Iterator<Item = DVec2>) -> (DVec2, DVec2) {
    points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), point| {
        (low.min(point), high.max(point))
    })
}
