//! The view frustum of a perspective camera.

use glam::DVec3;

/// Rounding of a box and a camera, as a share of the largest of their coordinates: pictures are drawn in single
/// precision.
const SLACK: f64 = 1e-5;

/// The pyramid that a perspective camera sees, from its near plane to infinity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    eye: DVec3,
    /// Unit; what is seen lies on their side of the eye.
    sides: [DVec3; 4],
    /// Unit.
    forward: DVec3,
    /// [m].
    near_m: f64,
}

impl Frustum {
    /// A pyramid with its tip at `eye` around the unit vector `forward`. `right` and `up`, perpendicular to it and to
    /// each other, are as long as the tangents of half the angles of view.
    pub fn new(eye: DVec3, forward: DVec3, right: DVec3, up: DVec3, near_m: f64) -> Self {
        let side = |across: DVec3| {
            // Perpendicular to the edge ray `forward + across`, towards the middle.
            (forward * across.length_squared() - across).normalize_or(forward)
        };
        Self {
            eye,
            sides: [side(right), side(-right), side(up), side(-up)],
            forward,
            near_m,
        }
    }

    /// Whether a box may be seen, given by its minimum and maximum corner [m]. Never false for one that is seen; true
    /// for some that lie just outside the pyramid's edges.
    pub fn may_see(&self, (low, high): (DVec3, DVec3)) -> bool {
        let slack_m = SLACK * low.abs().max(high.abs()).max(self.eye.abs()).length();
        let (low, high) = (low - self.eye, high - self.eye);
        let farthest = |normal: DVec3| (normal * low).max(normal * high).element_sum();
        farthest(self.forward) >= self.near_m - slack_m
            && self.sides.iter().all(|side| farthest(*side) >= -slack_m)
    }
}
