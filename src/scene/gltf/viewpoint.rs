//! Cameras.

use std::f64::consts::PI;

use glam::DVec3;
use gltf::json::Root;
use gltf::json::camera::{Camera as Source, Type};
use gltf::json::validation::Checked;

use super::nodes::Placed;
use super::numbers::widen;
use super::report::Report;
use crate::scene::Camera;

/// All perspective cameras of the placed nodes. What cannot be read is left out with a warning.
pub fn read_all(root: &Root, placed: &[Placed], report: &mut Report) -> Vec<Camera> {
    let mut cameras = Vec::new();
    for placed in placed {
        let Some(index) = root.nodes[placed.node].camera else {
            continue;
        };
        let source = root.cameras.get(index.value());
        let read = source.ok_or_else(|| format!("is camera {}, which does not exist", index.value()));
        match read.and_then(|source| read_one(source, placed)) {
            Ok(camera) => {
                let unnamed = placed.name == format!("node{}", placed.node);
                let name = if unnamed {
                    format!("camera{}", cameras.len())
                } else {
                    placed.name.clone()
                };
                cameras.push(Camera { name, ..camera });
            }
            Err(why) => report.warn(
                format!("camera `{}`", placed.name),
                format!("{why}; it was left out"),
                "repair the camera or choose another one",
            ),
        }
    }
    cameras
}

fn read_one(source: &Source, placed: &Placed) -> Result<Camera, String> {
    let perspective = match (&source.type_, &source.perspective) {
        (Checked::Valid(Type::Perspective), Some(perspective)) => perspective,
        (Checked::Valid(Type::Orthographic), _) => {
            return Err("is orthographic, which is not supported".into());
        }
        _ => return Err("has no perspective".into()),
    };
    let vertical_fov_rad = widen(perspective.yfov);
    if !(vertical_fov_rad > 0.0 && vertical_fov_rad < PI) {
        return Err(format!("has an angle of view of {vertical_fov_rad} rad"));
    }
    let near_m = widen(perspective.znear);
    if !(near_m > 0.0 && near_m.is_finite()) {
        return Err(format!("has a near plane at {near_m} m"));
    }
    let axis = |axis: DVec3| placed.world_from_node.transform_vector3(axis).try_normalize();
    let forward = axis(DVec3::NEG_Z);
    // Scaled or sheared nodes do not bend a camera: its axes are made perpendicular again.
    let right = axis(DVec3::Y)
        .zip(forward)
        .and_then(|(up, forward)| forward.cross(up).try_normalize());
    let (Some(forward), Some(right)) = (forward, right) else {
        return Err("has no direction, since its node is scaled to nothing".into());
    };
    Ok(Camera {
        name: String::new(),
        position: placed.world_from_node.translation,
        forward,
        up: right.cross(forward),
        vertical_fov_rad,
        near_m,
    })
}
