//! How cost grows with rays, triangles, texels and threads.

use std::sync::Arc;

use glam::DVec3;

use super::{Bench, percent, scene, verdict};
use crate::error::Result;
use crate::scene::Scene;
use crate::scene::builtin::{parts, shapes};
use crate::session::BakeResult;
use crate::settings::BakeSettings;
use crate::study::page::{Cell, Curve, Page, Plot, Table};
use crate::units::Flux;

/// Densities that give about as many rays on the ring [1/sr].
const DENSITIES: [f64; 6] = [1e3, 1e4, 1e5, 1e6, 1e7, 1e8];

/// Subdivisions of the ball: 20·4^n triangles, 320 to 5.2 million.
const LEVELS: [u32; 5] = [2, 4, 6, 8, 9];

/// Texels across and down.
const SIDES: [usize; 8] = [64, 128, 256, 512, 1024, 2048, 4096, 8192];

const THREADS: [usize; 2] = [1, 2];

/// Of all but the ladders of rays and threads [1/sr].
const DENSITY_PER_SR: f64 = 3e5;

/// Of the ladder of threads [1/sr]: the work has to be long beside what a bake begins and ends with.
const OF_THREADS_PER_SR: f64 = 1e7;

/// Cost per ray from 4,000 to 4 million triangles grows at most so many times.
const MOST_GROWTH: f64 = 3.0;

/// Memory of the ladders of rays and threads [bytes]: what was traced is not kept for later changes where it takes more than a quarter.
const MEMORY_BYTES: u64 = 16 << 20;

/// Memory over all numbers of rays stays within this factor.
const FLAT: f64 = 1.5;

const COLUMNS: [(&str, &str); 8] = [
    ("what", "what"),
    ("value", "value"),
    ("rays", "rays"),
    ("segments_per_ray", "segments per ray"),
    ("plan_cpu_s", "item buffer and plan [CPU s]"),
    ("us_per_ray", "trace and deposit [CPU µs per ray]"),
    ("wall_s", "light pass [wall s]"),
    ("memory_mb", "maps and rays [MB]"),
];

/// One bake of a ladder.
struct Step {
    what: &'static str,
    value: f64,
    result: BakeResult,
}

impl Step {
    fn per_ray(&self, amount: f64) -> f64 {
        amount / self.result.counts.rays.max(1) as f64
    }

    fn us_per_ray(&self) -> f64 {
        1e6 * self.per_ray(self.result.cpu_s.trace + self.result.cpu_s.deposit)
    }

    fn segments_per_ray(&self) -> f64 {
        self.per_ray(self.result.counts.segments as f64)
    }

    /// All that is held for maps, rays and patches.
    fn memory_mb(&self) -> Option<f64> {
        self.result.course.last().map(|point| point.bytes as f64 / 1e6)
    }

    fn wall_s(&self) -> f64 {
        let times = &self.result.timings_s;
        times.plan + times.trace + times.deposit
    }

    fn row(&self) -> Vec<Cell> {
        vec![
            self.what.into(),
            self.value.into(),
            self.result.counts.rays.into(),
            self.segments_per_ray().into(),
            self.result.cpu_s.plan.into(),
            self.us_per_ray().into(),
            self.wall_s().into(),
            self.memory_mb().map_or(Cell::Empty, Cell::Number),
        ]
    }
}

pub(super) fn page(bench: &Bench) -> Result<Page> {
    let steps = steps(bench)?;
    let mut table = Table::new(&COLUMNS);
    table.rows = steps.iter().map(Step::row).collect();
    let findings = findings(&steps);
    let plot = |name, title: &str, x, y, what: &str, of: fn(&Step) -> f64| Plot {
        name,
        title: title.into(),
        x,
        y,
        is_share: false,
        curves: vec![Curve {
            name: what.into(),
            points: ladder(&steps, what).map(|step| (step.value, of(step))).collect(),
        }],
    };
    let memory = |step: &Step| step.memory_mb().unwrap_or(0.0);
    let micro = "CPU time per ray [µs]";
    Ok(Page {
        title: "How cost grows".into(),
        settings: format!(
            "Splats, {DENSITY_PER_SR:e} rays/sr but where they are counted, and {OF_THREADS_PER_SR:e} where threads are; maps of 256 × 256 \
             texels but where those are. Rays, texels and threads on `builtin:ring`; triangles: a glass ball of 20·4^n triangles over a floor."
        ),
        table,
        plots: vec![
            plot("scaling-rays", "ring", "rays/sr", micro, "rays", Step::us_per_ray),
            plot(
                "scaling-memory",
                "ring",
                "rays/sr",
                "maps and rays [MB]",
                "rays",
                memory,
            ),
            plot(
                "scaling-triangles",
                "ball",
                "triangles",
                micro,
                "triangles",
                Step::us_per_ray,
            ),
            plot(
                "scaling-texels",
                "ring",
                "texels",
                "light pass [s]",
                "texels",
                Step::wall_s,
            ),
        ],
        pictures: Vec::new(),
        findings,
    })
}

