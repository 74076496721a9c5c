//! Rays against triangles where rounding decides.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use nephroid::geometry::{Ray, TriangleBvh};
use nephroid::scene::{Scene, builtin};
use nephroid::transport::{MediumStack, Tracer};

fn all_triangles(scene: &Scene, name: &str) -> Vec<[DVec3; 3]> {
    let object = scene
        .objects
        .iter()
        .find(|object| object.name == name)
        .expect("the object");
    (0..object.mesh.triangles.len())
        .map(|triangle| object.mesh.corners(triangle))
        .collect()
}

/// A few thousand triangles that close around their centre: the triangulated unit octahedron, pushed onto a sphere.
fn sphere(levels: u32) -> Vec<[DVec3; 3]> {
    let mut triangles = Vec::new();
    for signs in 0..8_u32 {
        let axis = |bit: u32, axis: DVec3| if signs >> bit & 1 == 1 { axis } else { -axis };
        triangles.push([axis(0, DVec3::X), axis(1, DVec3::Y), axis(2, DVec3::Z)]);
    }
    for _ in 0..levels {
        triangles = triangles
            .into_iter()
            .flat_map(|[a, b, c]| {
                let (ab, bc, ca) = ((a + b).normalize(), (b + c).normalize(), (c + a).normalize());
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    triangles
}

#[test]
fn no_ray_slips_through_an_edge_or_a_vertex() {
    let (rotation, offset) = (
        DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7),
        DVec3::new(3.1, -7.3, 0.9),
    );
    for (scale, offset) in [
        (1.0, DVec3::ZERO),
        (1.0, offset),
        (1e-4, offset * 1e-4),
        (1e5, offset),
        (1.0, offset * 1e6),
    ] {
        let place = |p: DVec3| rotation * p * scale + offset;
        let triangles: Vec<_> = sphere(5).into_iter().map(|corners| corners.map(place)).collect();
        let bvh = TriangleBvh::build(&triangles);
        let origin = place(DVec3::new(0.21, -0.13, 0.34));
        let mut aimed = 0;
        for [a, b, c] in &triangles {
            for target in [*a, *b, (*a + *b) * 0.5, *b * 0.7 + *c * 0.3] {
                let ray = Ray {
                    origin,
                    direction: (target - origin).normalize(),
                };
                assert!(
                    bvh.closest_hit(&ray).is_some(),
                    "scale {scale}: a ray to {target} left the sphere"
                );
                assert!(
                    bvh.is_blocked(&ray, 10.0 * scale),
                    "scale {scale}: a shadow ray to {target} left the sphere"
                );
                aimed += 1;
            }
        }
        assert!(aimed > 30_000);
    }
}

#[test]
fn directions_with_zeros_of_either_sign_hit_what_lies_there() {
    let triangles = sphere(4);
    let bvh = TriangleBvh::build(&triangles);
    for zero in [0.0, -0.0] {
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let mut direction = DVec3::splat(zero);
                direction[axis] = sign;
                let hit = bvh
                    .closest_hit(&Ray {
                        origin: DVec3::ZERO,
                        direction,
                    })
                    .expect("a wall of the sphere");
                assert!((hit.distance_m - 1.0).abs() < 0.01, "{direction}: {hit:?}");
            }
        }
    }
}

#[test]
fn hits_closer_than_any_fixed_epsilon_are_found() {
    let square = |y: f64| {
        let corner = |x: f64, z: f64| DVec3::new(x, y, z);
        [
            [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0)],
            [corner(-1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        ]
    };
    for gap in [1e-3, 1e-6, 1e-9, 1e-12] {
        let triangles: Vec<_> = [square(0.0), square(gap)].concat();
        let bvh = TriangleBvh::build(&triangles);
        let ray = Ray {
            origin: DVec3::new(0.3, 0.5 * gap, 0.2),
            direction: DVec3::Y,
        };
        let hit = bvh.closest_hit(&ray).expect("the upper square");
        assert!(
            (hit.distance_m - 0.5 * gap).abs() <= 1e-6 * gap,
            "gap {gap}: {hit:?}"
        );
    }
}

#[test]
fn light_inside_a_mirror_ring_never_leaves_through_the_wall() {
    let tracer = Tracer::new(Arc::new(builtin::build("ring").expect("the ring")));
    let light = DVec3::new(-0.7, 1.2, 0.0);
    let mut reflected = 0;
    for index in 0..100_000_u32 {
        let angle = (f64::from(index) * 0.618_033_988_749_894_9).fract() * std::f64::consts::TAU;
        let target = DVec3::new(angle.cos(), (f64::from(index) + 0.5) * 0.499e-5, angle.sin());
        let mut ray = Ray {
            origin: light,
            direction: (target - light).normalize(),
        };
        for _ in 0..64 {
            let hit = tracer
                .closest_hit(&ray)
                .expect("from within, everything ends on the ring or the floor");
            match tracer
                .interact(&hit, ray.direction, &MediumStack::default())
                .reflection
            {
                Some(branch) => ray = branch.ray,
                None => break,
            }
            reflected += 1;
        }
    }
    assert!(reflected > 90_000);
}

#[test]
fn a_ray_does_not_meet_the_surface_that_it_leaves() {
    let scene = builtin::build("ball").expect("the ball");
    let triangles = all_triangles(&scene, "ball");
    let tracer = Tracer::new(Arc::new(scene));
    for [a, b, c] in triangles.iter().step_by(97) {
        let normal = (*b - *a).cross(*c - *a).normalize();
        let target = *a * 0.2 + *b * 0.5 + *c * 0.3;
        let towards = Ray {
            origin: target + normal * 0.1,
            direction: -normal,
        };
        let Some(hit) = tracer.closest_hit(&towards) else {
            panic!("missed the ball at {target}")
        };
        for tilt in [
            DVec3::ZERO,
            (*b - *a).normalize() * 30.0,
            (*c - *a).normalize() * 3000.0,
        ] {
            let away = hit.spawn((normal + tilt).normalize());
            if let Some(next) = tracer.closest_hit(&away) {
                assert!(next.distance_m > 1e-6, "met again after {} m", next.distance_m);
            }
        }
    }
}
