//! Cameras.

use glam::{DAffine3, DVec3};
use serde::{Deserialize, Serialize};

use super::animation::turned;
use crate::geometry::Frustum;

/// Full vertical field of view of a camera that frames a scene [rad].
const FRAMING_FOV_RAD: f64 = 0.8;

/// A perspective camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Name of the node in the file; `cameraN` without one.
    pub name: String,
    /// Scene coordinates [m].
    pub position: DVec3,
    /// Viewing direction, unit.
    pub forward: DVec3,
    /// Unit, perpendicular to `forward`.
    pub up: DVec3,
    /// Full vertical field of view [rad], (0, π).
    pub vertical_fov_rad: f64,
    /// Distance of the near plane [m], > 0.
    pub near_m: f64,
}

impl Camera {
    /// Whether its values are valid: finite, with orthonormal axes, field of view and near plane in range.
    pub fn is_sound(&self) -> bool {
        let is_unit = |axis: DVec3| (axis.length() - 1.0).abs() < 1e-6;
        let is_angle = self.vertical_fov_rad > 0.0 && self.vertical_fov_rad < std::f64::consts::PI;
        let is_near = self.near_m > 0.0 && self.near_m.is_finite();
        let is_square = self.forward.dot(self.up).abs() < 1e-6;
        self.position.is_finite()
            && is_unit(self.forward)
            && is_unit(self.up)
            && is_square
            && is_angle
            && is_near
    }

    /// A camera at `position` that looks at `target`, y up (z if it looks straight up or down).
    pub fn look_at(name: impl Into<String>, position: DVec3, target: DVec3, vertical_fov_rad: f64) -> Self {
        let forward = (target - position).normalize_or(DVec3::NEG_Z);
        let right = forward.cross(DVec3::Y).try_normalize().unwrap_or(DVec3::X);
        let near_m = 1e-3 * (target - position).length().max(1e-6);
        Self {
            name: name.into(),
            position,
            forward,
            up: right.cross(forward),
            vertical_fov_rad,
            near_m,
        }
    }

    /// A camera that sees a whole box obliquely from above, for any `aspect` = width/height of the picture.
    pub fn framing(name: impl Into<String>, (low, high): (DVec3, DVec3), aspect: f64) -> Self {
        let centre = 0.5 * (low + high);
        let radius_m = (0.5 * (high - low).length()).max(1e-6);
        let half_height: f64 = 0.5 * FRAMING_FOV_RAD;
        let half_width = (half_height.tan() * aspect).atan();
        let distance_m = radius_m / half_height.min(half_width).sin();
        let backward = DVec3::new(-0.5, 0.55, 0.67).normalize();
        Self::look_at(name, centre + backward * distance_m, centre, FRAMING_FOV_RAD)
    }

    /// Applies a transform and keeps the axes orthonormal.
    pub(super) fn carry(&mut self, carrying: &DAffine3) {
        self.position = carrying.transform_point3(self.position);
        let [forward, up] = [self.forward, self.up].map(|axis| turned(axis, carrying));
        if let Some(right) = forward.cross(up).try_normalize() {
            (self.forward, self.up) = (forward, right.cross(forward));
        }
    }

    /// Unit vector to the right of the picture.
    pub fn right(&self) -> DVec3 {
        self.forward.cross(self.up)
    }

    /// Unit direction through a point of the picture: x and y in [−1, 1] from left to right and bottom to top,
    /// `aspect` = width/height.
    pub fn direction(&self, x: f64, y: f64, aspect: f64) -> DVec3 {
        let half_height = (0.5 * self.vertical_fov_rad).tan();
        (self.forward + self.right() * (x * half_height * aspect) + self.up * (y * half_height)).normalize()
    }

    /// View frustum of a picture of `aspect` = width/height.
    pub fn frustum(&self, aspect: f64) -> Frustum {
        let half_height = (0.5 * self.vertical_fov_rad).tan();
        Frustum::new(
            self.position,
            self.forward,
            self.right() * (half_height * aspect),
            self.up * half_height,
            self.near_m,
        )
    }
}
