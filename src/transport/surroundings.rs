//! The media that a point lies in.

use glam::DVec3;

use super::{MediumStack, Tracer};
use crate::geometry::Ray;

/// Surfaces crossed above the point before the search ends.
const MAX_CROSSINGS: usize = 100_000;

/// Media around a point, outermost first: bodies that an upward ray leaves more often than it enters. Upward, so that
/// an open sheet of water with its normals up counts as the water below it.
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
    // An inside-out body is left before it is entered: the point is not inside it.
    let mut is_within = |object: &usize| {
        let is_balanced = entered[*object] > 0;
        entered[*object] -= u32::from(is_balanced);
        !is_balanced
    };
    left_from_inside.retain(&mut is_within);
    // The body that is left first is innermost.
    left_from_inside
        .into_iter()
        .rev()
        .fold(MediumStack::default(), |media, object| media.entered(object))
}
