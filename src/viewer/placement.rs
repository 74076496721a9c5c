//! Where the parts of a node stand: turned about the vertical, and moved from their places in the file.

use glam::{DQuat, DVec3};

use crate::scene::changes::Motion;
use crate::scene::{Edit, Scene};

/// What is read off meshes is rounded to so many steps [1/m, 1/rad]: what was typed, and not what rounding made of it.
const STEPS: f64 = 1e9;
/// A turn is about the vertical where its quaternion's other parts are smaller.
const TILT: f64 = 1e-5;

/// Of all parts of a node together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placement {
    /// About the vertical through the middle of the node's box in the file, from z towards x [rad], (−π, π].
    pub yaw_rad: f64,
    /// [m]
    pub offset_m: DVec3,
}

impl Placement {
    /// How an object's node stands; `None` where its shape is another one, or it was tilted.
    pub fn of(object: usize, loaded: &Scene, now: &Scene) -> Option<Self> {
        let before = loaded.objects.get(object)?.mesh_in_scene();
        let after = now.objects.get(object)?.mesh_in_scene();
        let Some(motion) = Motion::between(before, after)? else {
            return Some(Self::default());
        };
        let turn = motion.rotation;
        if turn.x.hypot(turn.z) > TILT {
            return None;
        }
        let half_turns = (2.0 * turn.y.atan2(turn.w)) / std::f64::consts::TAU;
        let yaw_rad = (half_turns - half_turns.round()) * std::f64::consts::TAU;
        let lever = Motion::centre(before) - middle(object, loaded);
        let rounded = |value: f64| (value * STEPS).round() / STEPS;
        let offset_m = motion.translation + lever - turn * lever;
        Some(Self {
            yaw_rad: rounded(yaw_rad),
            offset_m: offset_m.map(rounded),
        })
    }

    /// The edit that puts all parts of an object's node there.
    pub fn edit(&self, object: usize, loaded: &Scene) -> Edit {
        let node = loaded.objects[object].node;
        let turn = DQuat::from_rotation_y(self.yaw_rad);
        let pivot = middle(object, loaded);
        let parts = loaded.objects.iter().enumerate();
        let parts = parts.filter(|(_, part)| part.node == node);
        let edits: Vec<Edit> = parts
            .map(|(index, part)| {
                if self.yaw_rad == 0.0 {
                    Edit::object_at(index, part.mesh_in_scene(), self.offset_m)
                } else {
                    Edit::object_turned(index, part.mesh_in_scene(), (turn, pivot), self.offset_m)
                }
            })
            .collect();
        match <[Edit; 1]>::try_from(edits) {
            Ok([alone]) => alone,
            Err(several) => Edit::Several(several),
        }
    }

    /// The middle of the node's box in the file, where this puts it [m].
    pub fn middle_m(&self, object: usize, loaded: &Scene) -> DVec3 {
        middle(object, loaded) + self.offset_m
    }
}

/// Of the box around all parts of an object's node.
fn middle(object: usize, loaded: &Scene) -> DVec3 {
    let node = loaded.objects[object].node;
    let parts = loaded.objects.iter().filter(|part| part.node == node);
    let bounds = parts
        .filter_map(|part| part.mesh_in_scene().bounds())
        .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    bounds.map_or(DVec3::ZERO, |(low, high)| 0.5 * (low + high))
}
