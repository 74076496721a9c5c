//! `cargo bench -- live|deposit|bake|scale`: what bakes and edits take.

#![allow(clippy::print_stdout, reason = "a benchmark's result")]
#![allow(clippy::unwrap_used, reason = "a benchmark of the program's own scenes")]

use std::sync::Arc;
use std::time::{Duration, Instant};

use cpu_time::ProcessTime;
use glam::{DVec2, DVec3};
use nephroid::bake::{Bake, Baker};
use nephroid::geometry::Ray;
use nephroid::light_pass::coverage::{FluxTriangle, deposit_triangles};
use nephroid::light_pass::receiver_maps::{ReceiverMap, ReceiverMaps};
use nephroid::optics::LinearSrgb;
use nephroid::progress::Control;
use nephroid::scene::builtin::{self, parts, shapes};
use nephroid::scene::edit::{Edit, LightEdit};
use nephroid::scene::{LightKind, Scene};
use nephroid::settings::{BakeSettings, ErrorMetric, MapResolution, Sigma};
use nephroid::transport::{MediumStack, Tracer};
use nephroid::units::Flux;
use rayon::prelude::*;

fn main() {
    const BENCHES: [(&str, fn()); 4] = [
        ("live", live),
        ("deposit", deposit),
        ("bake", bake),
        ("scale", scale),
    ];
    let asked: Vec<String> = std::env::args().skip(1).collect();
    for (name, bench) in BENCHES {
        if asked.iter().any(|asked| asked == name) {
            return bench();
        }
    }
    println!("cargo bench -- live | deposit | bake | scale");
}

fn at(settings: BakeSettings, density_per_sr: f64, side: usize) -> BakeSettings {
    BakeSettings {
        density_per_sr,
        map_resolution: MapResolution::Fixed {
            width: side,
            height: side,
        },
        ..settings
    }
}

/// Bundles and photons to a relative RMSE.
fn to(target: f64, side: usize) -> BakeSettings {
    let settings = BakeSettings {
        max_error: Some(target),
        error_metric: ErrorMetric::Rmse,
        ..BakeSettings::default()
    };
    let density_per_sr = settings.density_per_sr;
    at(settings, density_per_sr, side)
}

fn session(name: &str) -> Baker {
    Baker::new(Arc::new(builtin::build(name).unwrap())).unwrap()
}

fn run(session: &mut Baker, settings: &BakeSettings) -> Bake {
    session.bake(settings, &(), &Control::default()).unwrap()
}

/// Median, 95th percentile and largest.
fn spread(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    [
        values[values.len() / 2],
        values[values.len() * 95 / 100],
        values[values.len() - 1],
    ]
}

/// Steps of a drag, and bakes that are called off.
const TIMES: usize = 40;

/// What edits of a live session take [CPU ms of the whole process].
fn live() {
    for name in ["ring", "ball", "pool"] {
        first_picture(name);
    }
    for name in ["ring", "ball"] {
        drags(name);
        cancelling(name);
    }
}

/// Times a bake after each of many changes; prints it with what the last one traced.
fn edits(what: &str, mut step: impl FnMut(f64) -> Bake) {
    let (mut cpu_ms, mut wall_ms) = (Vec::new(), Vec::new());
    let mut last = None;
    for index in 0..TIMES {
        let (cpu, wall) = (ProcessTime::now(), Instant::now());
        last = Some(step(index as f64));
        cpu_ms.push(1e3 * cpu.elapsed().as_secs_f64());
        wall_ms.push(1e3 * wall.elapsed().as_secs_f64());
    }
    let ([cpu, cpu_95, _], [wall, wall_95, _]) = (spread(cpu_ms), spread(wall_ms));
    let counts = last.unwrap().counts;
    println!(
        "{what:<36} cpu {cpu:7.1} ms, 95 % {cpu_95:7.1} ms; wall {wall:7.1} ms, 95 % {wall_95:7.1} ms; {} rays, {} cells, {} splats",
        counts.rays, counts.cells, counts.splats
    );
}

