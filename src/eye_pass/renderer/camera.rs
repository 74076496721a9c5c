//! The camera as a matrix.

use glam::{DMat4, DVec3, DVec4};

use crate::eye_pass::View;

/// Clip from world axes with the camera at the origin: perspective with depth near/distance, so that it is 1 at the
/// near plane, 0 infinitely far, and floats resolve all distances alike.
pub(super) fn clip_from_camera(view: &View) -> [[f32; 4]; 4] {
    let camera = &view.camera;
    let aspect = f64::from(view.width) / f64::from(view.height);
    let focal = 1.0 / (0.5 * camera.vertical_fov_rad).tan();
    let x = camera.right() * (focal / aspect);
    let y = camera.up * focal;
    let rows = [
        x.extend(0.0),
        y.extend(0.0),
        DVec4::new(0.0, 0.0, 0.0, camera.near_m),
        camera.forward.extend(0.0),
    ];
    DMat4::from_cols_array_2d(&rows.map(|row| row.to_array()))
        .transpose()
        .as_mat4()
        .to_cols_array_2d()
}

/// A point in single precision [m].
pub(super) fn single(point: DVec3) -> [f32; 3] {
    point.as_vec3().to_array()
}
