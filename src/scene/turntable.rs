//! A camera path once around the object it looks at.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use super::{Camera, Scene};

/// [`turntable`] about the centre of the scene's bounding box.
pub fn around(scene: &Scene, camera: &Camera, frames: usize) -> Vec<Camera> {
    let pivot = scene
        .bounds()
        .map_or(DVec3::ZERO, |(low, high)| 0.5 * (low + high));
    turntable(camera, pivot, frames)
}

/// One camera per frame. The first is `camera`; each further one is rotated about the vertical axis through `pivot`,
/// clockwise as seen from above, by another of the equal steps of a full turn. One more step would give the first
/// again.
///
/// Position and viewing direction rotate together, which keeps the composition: a camera that looks past the axis still
/// does.
pub fn turntable(camera: &Camera, pivot: DVec3, frames: usize) -> Vec<Camera> {
    let turned = |frame: usize| {
        let turn = DQuat::from_rotation_y(-TAU * frame as f64 / frames as f64);
        Camera {
            name: format!("frame {}", frame + 1),
            position: pivot + turn * (camera.position - pivot),
            forward: turn * camera.forward,
            up: turn * camera.up,
            ..camera.clone()
        }
    };
    (0..frames).map(turned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_camera_sees_the_axis_as_the_first_does() {
        let pivot = DVec3::new(1.0, 2.0, -3.0);
        let first = Camera::look_at("first", DVec3::new(4.0, 3.0, -3.5), pivot, 0.8);
        let cameras = turntable(&first, pivot, 8);
        assert_eq!(cameras.len(), 8);
        let seen = |camera: &Camera, point: DVec3| {
            let offset = point - camera.position;
            DVec3::new(
                offset.dot(camera.right()),
                offset.dot(camera.up),
                offset.dot(camera.forward),
            )
        };
        for camera in &cameras {
            for height in [-1.0, 0.0, 2.0] {
                let point = pivot + height * DVec3::Y;
                assert!(seen(camera, point).distance(seen(&first, point)) < 1e-12);
            }
        }
        assert!(cameras[0].position.distance(first.position) < 1e-12);
        // After half a turn, it is on the opposite side.
        let across = (cameras[4].position + first.position) / 2.0;
        assert!((across - pivot).with_y(0.0).length() < 1e-12);
        // Clockwise from above: from +x, on the right, to +z, towards the viewer.
        let quarter = cameras[2].position - pivot;
        let start = first.position - pivot;
        assert!(start.cross(quarter).y < 0.0);
    }
}