fn drags(name: &str) {
    let base = to(0.02, 512);
    let mut session = session(name);
    run(&mut session, &base);
    let with_sigma = |settings: &BakeSettings, sigma| BakeSettings {
        sigma: Sigma::Constant(sigma),
        ..settings.clone()
    };
    edits(&format!("{name}: sigma, auto, 512²"), |step| {
        run(&mut session, &with_sigma(&base, 0.1 * (step + 1.0)))
    });
    let mut edited = |edit: Edit| {
        let scene = edit.apply(session.scene()).unwrap();
        session.set_scene(Arc::new(scene)).unwrap();
        run(&mut session, &base)
    };
    let scene = builtin::build(name).unwrap();
    let LightKind::Point { position, intensity } = scene.lights[0].kind else {
        panic!("{name} is lit by a point light");
    };
    edits(&format!("{name}: light dimmed"), |step| {
        let strength = intensity.0 * (1.0 - 0.01 * step);
        edited(Edit::Light(0, LightEdit::Strength(strength)))
    });
    edits(&format!("{name}: light moved"), |step| {
        let position = position + DVec3::X * 0.002 * step;
        edited(Edit::Light(0, LightEdit::Position(position)))
    });
    edits(&format!("{name}: map size, 500² to 540²"), |step| {
        run(&mut session, &to(0.02, 500 + step as usize))
    });
    let splats = at(BakeSettings::splat(), 100_000.0, 512);
    run(&mut session, &splats);
    edits(&format!("{name}: sigma, splat, 512²"), |step| {
        run(&mut session, &with_sigma(&splats, 0.3 + 0.05 * step))
    });
}

/// From the hierarchy to the first whole picture.
fn first_picture(name: &str) {
    let (mut cpu_ms, mut rays) = (Vec::new(), 0);
    for _ in 0..11 {
        let mut session = session(name);
        session.tracer();
        let start = ProcessTime::now();
        let mut first = None;
        let mut see = |level: Bake| {
            first.get_or_insert((1e3 * start.elapsed().as_secs_f64(), level.counts.rays));
        };
        let settings = to(0.02, 256);
        session
            .bake_levels(&settings, &(), &Control::default(), &mut see)
            .unwrap();
        let (ms, count) = first.unwrap();
        cpu_ms.push(ms);
        rays = count;
    }
    let [median, ..] = spread(cpu_ms);
    println!("{name}: first whole picture after {median:.1} ms of CPU, {rays} rays");
}

/// From asking a bake to stop to its return.
fn cancelling(name: &str) {
    let settings = to(0.002, 512);
    let late_ms = (0..TIMES).map(|index| {
        let mut session = session(name);
        session.tracer();
        let control = Control::default();
        let late = std::thread::scope(|scope| {
            let asker = scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(20 + 17 * index as u64));
                control.cancel();
                Instant::now()
            });
            session.bake(&settings, &(), &control).unwrap();
            let done = Instant::now();
            done.saturating_duration_since(asker.join().unwrap())
        });
        1e3 * late.as_secs_f64()
    });
    let [median, most, worst] = spread(late_ms.collect());
    println!(
        "{name}: a cancelled bake returns after {median:.1} ms, 95 % {most:.1} ms, at most {worst:.1} ms"
    );
}

