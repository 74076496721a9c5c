//! Objects that share a mesh are lit as copies of it are.

use glam::DAffine3;
use nephroid::scene::Object;
use nephroid::scene::instances::{MAX_COPIED, find};

use crate::prelude::*;
use support::tools::{bake, caustic, energy_fault, map_of, photons, to};

/// Four glass balls over a floor: of one mesh, which is too large for copies, or each of its own.
fn balls(is_shared: bool) -> Scene {
    let mut scene = built_in("ball");
    let is_ball = |object: &Object| object.name == "ball";
    let found = scene.objects.iter().position(is_ball).expect("a ball");
    let (material, middle) = (scene.objects[found].material, scene.pivot(found));
    scene.objects.remove(found);
    let mesh = Arc::new(shapes::sphere(DVec3::ZERO, 0.5, 6));
    for (node, size) in [(0, 0.2), (1, 0.3), (2, 0.25), (3, 0.35)] {
        let mut ball = Object::new(format!("ball{node}"), (node, 0), material, Arc::clone(&mesh));
        let sign = if node == 2 { -1.0 } else { 1.0 };
        let scale = DVec3::new(sign, 1.2, 0.9) * size;
        let turn = DQuat::from_rotation_x(0.4 * f64::from(node as u32));
        let aside = DVec3::new(0.3 * (node as f64 - 1.5), 0.0, 0.0);
        ball.place(DAffine3::from_scale_rotation_translation(
            scale,
            turn,
            middle + aside,
        ));
        if !is_shared {
            ball.mesh_in_scene_mut();
        }
        scene.objects.push(ball);
    }
    let instances = find(&scene.objects, MAX_COPIED);
    let instances = instances.iter().filter(|is_instance| **is_instance);
    assert_eq!(instances.count(), if is_shared { 4 } else { 0 });
    scene
}

#[test]
fn instances_are_lit_as_copies_are() {
    for settings in [to(0.03, 32), photons(1e5, 32)] {
        let [copied, shared] = [false, true].map(|is_shared| {
            let scene = balls(is_shared);
            let result = bake(scene.clone(), &settings);
            assert_eq!(energy_fault(&result), None);
            caustic(map_of(&result, &scene, "floor"))
        });
        let most = copied.iter().copied().fold(0.0, f64::max);
        assert!(most > 0.0);
        for (was, is) in copied.iter().zip(&shared) {
            near(*is, *was, 1e-6 * most, settings.estimator);
        }
    }
}
