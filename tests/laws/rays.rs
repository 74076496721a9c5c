//! Rays against triangles where rounding decides, the bodies around a point, and chains of known radiance.

use nephroid::eye_pass::reference::{ReferenceSettings, render};
use nephroid::scene::Object;
use nephroid::transport::media_at;

use support::chain_laws;
use support::laws::Table;
use support::laws::scenes::Build;
use support::prelude::*;
use support::scenes::limited;
use support::tools::builtin_scene;

pub fn fill(t: &mut Table) {
    t.case("rays-at-edges-and-vertices")
        .check("none slips through", no_ray_slips_through);
    t.case("hits-closer-than-an-epsilon")
        .check("are found", close_hits);
    t.case("ray-that-leaves-a-surface")
        .check("does not meet it again", no_second_hit);
    t.case("bodies-around-a-point")
        .check("from the outermost inwards", nested_bodies);
    for (index, law) in chain_laws::all().iter().enumerate() {
        let name = law.name.replace(' ', "-");
        t.case(format!("chain-{name}"))
            .check("right, finite, and at an end", move || keeps_to_law(index));
    }
}

/// A picture by chains keeps to the law of its scene.
fn keeps_to_law(index: usize) {
    let law = chain_laws::all().swap_remove(index);
    let tracer = Tracer::new(Arc::new(law.scene.clone()));
    let settings = ReferenceSettings {
        samples_per_side: 1,
        ..limited(|limits| limits.branch_threshold = 1e-10)
    };
    let picture = render(&tracer, &[], &law.view, &settings, &(), &Default::default());
    law.assert_kept(&picture.expect("nobody cancels"), 1e-6);
}

/// Triangles of a ball around the origin.
fn sphere(levels: u32) -> Vec<[DVec3; 3]> {
    let mesh = shapes::sphere(DVec3::ZERO, 1.0, levels);
    (0..mesh.triangles.len())
        .map(|triangle| mesh.corners(triangle))
        .collect()
}

fn tracer(triangles: &[[DVec3; 3]]) -> Tracer {
    let mesh = Mesh {
        positions: triangles.concat(),
        normals: vec![DVec3::Y; 3 * triangles.len()],
        triangles: (0..triangles.len() as u32)
            .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
            .collect(),
        ..Mesh::default()
    };
    Tracer::new(Arc::new(Scene {
        objects: vec![Object::new("triangles", (0, 0), 0, mesh)],
        materials: vec![Material::default()],
        ..Scene::default()
    }))
}

fn towards(origin: DVec3, target: DVec3) -> Ray {
    Ray {
        origin,
        direction: (target - origin).normalize(),
    }
}

fn no_ray_slips_through() {
    let rotation = DMat3::from_axis_angle(dvec3(0.6, 0.0, 0.8), 0.7);
    let far = dvec3(3.1, -7.3, 0.9);
    for (scale, offset) in [
        (1.0, DVec3::ZERO),
        (1.0, far),
        (1e-4, far * 1e-4),
        (1e5, far),
        (1.0, far * 1e6),
    ] {
        let place = |p: DVec3| rotation * p * scale + offset;
        let triangles: Vec<_> = sphere(5).into_iter().map(|corners| corners.map(place)).collect();
        let tracer = tracer(&triangles);
        let origin = place(dvec3(0.21, -0.13, 0.34));
        for [a, b, c] in &triangles {
            for target in [*a, *b, (*a + *b) * 0.5, *b * 0.7 + *c * 0.3] {
                let ray = towards(origin, target);
                assert!(
                    tracer.intersect(&ray).is_some(),
                    "scale {scale}: a ray to {target}"
                );
                assert!(
                    tracer.is_blocked(&ray, 10.0 * scale),
                    "scale {scale}: a shadow ray to {target}"
                );
            }
        }
        assert!(4 * triangles.len() > 30_000);
    }
}

fn close_hits() {
    let square = |y: f64| {
        let [a, b, c, d] = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, z)| dvec3(x, y, z));
        [[a, b, c], [a, c, d]]
    };
    for gap in [1e-3, 1e-6, 1e-9, 1e-12] {
        let tracer = tracer(&[square(0.0), square(gap)].concat());
        let ray = Ray {
            origin: dvec3(0.3, 0.5 * gap, 0.2),
            direction: DVec3::Y,
        };
        let hit = tracer.intersect(&ray).expect("the upper square");
        assert!(
            (hit.distance_m - 0.5 * gap).abs() <= 1e-6 * gap,
            "gap {gap}: {hit:?}"
        );
    }
}

fn no_second_hit() {
    let scene = builtin_scene("ball");
    let ball = scene
        .objects
        .iter()
        .find(|object| object.name == "ball")
        .expect("the ball");
    let mesh = Arc::clone(ball.mesh_in_scene());
    let tracer = Tracer::new(Arc::new(scene));
    for triangle in (0..mesh.triangles.len()).step_by(97) {
        let [a, b, c] = mesh.corners(triangle);
        let normal = mesh.face_normal(triangle);
        let target = a * 0.2 + b * 0.5 + c * 0.3;
        let hit = tracer
            .closest_hit(&towards(target + normal * 0.1, target))
            .expect("the ball");
        for tilt in [
            DVec3::ZERO,
            (b - a).normalize() * 30.0,
            (c - a).normalize() * 3000.0,
        ] {
            if let Some(next) = tracer.closest_hit(&hit.spawn((normal + tilt).normalize())) {
                assert!(next.distance_m > 1e-6, "met again after {} m", next.distance_m);
            }
        }
    }
}

fn objects_around(scene: &Scene, point: DVec3) -> Vec<u32> {
    media_at(&Tracer::new(Arc::new(scene.clone())), point)
        .objects()
        .to_vec()
}

fn nested_bodies() {
    let ball = |radius_m| shapes::sphere(DVec3::ZERO, radius_m, 3);
    let scene = Scene::default().glass(1.5, ball(0.5)).glass(1.5, ball(0.3));
    let expected: [(f64, &[u32]); 5] = [(0.0, &[0, 1]), (-0.4, &[0]), (0.4, &[0]), (-1.0, &[]), (1.0, &[])];
    for (y, objects) in expected {
        assert_eq!(objects_around(&scene, dvec3(0.01, y, 0.02)), objects, "at {y} m");
    }
}
