//! The device's search for the nearest triangle against the processor's, ray by ray.

use std::io::Write as _;
use std::sync::Arc;

use glam::{DMat3, DVec3};
use nephroid::eye_pass::renderer::probe;
use nephroid::geometry::Ray;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{self, parts, shapes};
use nephroid::scene::{Mesh, Scene};

use crate::device::gpu;
use crate::nearby::{Answer, EPSILON, Judge, Verdict};
use crate::numbers::Numbers;

/// A corner of a triangle, or a place on one of its edges.
fn rim(numbers: &mut Numbers, triangles: &[[DVec3; 3]]) -> DVec3 {
    let corners = triangles[numbers.index(triangles.len())];
    let first = numbers.index(3);
    let share = if numbers.next() < 0.5 { 0.0 } else { numbers.next() };
    corners[first].lerp(corners[(first + 1) % 3], share)
}

fn triangles(scene: &Scene) -> Vec<[DVec3; 3]> {
    let meshes = scene.objects.iter().map(|object| &object.mesh);
    meshes
        .flat_map(|mesh| (0..mesh.triangles.len()).map(|triangle| mesh.corners(triangle)))
        .collect()
}

/// Half of them anywhere, half aimed at edges and corners.
fn rays(scene: &Scene, judge: &Judge, count: usize) -> Vec<Ray> {
    let triangles = triangles(scene);
    let mut numbers = Numbers::new(count as u64);
    let (centre, radius) = judge.bounding_sphere();
    (0..count)
        .map(|index| {
            let origin = numbers.place(centre, 1.2 * radius);
            let direction = if index % 2 == 0 {
                numbers.direction()
            } else {
                (rim(&mut numbers, &triangles) - origin).normalize()
            };
            Ray { origin, direction }
        })
        .collect()
}

/// Icosphere pushed in and out, about 82,000 triangles.
fn bumpy_sphere() -> Mesh {
    let mut mesh = shapes::sphere(DVec3::ZERO, 1.0, 6);
    for position in &mut mesh.positions {
        let p = *position * 7.0;
        *position *= 1.0 + 0.06 * (p.x.sin() * p.y.cos() + (2.0 * p.z).sin());
    }
    mesh
}

fn of(parts_of: Vec<Mesh>) -> Scene {
    let mut scene = Scene::default();
    for (index, mesh) in parts_of.into_iter().enumerate() {
        let grey = parts::matte("grey", LinearSrgb::grey(0.5));
        parts::add(&mut scene, &format!("part {index}"), mesh, grey);
    }
    scene
}

/// Far from the origin: a floor of 200 m twice at the same place, slivers 50 m long and 4 to 40 mm wide, balls of
/// 1 cm and of 0.1 mm, needles.
fn awkward() -> Scene {
    let mut numbers = Numbers::new(5);
    let cylinder = |radius: f64, segments: u32| {
        shapes::sheet(segments, 1, |u, v| {
            let (sine, cosine) = (std::f64::consts::TAU * u.fract()).sin_cos();
            let outward = DVec3::new(cosine, 0.0, sine);
            (outward * radius + DVec3::Y * (50.0 * v), outward)
        })
    };
    let mut needles = Mesh::default();
    for needle in 0..500 {
        let base = numbers.place(DVec3::ZERO, 80.0);
        let width = 10_f64.powf(-6.0 * numbers.next());
        let tip = base + numbers.direction() * 20.0;
        needles
            .positions
            .extend([base, base + numbers.direction() * width, tip]);
        needles.normals.extend([DVec3::Y; 3]);
        needles
            .triangles
            .push([3 * needle, 3 * needle + 1, 3 * needle + 2]);
    }
    let floor = || shapes::floor([-100.0, 100.0], [-100.0, 100.0], 0.0);
    let mut scene = of(vec![
        floor(),
        floor(),
        cylinder(3.0, 4096),
        cylinder(12.0, 2048),
        shapes::sphere(DVec3::new(20.0, 3.0, 5.0), 0.01, 3),
        shapes::sphere(DVec3::new(-9.0, 0.5, 30.0), 1e-4, 2),
        shapes::sphere(DVec3::new(-30.0, 10.0, -20.0), 8.0, 4),
        needles,
    ]);
    let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
    for object in &mut scene.objects {
        for position in &mut Arc::make_mut(&mut object.mesh).positions {
            *position = turn * *position + DVec3::new(3e5, -1e5, 7e5);
        }
    }
    scene
}

