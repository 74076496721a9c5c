//! The media that a point lies in.

use glam::DVec3;

use super::{MediumStack, Tracer};
use crate::geometry::Ray;

/// Surfaces that are looked at above the point before it is taken to be outside of all others.
const MAX_CROSSINGS: usize = 100_000;

/// The media around a point: bodies of which a ray straight up leaves the inside more often than it enters, outermost
/// first. Straight up, so that an open sheet of water with its normals up counts as what lies below it.
pub fn media_at(tracer: &Tracer, point: DVec3) -> MediumStack {
    let scene = tracer.scene();
    let mut entered = vec![0u32; scene.objects.len()];
    let mut left_from_inside = Vec::new();
    let mut ray = Ray {
        origin: point,
        direction: DVec3::Y,
    };
    for _ in 0..MAX_CROSSINGS {
        let Some(hit) = tracer.closest_hit(&ray) else {
            break;
        };
        if scene.material_of(hit.object).is_solid() {
            if hit.geometric_normal.dot(ray.direction) < 0.0 {
                entered[hit.object] += 1;
            } else if entered[hit.object] > 0 {
                entered[hit.object] -= 1;
            } else {
                left_from_inside.push(hit.object);
            }
        }
        ray = hit.spawn(ray.direction);
    }
    // A body that is inside out is left before it is entered: the point is in neither.
    let mut is_within = |object: &usize| {
        let is_balanced = entered[*object] > 0;
        entered[*object] -= u32::from(is_balanced);
        !is_balanced
    };
    left_from_inside.retain(&mut is_within);
    // What is left first is innermost.
    left_from_inside
        .into_iter()
        .rev()
        .fold(MediumStack::default(), |media, object| media.entered(object))
}
