//! Projects points of the scene to the picture, and pixels back to view rays.

use egui::{Pos2, Rect, vec2};
use glam::DVec3;

use crate::geometry::Ray;
use crate::scene::Camera;

/// A camera and the rectangle of its picture.
#[derive(Clone, Copy, Debug)]
pub struct Viewport<'a> {
    /// Its vertical field of view is that of the picture's height.
    pub camera: &'a Camera,
    /// Rectangle of the picture in the window [points].
    pub picture: Rect,
}

impl Viewport<'_> {
    /// Distance along the view axis [m].
    pub fn depth_m(&self, point: DVec3) -> f64 {
        (point - self.camera.position).dot(self.camera.forward)
    }

    /// Whether a point is in front of the near plane, so that it can be projected.
    pub fn is_before(&self, point: DVec3) -> bool {
        self.depth_m(point) > self.camera.near_m
    }

    /// Projection of a point in front of the near plane; may lie outside the picture.
    pub fn project(&self, point: DVec3) -> Pos2 {
        let offset = point - self.camera.position;
        let scale = 1.0 / self.m_per_point(point);
        let (x, y) = (offset.dot(self.camera.right()), offset.dot(self.camera.up));
        self.picture.center() + vec2((scale * x) as f32, (-scale * y) as f32)
    }

    /// Length at the depth of `point` that projects to one point of the picture [m].
    pub fn m_per_point(&self, point: DVec3) -> f64 {
        let half_height_m = (0.5 * self.camera.vertical_fov_rad).tan() * self.depth_m(point);
        half_height_m / (0.5 * f64::from(self.picture.height()))
    }

    /// Projection of a line segment, clipped at the near plane; `None` if it is behind it.
    pub fn line(&self, from: DVec3, to: DVec3) -> Option<[Pos2; 2]> {
        let near = self.camera.near_m;
        let depths = [from, to].map(|point| self.depth_m(point) - near);
        let cut = || from + (to - from) * (depths[0] / (depths[0] - depths[1]));
        match depths.map(|depth| depth >= 0.0) {
            [true, true] => Some([from, to]),
            [true, false] => Some([from, cut()]),
            [false, true] => Some([cut(), to]),
            [false, false] => None,
        }
        .map(|ends| ends.map(|end| self.project(end)))
    }

    /// The view ray through a point of the picture.
    pub fn view_ray(&self, at: Pos2) -> Ray {
        let picture = self.picture;
        let share = |at: f32, from: f32, length: f32| 2.0 * f64::from((at - from) / length) - 1.0;
        let across = share(at.x, picture.left(), picture.width());
        let down = share(at.y, picture.top(), picture.height());
        let aspect = f64::from(picture.aspect_ratio());
        Ray {
            origin: self.camera.position,
            direction: self.camera.direction(across, -down, aspect),
        }
    }
}
