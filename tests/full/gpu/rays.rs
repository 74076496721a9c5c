//! The device's search for the nearest triangle against the CPU's, ray by ray.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DMat3, DVec3};
use nephroid::eye_pass::renderer::probe;
use nephroid::geometry::Ray;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Mesh, Scene};

use crate::gpu::judge::{Answer, Judge, Verdict};
use crate::gpu::rig::{gpu, or_skip};
use support::tools::builtin_scene;

/// Evenly spread numbers that are the same in every run (SplitMix64).
pub struct Numbers(u64);

impl Numbers {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// In [0, 1).
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn direction(&mut self) -> DVec3 {
        let y = 2.0 * self.next() - 1.0;
        let (sine, cosine) = (TAU * self.next()).sin_cos();
        DVec3::new(cosine, 0.0, sine) * (1.0 - y * y).sqrt() + DVec3::Y * y
    }

    /// Within a ball.
    fn place(&mut self, centre: DVec3, radius: f64) -> DVec3 {
        centre + self.direction() * (radius * self.next().cbrt())
    }

    /// A corner of a triangle, or a place on one of its edges.
    fn rim(&mut self, triangles: &[[DVec3; 3]]) -> DVec3 {
        let corners = triangles[(self.next() * triangles.len() as f64) as usize];
        let first = (self.next() * 3.0) as usize;
        let share = if self.next() < 0.5 { 0.0 } else { self.next() };
        corners[first].lerp(corners[(first + 1) % 3], share)
    }

    /// From within a ball, every `nth` one at an edge or a corner.
    fn rays(&mut self, scene: &Scene, (centre, radius): (DVec3, f64), nth: usize, count: usize) -> Vec<Ray> {
        let meshes = scene.objects.iter().map(|object| object.mesh_in_scene());
        let corners = |mesh: &Arc<Mesh>| {
            (0..mesh.triangles.len())
                .map(|at| mesh.corners(at))
                .collect::<Vec<_>>()
        };
        let triangles: Vec<[DVec3; 3]> = meshes.flat_map(corners).collect();
        let ray = |index: usize| {
            let origin = self.place(centre, radius);
            let direction = match index % nth {
                0 => (self.rim(&triangles) - origin).normalize(),
                _ => self.direction(),
            };
            Ray { origin, direction }
        };
        (0..count).map(ray).collect()
    }
}

/// Icosphere pushed in and out, about 82,000 triangles.
fn bumpy_sphere() -> Scene {
    let mut mesh = shapes::sphere(DVec3::ZERO, 1.0, 6);
    for position in &mut mesh.positions {
        let p = *position * 7.0;
        *position *= 1.0 + 0.06 * (p.x.sin() * p.y.cos() + (2.0 * p.z).sin());
    }
    of(vec![mesh])
}

fn of(meshes: Vec<Mesh>) -> Scene {
    let mut scene = Scene::default();
    for mesh in meshes {
        let grey = parts::matte("grey", LinearSrgb::grey(0.5));
        parts::add(&mut scene, "part", mesh, grey);
    }
    scene
}

/// Far from the origin: a floor of 200 m twice at the same place, slivers 50 m long and 4 to 40 mm wide, balls of
/// 1 cm and of 0.1 mm, needles.
fn awkward() -> Scene {
    let mut numbers = Numbers::new(5);
    let cylinder = |radius: f64, segments: u32| {
        shapes::sheet(segments, 1, |u, v| {
            let (sine, cosine) = (TAU * u.fract()).sin_cos();
            let outward = DVec3::new(cosine, 0.0, sine);
            (outward * radius + DVec3::Y * (50.0 * v), outward)
        })
    };
    let mut needles = Mesh::default();
    for first in (0..1500).step_by(3) {
        let base = numbers.place(DVec3::ZERO, 80.0);
        let width = 10_f64.powf(-6.0 * numbers.next());
        let tip = base + numbers.direction() * 20.0;
        let beside = base + numbers.direction() * width;
        needles.positions.extend([base, beside, tip]);
        needles.normals.extend([DVec3::Y; 3]);
        needles.triangles.push([first, first + 1, first + 2]);
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
        for position in &mut object.mesh_in_scene_mut().positions {
            *position = turn * *position + DVec3::new(3e5, -1e5, 7e5);
        }
    }
    scene
}

/// Fails unless the device's answers are the CPU's but where rounding may decide.
fn compare(scene: Scene, count: usize) {
    let gpu = or_skip!(gpu());
    let judge = Judge::new(Arc::new(scene.clone()));
    let (centre, radius) = judge.bounding_sphere();
    let rays = Numbers::new(count as u64).rays(&scene, (centre, 1.2 * radius), 2, count);
    let parts = rays.chunks(1 << 18);
    let answers = parts.flat_map(|part| probe(gpu, &scene, part).expect("the device holds it"));
    let answers: Vec<Answer> = answers.collect();
    let verdicts = judge.all(&rays, &answers);
    let of = |kind: Verdict| verdicts.iter().filter(|verdict| **verdict == kind).count();
    if let Some(first) = verdicts.iter().position(|verdict| *verdict == Verdict::Wrong) {
        let (ray, answer) = (&rays[first], &answers[first]);
        panic!("{} are wrong, the first: {ray:?}, {answer:?}", of(Verdict::Wrong));
    }
    assert!(of(Verdict::Met) > count / 4, "{} hits", of(Verdict::Met));
    // The comparison sees answers of other rays, and distances off by a thousandth.
    let is_wrong = |answers: &[Answer]| {
        let verdicts = judge.all(&rays[..1000], &answers[..1000]);
        verdicts
            .iter()
            .filter(|verdict| **verdict == Verdict::Wrong)
            .count()
    };
    assert!(is_wrong(&answers[1..]) > 250);
    let mut farther = answers.clone();
    for hit in farther.iter_mut().flatten() {
        hit.distance_m *= 1.001;
    }
    assert!(is_wrong(&farther) > 150);
}

#[test]
fn rays_through_the_showroom_meet_the_same() {
    compare(builtin_scene("showroom"), 340_000);
}

#[test]
fn rays_at_a_bumpy_sphere_meet_the_same() {
    compare(bumpy_sphere(), 330_000);
}

#[test]
fn rays_among_slivers_far_away_meet_the_same() {
    compare(awkward(), 330_000);
}

/// Aimed at edges and corners from inside: single precision leaves no gap between triangles.
#[test]
fn no_ray_leaves_a_closed_surface() {
    let (Some(gpu), scene) = (gpu(), bumpy_sphere()) else {
        return;
    };
    let rays = Numbers::new(9).rays(&scene, (DVec3::ZERO, 0.8), 1, 250_000);
    let hits = probe(gpu, &scene, &rays).expect("the device holds it");
    assert!(hits.iter().all(Option::is_some));
}
