//! Selects the objects that stay instances of one mesh because copies would take too much memory.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};

use super::{Mesh, Object};

/// Largest total of triangles in the copies of one mesh; beyond it, the objects of the mesh are instances.
pub const MAX_COPIED: usize = 1 << 18;

/// Meshes with fewer triangles are copied, since a copy takes no more memory than an instance.
const MIN_SHARED: usize = 64;

/// Largest rounding error of a point in the coordinates of an instance, in radii of its mesh: far below the margins of
/// the hierarchy.
const ROUNDING: f64 = 1e-9;

/// Largest condition number of an instance's transform (Frobenius norm).
const MAX_SKEW: f64 = 1e3;

/// Farthest reach of a mesh from the origin of its coordinates, which are single precision on the device, in diagonals
/// of its bounding box.
const MAX_OFF_CENTRE: f64 = 64.0;

/// Whether each object is an instance: copies of its mesh would exceed `max_copied` triangles in total.
pub fn find(objects: &[Object], max_copied: usize) -> Vec<bool> {
    let mut uses: HashMap<*const Mesh, usize> = HashMap::new();
    for object in objects {
        *uses.entry(Arc::as_ptr(object.mesh())).or_default() += 1;
    }
    let is_instance = |object: &Object| {
        let uses = uses[&Arc::as_ptr(object.mesh())];
        let triangles = object.mesh().triangles.len();
        let is_many = uses > 1 && triangles >= MIN_SHARED && uses.saturating_mul(triangles) > max_copied;
        is_many && object.can_share()
    };
    objects.iter().map(is_instance).collect()
}

/// Whether a mesh can be traced and drawn in its own coordinates without loss. All its normals must have a moderate
/// length: others are computed from the triangles around the vertex.
pub(super) fn is_sound(mesh: &Mesh, transform: &DAffine3) -> bool {
    let Some((low, high)) = mesh.bounds().filter(|_| !mesh.triangles.is_empty()) else {
        return false;
    };
    let is_moderate = |vector: &DVec3| (1e-6..1e6).contains(&vector.length());
    let size = |linear: DMat3| {
        linear
            .to_cols_array()
            .map(|entry| entry * entry)
            .iter()
            .sum::<f64>()
            .sqrt()
    };
    let linear = transform.matrix3;
    let (stretch, shrink) = (size(linear), size(linear.inverse()));
    let (reach, diagonal) = (low.abs().max(high.abs()).length(), (high - low).length());
    let farthest = stretch * reach + transform.translation.length();
    // Also false for NaN.
    shrink * farthest * f64::EPSILON < ROUNDING * 0.5 * diagonal
        && stretch * shrink < MAX_SKEW
        && reach <= MAX_OFF_CENTRE * diagonal
        && [linear.x_axis, linear.y_axis, linear.z_axis]
            .iter()
            .all(is_moderate)
        && mesh.normals.iter().all(is_moderate)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DAffine3, DVec3};

    use super::{find, is_sound};
    use crate::scene::builtin::shapes;
    use crate::scene::{Mesh, Object};

    #[test]
    fn only_what_loses_nothing_is_shared() {
        let ball = shapes::sphere(DVec3::ZERO, 1.0, 2);
        let sound = |transform: DAffine3| is_sound(&ball, &transform);
        assert!(sound(DAffine3::from_translation(DVec3::splat(1e5))));
        assert!(!sound(DAffine3::from_translation(DVec3::splat(1e9))));
        assert!(sound(DAffine3::from_scale(DVec3::splat(1e-3))));
        assert!(!sound(DAffine3::from_scale(DVec3::new(1.0, 1e-4, 1.0))));
        assert!(!sound(DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0))));
        let without_normals = Mesh {
            normals: vec![DVec3::ZERO; ball.normals.len()],
            ..ball.clone()
        };
        for (mesh, is_shared) in [(ball, true), (without_normals, false)] {
            let mesh = Arc::new(mesh);
            let objects = [0, 1].map(|node| Object::new("ball", (node, 0), 0, Arc::clone(&mesh)));
            assert_eq!(find(&objects, 639), [is_shared; 2]);
            assert_eq!(find(&objects, 640), [false; 2]);
            assert_eq!(find(&objects[..1], 0), [false]);
        }
    }
}
