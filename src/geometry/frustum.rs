//! The view frustum of a perspective camera.

use glam::DVec3;

/// Rounding of boxes and the camera, relative to their largest coordinate: pictures are drawn in single precision.
const SLACK: f64 = 1e-5;

/// View frustum of a perspective camera, from its near plane to infinity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    eye: DVec3,
    /// Unit normals through the eye that point inwards.
    sides: [DVec3; 4],
    /// Unit.
    forward: DVec3,
    near_m: f64,
}

impl Frustum {
    /// A frustum with its apex at `eye` around the unit vector `forward`. `right` and `up`, perpendicular to it and to
    /// each other, are as long as the tangents of half the angles of view.
    pub fn new(eye: DVec3, forward: DVec3, right: DVec3, up: DVec3, near_m: f64) -> Self {
        let side = |across: DVec3| {
            // Perpendicular to the edge ray `forward + across`, pointing inwards.
            (forward * across.length_squared() - across).normalize_or(forward)
        };
        Self {
            eye,
            sides: [side(right), side(-right), side(up), side(-up)],
            forward,
            near_m,
        }
    }

    /// Whether a box, given by its minimum and maximum corner [m], may be visible. Conservative: true for some boxes
    /// just outside the edges of the frustum.
    pub fn may_see(&self, (low, high): (DVec3, DVec3)) -> bool {
        let slack_m = SLACK * low.abs().max(high.abs()).max(self.eye.abs()).length();
        let (low, high) = (low - self.eye, high - self.eye);
        let farthest = |normal: DVec3| (normal * low).max(normal * high).element_sum();
        farthest(self.forward) >= self.near_m - slack_m
            && self.sides.iter().all(|side| farthest(*side) >= -slack_m)
    }
}