/// CPU seconds of the light pass, and of depositing in it: first, and again at another size.
fn bake() {
    for (first, second) in [(256, 256), (256, 512), (512, 512)] {
        type Sized = fn(usize) -> BakeSettings;
        let ways: [(&str, &str, Sized); 3] = [
            ("ring", "auto", |side| to(0.01, side)),
            ("pool", "auto", |side| to(0.01, side)),
            ("ring", "splat", |side| at(BakeSettings::splat(), 1e6, side)),
        ];
        for (name, estimator, settings) in ways {
            let mut seconds: [[Vec<f64>; 2]; 2] = Default::default();
            let mut rays = [0; 2];
            for _ in 0..5 {
                let mut session = session(name);
                for (index, side) in [first, second].into_iter().enumerate() {
                    let result = run(&mut session, &settings(side));
                    let cpu_s = &result.cpu_s;
                    rays[index] = result.counts.rays;
                    seconds[index][0].push(cpu_s.plan + cpu_s.trace + cpu_s.deposit);
                    seconds[index][1].push(cpu_s.deposit);
                }
            }
            print!("{name} {estimator}");
            for (index, seconds) in seconds.into_iter().enumerate() {
                let [light_pass, deposit] = seconds.map(|seconds| spread(seconds)[0]);
                let (side, rays) = ([first, second][index], rays[index]);
                print!("; at {side}: {rays} rays, {light_pass:.3} s, {deposit:.3} s of it deposit");
            }
            println!();
        }
    }
}

/// CPU time per triangle of the deposit with exact area coverage, by the triangles' area [texel²].
fn deposit() {
    // The floor of the ring: a square.
    let chart = run(&mut session("ring"), &to(0.1, DEPOSIT_SIDE)).maps[0]
        .chart
        .clone();
    let receiver = chart.receiver;
    let mut maps = ReceiverMaps::new(receiver.object() + 1);
    maps.touch(receiver, &|_| Some(chart.clone()));
    let map = maps.get_mut(receiver).unwrap();
    println!("texels colour  threads  CPU ns  wall ns");
    for (colour, grey) in [("grey", true), ("rgb", false)] {
        for area in [0.3, 2.0, 10.0, 50.0] {
            let triangles = triangles(area, grey);
            for threads in [1, 2] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let [cpu, wall] = pool.unwrap().install(|| deposit_ns(&triangles, map));
                println!("{area:6} {colour:>6} {threads:8} {cpu:7.1} {wall:8.1}");
            }
        }
    }
}

const DEPOSIT_SIDE: usize = 256;
const TRIANGLES: usize = 200_000;

/// A pseudo-random number in [0, 1) for an index.
fn hash(index: usize) -> f64 {
    let mut x = (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x >> 11) as f64 / (1_u64 << 53) as f64
}

/// Triangles of one area [texel²] and many shapes, in an order that moves across the map row by row.
fn triangles(area: f64, grey: bool) -> Vec<FluxTriangle> {
    let across = (TRIANGLES as f64).sqrt() as usize;
    let triangle = |index: usize| {
        let random = |k| hash(20 * index + k);
        let place = DVec2::new(
            (index % across) as f64 + random(0),
            (index / across) as f64 + random(1),
        );
        let centre = place * (DEPOSIT_SIDE as f64 / across as f64);
        let turn = DVec2::from_angle(std::f64::consts::TAU * random(2));
        // Base and height of one to three times each other.
        let base = (2.0 * area * 3f64.powf(2.0 * random(3) - 1.0)).sqrt();
        let top = DVec2::new(base * random(4), 2.0 * area / base);
        let corners = [DVec2::ZERO, DVec2::new(base, 0.0), top];
        FluxTriangle {
            corners: corners.map(|corner| centre + turn.rotate(corner - 0.5 * top)),
            flux: [5, 6, 7].map(|k| (1e12 * random(if grey { 5 } else { k })) as i64),
            island: 0,
        }
    };
    (0..TRIANGLES).map(triangle).collect()
}

/// Medians over five runs of CPU and wall time per triangle [ns].
fn deposit_ns(triangles: &[FluxTriangle], map: &mut ReceiverMap) -> [f64; 2] {
    let mut times: [Vec<f64>; 2] = Default::default();
    for _ in 0..5 {
        let (cpu, wall) = (ProcessTime::now(), Instant::now());
        deposit_triangles(triangles, map);
        let per_triangle = 1e9 / triangles.len() as f64;
        times[0].push(cpu.elapsed().as_secs_f64() * per_triangle);
        times[1].push(wall.elapsed().as_secs_f64() * per_triangle);
    }
    times.map(|times| spread(times)[0])
}