/// Fails unless the device's answers are the processor's but where rounding may decide.
fn compare(name: &str, scene: Scene, count: usize) {
    let Some(gpu) = gpu() else { return };
    let judge = Judge::new(Arc::new(scene.clone()));
    let rays = rays(&scene, &judge, count);
    let mut answers: Vec<Answer> = Vec::with_capacity(count);
    for part in rays.chunks(1 << 18) {
        answers.extend(probe(&gpu, &scene, part).expect("the device holds it"));
    }
    let verdicts = judge.all(&rays, &answers);
    let of = |kind: fn(&Verdict) -> bool| verdicts.iter().filter(|verdict| kind(verdict)).count();
    let same = of(|verdict| matches!(verdict, Verdict::Same { .. }));
    let met = of(|verdict| matches!(verdict, Verdict::Same { error, .. } if *error > 0.0));
    let shared = of(|verdict| matches!(verdict, Verdict::Shared { .. }));
    let silhouette = of(|verdict| matches!(verdict, Verdict::Silhouette { .. }));
    let around = of(|verdict| *verdict == Verdict::Start);
    let worst = |error: fn(&Verdict) -> f64| verdicts.iter().map(error).fold(0.0, f64::max);
    let aside = worst(|verdict| match verdict {
        Verdict::Shared { aside } | Verdict::Silhouette { aside } => *aside,
        _ => 0.0,
    });
    let distance = worst(|verdict| match verdict {
        Verdict::Same { of_bound, .. } => *of_bound,
        _ => 0.0,
    });
    let _ = writeln!(
        std::io::stdout(),
        "{name}: {count} rays: {same} alike ({met} of them hits, distances off by at most {distance:.3} of the \
         bound), {shared} at a shared edge, {silhouette} at a silhouette, {around} around the \
         origin; at most {aside:.2e} aside of {EPSILON:.2e}"
    );
    let wrong: Vec<usize> = (0..count)
        .filter(|ray| verdicts[*ray] == Verdict::Wrong)
        .collect();
    if let Some(first) = wrong.first() {
        panic!(
            "{name}: {} of {count} rays, the first: {}",
            wrong.len(),
            judge.tell(&rays[*first], &answers[*first])
        );
    }
    assert!(met > count / 4, "{met} hits");
    // The comparison sees answers of other rays, and distances off by a thousandth.
    let others: Vec<Answer> = answers.iter().skip(1).chain(&answers[..1]).copied().collect();
    let is_wrong = |answers: &[Answer]| {
        let verdicts = judge.all(&rays[..1000], &answers[..1000]);
        verdicts
            .iter()
            .filter(|verdict| **verdict == Verdict::Wrong)
            .count()
    };
    assert!(is_wrong(&others) > 250);
    let mut farther = answers.clone();
    for hit in farther.iter_mut().flatten() {
        hit.distance_m *= 1.001;
    }
    assert!(is_wrong(&farther) > 150);
}

#[test]
fn rays_through_the_showroom_meet_what_they_meet_on_the_processor() {
    compare("showroom", builtin::build("showroom").expect("listed"), 340_000);
}

#[test]
fn rays_at_a_bumpy_sphere_meet_what_they_meet_on_the_processor() {
    compare("bumpy sphere", of(vec![bumpy_sphere()]), 330_000);
}

#[test]
fn rays_among_slivers_far_away_meet_what_they_meet_on_the_processor() {
    compare("awkward", awkward(), 330_000);
}

/// Aimed at edges and corners from inside: single precision leaves no gap between triangles.
#[test]
fn no_ray_leaves_a_closed_surface_on_the_device() {
    let Some(gpu) = gpu() else { return };
    let scene = of(vec![bumpy_sphere()]);
    let triangles = triangles(&scene);
    let mut numbers = Numbers::new(9);
    let rays: Vec<Ray> = (0..250_000)
        .map(|_| {
            let origin = numbers.place(DVec3::ZERO, 0.8);
            let direction = (rim(&mut numbers, &triangles) - origin).normalize();
            Ray { origin, direction }
        })
        .collect();
    let hits = probe(&gpu, &scene, &rays).expect("the device holds it");
    let escaped = hits.iter().filter(|hit| hit.is_none()).count();
    assert_eq!(escaped, 0, "of {}", rays.len());
}
