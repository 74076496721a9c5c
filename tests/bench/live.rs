//! What edits of a live session take: `cargo bench --bench live`. CPU milliseconds of the whole process, median and
//! 95th percentile.

#![allow(clippy::print_stdout, reason = "a benchmark's result")]
#![allow(clippy::unwrap_used, reason = "a benchmark of the program's own scenes")]

use std::sync::Arc;
use std::time::{Duration, Instant};

use cpu_time::ProcessTime;
use glam::DVec3;
use nephroid::progress::Control;
use nephroid::scene::edit::Edit;
use nephroid::scene::{LightKind, Scene, builtin};
use nephroid::session::{BakeResult, BakeSession};
use nephroid::settings::{BakeSettings, Estimator, MapResolution, Sigma};
use nephroid::units::RadiantIntensity;

const TIMES: usize = 40;

fn settings(density_per_sr: f64, side: usize) -> BakeSettings {
    BakeSettings {
        density_per_sr,
        map_resolution: MapResolution::Fixed {
            width: side,
            height: side,
        },
        ..BakeSettings::default()
    }
}

fn run(session: &mut BakeSession, settings: &BakeSettings) -> BakeResult {
    session.bake(settings, &(), &Control::default()).unwrap()
}

/// Median and 95th percentile.
fn percentiles(mut values: Vec<f64>) -> (f64, f64) {
    values.sort_by(f64::total_cmp);
    (values[values.len() / 2], values[values.len() * 95 / 100])
}

/// Times a bake after each of many changes; prints it with what the last one traced.
fn edits(what: &str, mut step: impl FnMut(usize) -> BakeResult) {
    let (mut cpu_ms, mut wall_ms) = (Vec::new(), Vec::new());
    let mut last = None;
    for index in 0..TIMES {
        let (cpu, wall) = (ProcessTime::now(), Instant::now());
        last = Some(step(index));
        cpu_ms.push(1e3 * cpu.elapsed().as_secs_f64());
        wall_ms.push(1e3 * wall.elapsed().as_secs_f64());
    }
    let ((cpu, cpu_95), (wall, wall_95)) = (percentiles(cpu_ms), percentiles(wall_ms));
    let counts = last.unwrap().counts;
    println!(
        "{what:<44} cpu {cpu:7.1} ms, 95 % {cpu_95:7.1} ms; wall {wall:7.1} ms, 95 % {wall_95:7.1} ms; {} rays, {} cells, {} splats",
        counts.rays, counts.cells, counts.splats
    );
}

fn edited(session: &mut BakeSession, edit: &Edit) {
    let (scene, _) = edit.apply(session.scene()).unwrap();
    session.set_scene(Arc::new(scene)).unwrap();
}

fn strength(scene: &Scene) -> f64 {
    match scene.lights[0].kind {
        LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. } => intensity.0,
        _ => 1.0,
    }
}

fn drags(name: &str) {
    let scene = Arc::new(builtin::build(name).unwrap());
    let base = settings(25_000.0, 512);
    let mut session = BakeSession::new(scene.clone()).unwrap();
    run(&mut session, &base);
    edits(&format!("{name}: sigma, wavefront, 512²"), |index| {
        let sigma = Sigma::Constant(0.1 * (index + 1) as f64);
        run(
            &mut session,
            &BakeSettings {
                sigma,
                ..base.clone()
            },
        )
    });
    let power = strength(&scene);
    edits(&format!("{name}: light dimmed"), |index| {
        let intensity = RadiantIntensity(power * (1.0 - 0.01 * index as f64));
        edited(&mut session, &Edit::LightIntensity { light: 0, intensity });
        run(&mut session, &base)
    });
    edits(&format!("{name}: map size, 500² to 540²"), |index| {
        run(&mut session, &settings(25_000.0, 500 + index))
    });
    edits(&format!("{name}: light moved"), |index| {
        let (LightKind::Point { position, .. } | LightKind::Spot { position, .. }) = scene.lights[0].kind
        else {
            return run(&mut session, &base);
        };
        let position = position + DVec3::X * 0.002 * index as f64;
        edited(&mut session, &Edit::LightPosition { light: 0, position });
        run(&mut session, &base)
    });
    let splats = BakeSettings {
        estimator: Estimator::Splat,
        sigma: Sigma::Constant(1.0),
        ..settings(100_000.0, 512)
    };
    run(&mut session, &splats);
    edits(&format!("{name}: sigma, splat, 512²"), |index| {
        let sigma = Sigma::Constant(0.3 + 0.05 * index as f64);
        run(
            &mut session,
            &BakeSettings {
                sigma,
                ..splats.clone()
            },
        )
    });
}

/// CPU time from the hierarchy to the first whole picture.
fn first_picture(name: &str) {
    let scene = Arc::new(builtin::build(name).unwrap());
    let mut cpu_ms = Vec::new();
    let mut rays = 0;
    for _ in 0..11 {
        let mut session = BakeSession::new(scene.clone()).unwrap();
        session.tracer();
        let start = ProcessTime::now();
        let mut first = None;
        let settings = settings(25_000.0, 256);
        let mut see = |level: BakeResult| {
            first.get_or_insert((1e3 * start.elapsed().as_secs_f64(), level.counts.rays));
        };
        session
            .bake_levels(&settings, &(), &Control::default(), &mut see)
            .unwrap();
        let (ms, count) = first.unwrap();
        cpu_ms.push(ms);
        rays = count;
    }
    let (median, _) = percentiles(cpu_ms);
    println!("{name}: first whole picture after {median:.1} ms of CPU, {rays} rays");
}

/// Time from asking a bake to stop to its return.
fn cancelling(name: &str) {
    let scene = Arc::new(builtin::build(name).unwrap());
    let mut late_ms = Vec::new();
    for index in 0..TIMES {
        let mut session = BakeSession::new(scene.clone()).unwrap();
        session.tracer();
        let control = Control::default();
        let asked = std::thread::scope(|scope| {
            let asker = scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(20 + 17 * index as u64));
                control.cancel();
                Instant::now()
            });
            session.bake(&settings(400_000.0, 512), &(), &control).unwrap();
            let done = Instant::now();
            done.saturating_duration_since(asker.join().unwrap())
        });
        late_ms.push(1e3 * asked.as_secs_f64());
    }
    let worst = late_ms.iter().copied().fold(0.0, f64::max);
    let (median, most) = percentiles(late_ms);
    println!(
        "{name}: a cancelled bake returns after {median:.1} ms, 95 % {most:.1} ms, at most {worst:.1} ms"
    );
}

fn main() {
    for name in ["ring", "ball", "pool"] {
        first_picture(name);
    }
    for name in ["ring", "ball"] {
        drags(name);
        cancelling(name);
    }
}
