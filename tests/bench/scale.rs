//! What a light pass takes in a scene of a million triangles: `cargo bench --bench scale`.
//! Segments of light paths per CPU second of its tracing (cells, derivatives, bisection and accounts included), beside
//! bare closest hits of the same hierarchy along the same kind of paths, in lattice order, by the same number of threads.

#![allow(clippy::print_stdout, reason = "a benchmark's result")]
#![allow(clippy::unwrap_used, reason = "a benchmark of scenes of its own")]

use std::sync::Arc;

use cpu_time::ProcessTime;
use glam::DVec3;
use nephroid::geometry::Ray;
use nephroid::optics::LinearSrgb;
use nephroid::progress::Control;
use nephroid::scene::Scene;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::session::BakeSession;
use nephroid::settings::{BakeSettings, MapResolution};
use nephroid::transport::{MediumStack, Tracer};
use nephroid::units::Flux;
use rayon::prelude::*;

const LAMP: DVec3 = DVec3::new(0.0, 2.2, 0.0);

/// Branches that carry less than this share of a ray are not followed.
const THRESHOLD: f64 = 1e-3;

fn over_a_floor(name: &str) -> Scene {
    let mut scene = parts::reference_scene(2.0);
    scene.name = name.into();
    scene.lights.push(parts::point_light("lamp", LAMP, Flux(100.0)));
    scene
}

/// One glass ball of 1.3 million triangles.
fn a_million_triangles() -> Scene {
    let mut scene = over_a_floor("a million triangles");
    let ball = shapes::sphere(DVec3::new(0.0, 0.8, 0.0), 0.5, 8);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    scene
}

/// A thousand glass balls over the floor, each an object of its own: 25 rows of 40.
fn a_thousand_balls() -> Scene {
    let mut scene = over_a_floor("a thousand balls");
    for index in 0..1000 {
        let (column, row) = (index % 40, index / 40);
        let centre = DVec3::new(
            (f64::from(column) - 19.5) * 0.08,
            0.4,
            (f64::from(row) - 12.0) * 0.08,
        );
        let ball = shapes::sphere(centre, 0.03, 2);
        parts::add(
            &mut scene,
            &format!("ball {index}"),
            ball,
            parts::dielectric("glass", 1.5),
        );
    }
    scene
}

/// Rays of light paths, in the order of a lattice over the directions that may see a caster.
fn paths(tracer: &Tracer, side: usize) -> Vec<Ray> {
    let rows: Vec<Vec<Ray>> = (0..side)
        .into_par_iter()
        .map(|row| {
            let mut rays = Vec::new();
            for column in 0..side {
                let at = |index: usize| (index as f64 + 0.5) / side as f64 * 2.4 - 1.2;
                let direction = DVec3::new(at(column), -1.3, at(row)).normalize();
                follow(
                    tracer,
                    Ray {
                        origin: LAMP,
                        direction,
                    },
                    &mut rays,
                );
            }
            rays
        })
        .collect();
    rows.concat()
}

fn follow(tracer: &Tracer, ray: Ray, rays: &mut Vec<Ray>) {
    let mut waiting = vec![(ray, MediumStack::default(), LinearSrgb::WHITE, 0)];
    while let Some((ray, media, weight, depth)) = waiting.pop() {
        rays.push(ray);
        let Some(hit) = tracer.closest_hit(&ray) else {
            continue;
        };
        let interaction = tracer.interact(&hit, ray.direction, &media);
        for branch in [interaction.reflection, interaction.transmission]
            .into_iter()
            .flatten()
        {
            let weight = weight * branch.share;
            if weight.max_channel() > THRESHOLD && depth < 16 {
                waiting.push((branch.ray, branch.media, weight, depth + 1));
            }
        }
    }
}

fn measure(scene: Scene, density_per_sr: f64, max_depth: u32) {
    let scene = Arc::new(scene);
    let tracer = Tracer::new(Arc::clone(&scene));
    let rays = paths(&tracer, 600);
    let mut bare: Vec<f64> = (0..5)
        .map(|_| {
            let clock = ProcessTime::now();
            let hits: usize = rays
                .par_chunks(4096)
                .map(|rays| {
                    rays.iter()
                        .filter(|ray| tracer.closest_place(ray).is_some())
                        .count()
                })
                .sum();
            assert!(hits > 0);
            rays.len() as f64 / clock.elapsed().as_secs_f64()
        })
        .collect();
    let settings = BakeSettings {
        density_per_sr,
        max_depth,
        map_resolution: MapResolution::Fixed {
            width: 256,
            height: 256,
        },
        ..BakeSettings::default()
    };
    let mut session = BakeSession::new(Arc::clone(&scene)).unwrap();
    let result = session.bake(&settings, &(), &Control::default()).unwrap();
    bare.sort_by(f64::total_cmp);
    let traced = result.counts.segments as f64 / result.cpu_s.trace;
    println!(
        "{}: {} triangles, {} objects; bare {:.2} M hits/s, light pass {:.2} M segments/s: {:.0} %; {} rays, {} segments, cpu \
         {:.2} s plan, {:.2} s trace, {:.2} s deposit",
        scene.name,
        scene.triangle_count(),
        scene.objects.len(),
        bare[2] * 1e-6,
        traced * 1e-6,
        100.0 * traced / bare[2],
        result.counts.rays,
        result.counts.segments,
        result.cpu_s.plan,
        result.cpu_s.trace,
        result.cpu_s.deposit
    );
}

fn main() {
    measure(a_million_triangles(), 200_000.0, 16);
    measure(a_thousand_balls(), 1_000.0, 16);
}
