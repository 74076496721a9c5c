//! A scene far from the world's origin, moved to its own.

use std::sync::Arc;

use crate::scene::Scene;

/// A scene whose middle is farther away than this many of its own extents would lose digits.
const FAR_IN_EXTENTS: f64 = 16.0;

/// Makes the middle of a far scene its origin, and leaves any other scene alone.
pub fn rebase(scene: &mut Scene) {
    let Some((low, high)) = scene.bounds() else {
        return;
    };
    let centre = 0.5 * (low + high);
    if centre.length() <= FAR_IN_EXTENTS * (high - low).length() {
        return;
    }
    scene.origin_world = centre;
    for position in scene
        .objects
        .iter_mut()
        .flat_map(|object| &mut Arc::make_mut(&mut object.mesh).positions)
    {
        *position -= centre;
    }
    for light in &mut scene.lights {
        light.kind = light.kind.moved(-centre);
    }
    for material in &mut scene.materials {
        material.waves = material.waves.as_ref().map(|waves| waves.with_origin(centre));
    }
    for camera in &mut scene.cameras {
        camera.position -= centre;
    }
}