fn steps(bench: &Bench) -> Result<Vec<Step>> {
    let ring = scene("ring")?;
    let splat = |density_per_sr| BakeSettings {
        density_per_sr,
        ..BakeSettings::splat()
    };
    let usual = if bench.quick { 1e4 } else { DENSITY_PER_SR };
    let mut steps = Vec::new();
    let mut step = |what, value, scene: &Arc<Scene>, settings: &BakeSettings| -> Result<()> {
        let result = bench.bake(scene, settings)?;
        steps.push(Step { what, value, result });
        Ok(())
    };
    for &density in bench.some(&DENSITIES, 3) {
        let settings = BakeSettings {
            memory_bytes: MEMORY_BYTES,
            ..bench.at(splat(density), 256)
        };
        step("rays", density, &ring, &settings)?;
    }
    for &levels in bench.some(&LEVELS, 3) {
        let ball = Arc::new(ball(levels));
        let triangles = 20.0 * 4_f64.powi(levels as i32);
        step("triangles", triangles, &ball, &bench.at(splat(usual), 256))?;
    }
    for &side in bench.some(&SIDES, 3) {
        let texels = (side * side) as f64;
        step("texels", texels, &ring, &bench.at(splat(usual), side))?;
    }
    for &threads in &THREADS {
        let settings = BakeSettings {
            threads,
            memory_bytes: MEMORY_BYTES,
            ..bench.at(splat(if bench.quick { usual } else { OF_THREADS_PER_SR }), 256)
        };
        step("threads", threads as f64, &ring, &settings)?;
    }
    Ok(steps)
}

/// A glass ball of 20·4^n triangles.
fn ball(levels: u32) -> Scene {
    let mut scene = parts::reference_scene(0.6);
    scene.name = "ball".into();
    let mesh = shapes::sphere(DVec3::new(0.0, 0.8, 0.0), 0.5, levels);
    parts::add(&mut scene, "ball", mesh, parts::dielectric("glass", 1.5));
    let lamp = DVec3::new(0.0, 3.0, 0.0);
    scene.lights.push(parts::point_light("light", lamp, Flux(100.0)));
    scene
}

fn ladder<'a>(steps: &'a [Step], what: &str) -> impl Iterator<Item = &'a Step> {
    steps.iter().filter(move |step| step.what == what)
}

/// Largest over smallest.
fn spread(values: impl Iterator<Item = f64>) -> f64 {
    let (least, most) = values.fold((f64::INFINITY, 0.0_f64), |(least, most), value| {
        (least.min(value), most.max(value))
    });
    most / least
}

fn findings(steps: &[Step]) -> Vec<String> {
    let triangles: Vec<&Step> = ladder(steps, "triangles")
        .filter(|step| step.value > 4e3)
        .collect();
    let mut findings = Vec::new();
    if let (Some(first), Some(last)) = (triangles.first(), triangles.last()) {
        let grown = last.us_per_ray() / first.us_per_ray();
        findings.push(format!(
            "From {} to {} triangles a ray's cost grows {grown:.2} times and its segments {:.2} times: the bound of {MOST_GROWTH} {}.",
            first.value,
            last.value,
            last.segments_per_ray() / first.segments_per_ray(),
            if grown <= MOST_GROWTH { "holds" } else { "does not hold" }
        ));
    }
    let memory = spread(ladder(steps, "rays").filter_map(Step::memory_mb));
    let rays = spread(ladder(steps, "rays").map(|step| step.result.counts.rays as f64));
    findings.push(format!(
        "Over {rays:.0} times as many rays, memory for maps and rays differs by a factor of {memory:.2}: that it is flat in rays {}. \
         They have {} MB; with more, up to a quarter of it keeps what was traced, so that a change of map or kernel need not trace again.",
        if memory < FLAT { "holds" } else { "does not hold" },
        MEMORY_BYTES >> 20
    ));
    let wall: Vec<f64> = ladder(steps, "threads").map(Step::wall_s).collect();
    if let [one, two] = wall[..] {
        findings.push(format!(
            "Two threads take {} of the time of one on the wall; half would be all of it. That light rays go well in parallel {} with \
             it, on a machine that does nothing else.",
            percent(two / one),
            verdict(two < 0.7 * one)
        ));
    }
    findings
}