/// Segments of light paths per CPU second of a light pass's tracing among a million triangles, beside bare closest hits of
/// the same hierarchy along the same kind of paths, in lattice order, by the same number of threads.
fn scale() {
    let mut ball = over_a_floor("a million triangles");
    add_ball(&mut ball, DVec3::new(0.0, 0.8, 0.0), 0.5, 8);
    segments_per_s(ball, 0.005);
    let mut balls = over_a_floor("a thousand balls");
    for index in 0..1000 {
        let (column, row) = (f64::from(index % 40) - 19.5, f64::from(index / 40) - 12.0);
        add_ball(&mut balls, DVec3::new(column * 0.08, 0.4, row * 0.08), 0.03, 2);
    }
    segments_per_s(balls, 0.05);
}

const LAMP: DVec3 = DVec3::new(0.0, 2.2, 0.0);

fn over_a_floor(name: &str) -> Scene {
    let mut scene = parts::reference_scene(2.0);
    scene.name = name.into();
    scene.lights.push(parts::point_light("lamp", LAMP, Flux(100.0)));
    scene
}

fn add_ball(scene: &mut Scene, centre: DVec3, radius_m: f64, levels: u32) {
    let ball = shapes::sphere(centre, radius_m, levels);
    parts::add(scene, "ball", ball, parts::dielectric("glass", 1.5));
}

/// Rays of light paths, in the order of a lattice over the directions that may see a caster.
fn paths(tracer: &Tracer, side: usize) -> Vec<Ray> {
    let of_row = |row: usize| {
        let mut rays = Vec::new();
        for column in 0..side {
            let at = |index: usize| (index as f64 + 0.5) / side as f64 * 2.4 - 1.2;
            let direction = DVec3::new(at(column), -1.3, at(row)).normalize();
            let origin = LAMP;
            follow(tracer, Ray { origin, direction }, &mut rays);
        }
        rays
    };
    (0..side).into_par_iter().flat_map_iter(of_row).collect()
}

fn follow(tracer: &Tracer, ray: Ray, rays: &mut Vec<Ray>) {
    let mut waiting = vec![(ray, MediumStack::default(), LinearSrgb::WHITE, 0)];
    while let Some((ray, media, weight, depth)) = waiting.pop() {
        rays.push(ray);
        let Some(hit) = tracer.closest_hit(&ray) else {
            continue;
        };
        let interaction = tracer.interact(&hit, ray.direction, &media);
        let branches = [interaction.reflection, interaction.transmission];
        for branch in branches.into_iter().flatten() {
            let weight = weight * branch.share;
            if weight.max_channel() > 1e-3 && depth < 16 {
                waiting.push((branch.ray, branch.media, weight, depth + 1));
            }
        }
    }
}

fn segments_per_s(scene: Scene, target: f64) {
    let scene = Arc::new(scene);
    let tracer = Tracer::new(Arc::clone(&scene));
    let rays = paths(&tracer, 600);
    let bare = (0..5).map(|_| {
        let clock = ProcessTime::now();
        let met = |rays: &[Ray]| rays.iter().filter(|ray| tracer.intersect(ray).is_some()).count();
        assert!(rays.par_chunks(4096).map(met).sum::<usize>() > 0);
        rays.len() as f64 / clock.elapsed().as_secs_f64()
    });
    let [bare, ..] = spread(bare.collect());
    let mut session = Baker::new(Arc::clone(&scene)).unwrap();
    let result = run(&mut session, &to(target, 256));
    let traced = result.counts.segments as f64 / result.cpu_s.trace;
    let (counts, cpu_s) = (&result.counts, &result.cpu_s);
    println!(
        "{}: {} triangles, {} objects; bare {:.2} M hits/s, light pass {:.2} M segments/s: {:.0} %; {counts:?}, {cpu_s:?}",
        scene.name,
        scene.triangle_count(),
        scene.objects.len(),
        bare * 1e-6,
        traced * 1e-6,
        100.0 * traced / bare,
    );
}
