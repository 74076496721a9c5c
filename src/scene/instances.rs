//! Which objects are instances: objects of one mesh whose copies would take too much memory.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};

use super::{Mesh, Object};

/// Triangles that copies of one mesh may have in all; of a mesh with more, each of its objects is an instance.
pub const MAX_COPIED: usize = 1 << 18;

/// Copies of meshes with fewer triangles take no more than what an instance takes.
const MIN_SHARED: usize = 64;

/// Rounding of places on their way into the coordinates of an instance, in radii of its mesh: far below the margins of the
/// hierarchy.
const ROUNDING: f64 = 1e-9;

/// Instances are not flattened more than this, as a share of their extents.
const MAX_SKEW: f64 = 1e3;

/// Nor are they scaled so much that squares of lengths leave the range of numbers.
const MAX_SCALE: f64 = 1e30;

/// Which objects are instances: those of meshes whose copies would have many triangles.
pub fn find(objects: &[Object], most_copied: usize) -> Vec<bool> {
    let mut uses: HashMap<*const Mesh, usize> = HashMap::new();
    for object in objects {
        *uses.entry(Arc::as_ptr(object.mesh())).or_default() += 1;
    }
    let is_many = |object: &Object| {
        let uses = uses[&Arc::as_ptr(object.mesh())];
        let triangles = object.mesh().triangles.len();
        uses > 1 && triangles >= MIN_SHARED && uses.saturating_mul(triangles) > most_copied
    };
    let mut boxes: HashMap<*const Mesh, Option<(DVec3, DVec3)>> = HashMap::new();
    let mut is_instance = |object: &Object| {
        let mesh = object.mesh();
        let bounds = boxes.entry(Arc::as_ptr(mesh));
        let bounds = *bounds.or_insert_with(|| shared_box(mesh));
        bounds.is_some_and(|bounds| is_sound(object.world_from_object(), bounds))
    };
    let objects = objects.iter();
    objects
        .map(|object| is_many(object) && is_instance(object))
        .collect()
}

/// Whether an object loses nothing as an instance.
pub fn is_possible(object: &Object) -> bool {
    shared_box(object.mesh()).is_some_and(|bounds| is_sound(object.world_from_object(), bounds))
}

/// Box [m] of a mesh that instances can share. Normals of others come from all the triangles around a vertex.
pub fn shared_box(mesh: &Mesh) -> Option<(DVec3, DVec3)> {
    let is_sound = |normal: &DVec3| (1e-6..1e6).contains(&normal.length());
    let is_shared = !mesh.triangles.is_empty() && mesh.normals.iter().all(is_sound);
    mesh.bounds().filter(|_| is_shared)
}

/// Whether rays can be brought into the coordinates of a mesh with these bounds without loss.
pub fn is_sound(transform: &DAffine3, (low, high): (DVec3, DVec3)) -> bool {
    let inverse = transform.inverse();
    let size = |linear: DMat3| {
        linear
            .to_cols_array()
            .map(|entry| entry * entry)
            .iter()
            .sum::<f64>()
            .sqrt()
    };
    let (stretch, shrink) = (size(transform.matrix3), size(inverse.matrix3));
    let farthest = stretch * low.abs().max(high.abs()).length() + transform.translation.length();
    let radius = 0.5 * (high - low).length();
    // Also false where a number is not one.
    shrink * farthest * f64::EPSILON < ROUNDING * radius
        && stretch * shrink < MAX_SKEW
        && (1.0 / MAX_SCALE..MAX_SCALE).contains(&stretch)
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
        let bounds = (DVec3::NEG_ONE, DVec3::ONE);
        let sound = |transform: DAffine3| is_sound(&transform, bounds);
        assert!(sound(DAffine3::from_translation(DVec3::splat(1e5))));
        assert!(!sound(DAffine3::from_translation(DVec3::splat(1e9))));
        assert!(sound(DAffine3::from_scale(DVec3::splat(1e-3))));
        assert!(!sound(DAffine3::from_scale(DVec3::new(1.0, 1e-4, 1.0))));
        assert!(!sound(DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0))));
        let ball = shapes::sphere(DVec3::ZERO, 1.0, 2);
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
