//! Follows one light ray to the texel's surface.

use glam::DVec2;

use super::Limits;
use super::target::Target;
use crate::geometry::Ray;
use crate::light_pass::path::{Arrival, PathLimits, PathSignature, PathTracer, PathVertex, Segment};
use crate::light_pass::photon::launch::PhotonLaunch;
use crate::transport::Tracer;

/// A complete path.
#[derive(Clone, Debug)]
pub(super) struct WalkedPath {
    /// At the light.
    pub(super) start: Ray,
    pub(super) vertices: Vec<PathVertex>,
    pub(super) end: Arrival,
    /// Where it ends, relative to the texel's corner [texels].
    pub(super) place: DVec2,
}

/// Traces the light of one point of a lamp to one target.
pub(super) struct LightPathWalker<'a> {
    pub(super) tracer: &'a Tracer,
    pub(super) launch: &'a PhotonLaunch<'a>,
    /// In the lamp's unit square.
    pub(super) lamp: DVec2,
    pub(super) target: &'a Target,
    pub(super) limits: Limits,
}

impl LightPathWalker<'_> {
    /// The path of a ray that has the wanted signature; `None` if the ray takes no such path.
    pub(super) fn way(&self, root: usize, square: DVec2, wanted: PathSignature) -> Option<WalkedPath> {
        let start = self.launch.start_at(root, square, self.lamp)?.ray;
        let mut found = None;
        self.walk(root, square, |end, place, segment| {
            if end.signature == wanted {
                let vertices = segment.vertices();
                found = Some(WalkedPath {
                    start,
                    vertices,
                    end,
                    place,
                });
            }
        });
        found
    }

    /// Passes each arrival of a ray at the receiver to `arrive`, with its place relative to the texel's corner [texels]
    /// and the segment on which it came. Flux is per unit square of the root.
    pub(super) fn walk(&self, root: usize, square: DVec2, mut arrive: impl FnMut(Arrival, DVec2, &Segment)) {
        let Some(start) = self.launch.start_at(root, square, self.lamp) else {
            return;
        };
        let limits = PathLimits::smooth(self.limits.max_depth, self.limits.branch_threshold);
        let mut paths = PathTracer::without_ledger(self.tracer, limits).with_vertices();
        paths.trace(start.ray, start.flux_w, &start.media, |arrival, segment| {
            if arrival.receiver == self.target.receiver {
                let place = self.target.landing(&segment.ray, &arrival);
                arrive(arrival, place, segment);
            }
        });
    }
}
