//! Which bodies a point is inside of.

use std::sync::Arc;

use glam::DVec3;
use nephroid::scene::Scene;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::transport::{Tracer, media_at};

fn within(scene: &Scene, point: DVec3) -> Vec<u32> {
    media_at(&Tracer::new(Arc::new(scene.clone())), point)
        .objects()
        .to_vec()
}

#[test]
fn bodies_around_a_point_are_known_from_the_outermost_inwards() {
    let mut scene = Scene::default();
    for radius_m in [0.5, 0.3] {
        let ball = shapes::sphere(DVec3::ZERO, radius_m, 3);
        parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    }
    let at = |y: f64| within(&scene, DVec3::new(0.01, y, 0.02));
    assert_eq!(at(0.0), [0, 1]);
    assert_eq!(at(-0.4), [0]);
    assert_eq!(at(0.4), [0]);
    assert!(at(-1.0).is_empty() && at(1.0).is_empty());
}

#[test]
fn a_body_that_is_inside_out_is_around_nothing_below_it() {
    let mut scene = Scene::default();
    let mut ball = shapes::sphere(DVec3::ZERO, 0.5, 3);
    ball.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    assert!(within(&scene, DVec3::new(0.01, -1.0, 0.02)).is_empty());
}
