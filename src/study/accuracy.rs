//! The study of accuracy against cost on the built-in scenes: measured, forecast, and how cost grows.

use std::sync::Arc;

use glam::DVec3;

use super::paper::{auto, over_a_floor, scene, splat};
use super::plot::Plot;
use super::references::Reference;
use super::sweep::{
    Against, Bench, CPU_S, Column, Group, MEMORY_MB, Measured, RAYS, REFERENCE, RELATIVE_RMSE, Sweep,
    Variant, WALL_S, column, number, share,
};
use super::table::Cell;
use crate::bake::forecast::{forecast, stood_at};
use crate::bake::{CostPoint, Forecast, StopReason};
use crate::error::Result;
use crate::scene::builtin::{self, shapes};
use crate::scene::{Light, Scene};
use crate::settings::BakeSettings;

/// Forecast for a bake that reached its target, made when its error first was at most five times the target, and the
/// state of the bake at that time.
fn predicted(measured: &Measured) -> Option<(CostPoint, Forecast)> {
    let (result, target) = (measured.result, measured.variant.settings.max_error?);
    let made = stood_at(&result.course, 5.0 * target)?;
    let expected = forecast(
        &result.course[..=made],
        target,
        measured.variant.settings.estimator,
    )?;
    (result.stop_reason == StopReason::MaxError).then_some((result.course[made], expected))
}

fn predicted_over_actual(measured: &Measured, of: fn(&Forecast) -> f64, cost: fn(&CostPoint) -> f64) -> Cell {
    let actual = measured.result.course.last().map(cost);
    number(
        predicted(measured)
            .zip(actual)
            .map(|((_, expected), actual)| of(&expected) / actual),
    )
}

const ACCURACY: &[Column] = &[
    RAYS,
    CPU_S,
    WALL_S,
    MEMORY_MB,
    column("estimated_rmse", |m| share(m.result.estimated_relative_rmse)),
    RELATIVE_RMSE,
    column("stop", |m| format!("{:?}", m.result.stop_reason).into()),
    column("predicted_at_rmse", |m| {
        share(predicted(m).map(|(made_at, _)| made_at.error))
    }),
    column("predicted_rays", |m| {
        number(predicted(m).map(|(_, expected)| expected.rays as f64))
    }),
    column("predicted_cpu_s", |m| {
        number(predicted(m).map(|(_, expected)| expected.cpu_s))
    }),
    column("rays_ratio", |m| {
        predicted_over_actual(m, |f| f.rays as f64, |p| p.rays as f64)
    }),
    column("cpu_ratio", |m| {
        predicted_over_actual(m, |f| f.cpu_s, |p| p.cpu_s)
    }),
    REFERENCE,
];

pub(super) fn accuracy(bench: &Bench) -> Result<Sweep> {
    const TARGETS: [f64; 5] = [0.10, 0.05, 0.02, 0.01, 0.005];
    const DENSITIES: [f64; 4] = [1e4, 1e5, 1e6, 4e6];
    const PLOTS: &[Plot] = &[
        by_scene("auto-cpu", "cpu_s").only("estimator", "auto"),
        by_scene("auto-rays", "rays").only("estimator", "auto"),
        by_scene("splat-cpu", "cpu_s").only("estimator", "splat"),
        by_scene("splat-rays", "rays").only("estimator", "splat"),
    ];
    const fn by_scene(file: &'static str, x: &'static str) -> Plot {
        Plot::new(file, [x, "relative_rmse"], &["scene"])
    }

    // A hard scene may take far longer than others to its target, so that all bakes have a limit of time.
    let towards = |target: f64, limit_s: f64| BakeSettings {
        max_time_s: Some(limit_s),
        ..bench.at(auto(target), bench.side())
    };
    let names = if bench.quick {
        &["mirror", "pool"][..]
    } else {
        &builtin::NAMES
    };

    // Each scene has a reference of its own, and thus is a group.
    let mut groups = Vec::new();
    for &name in names {
        let scene = scene(name)?;
        // The splat estimator does not trace lamps with a size.
        if scene.lights.iter().any(Light::has_extent) {
            continue;
        }

        // Analytic maps come from another solver. Elsewhere, a bake to a far smaller error stands for the truth.
        let against = match Reference::analytic(&scene)? {
            Some(reference) => Against::Known(reference),
            None => Against::Bake(Arc::clone(&scene), Box::new(towards(0.002, 60.0))),
        };

        // The default estimator is given targets; splats do not refine and are given densities.
        let variant = |estimator: &str, target, settings: BakeSettings| {
            let labels = vec![
                name.into(),
                estimator.into(),
                share(target),
                settings.density_per_sr.into(),
            ];
            Variant::new(labels, &scene, settings)
        };
        let targets = bench.some(&TARGETS, 4).iter();
        let targets = targets.map(|&target| variant("auto", Some(target), towards(target, 20.0)));
        let densities = bench.some(&DENSITIES, 2).iter();
        let splats = densities.map(|&density| {
            let settings = BakeSettings {
                max_time_s: Some(20.0),
                ..bench.at(splat(density), bench.side())
            };
            variant("splat", None, settings)
        });
        groups.push(Group {
            against,
            variants: targets.chain(splats).collect(),
        });
    }
    Ok(Sweep {
        note: "`auto` refines towards each target; splats trace lattices of given densities. Bakes end after 20 s. Predictions \
               are of when the error was first at most five times the target. A scene without a map that is known is measured against a bake \
               to 0.2 %, where 60 s are enough for that."
            .into(),
        labels: &["scene", "estimator", "target", "density_per_sr"],
        columns: ACCURACY,
        groups,
        plots: PLOTS,
        ..Sweep::default()
    })
}

const SCALING: &[Column] = &[
    RAYS,
    column("segments_per_ray", |m| {
        per_ray(m, m.result.counts.segments as f64)
    }),
    column("plan_cpu_s", |m| m.result.cpu_s.plan.into()),
    column("us_per_ray", |m| {
        per_ray(m, 1e6 * (m.result.cpu_s.trace + m.result.cpu_s.deposit))
    }),
    WALL_S,
    MEMORY_MB,
];

fn per_ray(measured: &Measured, amount: f64) -> Cell {
    (amount / measured.result.counts.rays.max(1) as f64).into()
}

pub(super) fn scaling(bench: &Bench) -> Result<Sweep> {
    const DENSITIES: [f64; 6] = [1e3, 1e4, 1e5, 1e6, 1e7, 1e8];
    const LEVELS: [u32; 5] = [2, 4, 6, 8, 9];
    const SIDES: [usize; 8] = [64, 128, 256, 512, 1024, 2048, 4096, 8192];
    const PLOTS: &[Plot] = &[
        ladder("scaling-rays", "us_per_ray").only("what", "rays"),
        ladder("scaling-memory", "memory_mb").only("what", "rays"),
        ladder("scaling-triangles", "us_per_ray").only("what", "triangles"),
        ladder("scaling-texels", "wall_s").only("what", "texels"),
    ];
    const fn ladder(file: &'static str, y: &'static str) -> Plot {
        Plot::new(file, ["value", y], &["what"])
    }

    // One quantity varies at a time: rays, triangles, texels, threads.
    let ring = scene("ring")?;
    // Too little memory to keep traced light for later changes.
    let thrifty = |settings: BakeSettings| BakeSettings {
        memory_bytes: 16 << 20,
        ..bench.at(settings, 256)
    };
    let usual = splat(if bench.quick { 1e4 } else { 3e5 });
    let step = |what: &str, value: f64, scene: &Arc<Scene>, settings| {
        Variant::new(vec![what.into(), value.into()], scene, settings)
    };

    // Rays per steradian alone: scene and maps stay the same.
    let mut variants = Vec::new();
    for &density in bench.some(&DENSITIES, 3) {
        variants.push(step("rays", density, &ring, thrifty(splat(density))));
    }

    // Each subdivision has four times the triangles of the same ball, under the same light.
    for &levels in bench.some(&LEVELS, 3) {
        let mesh = shapes::sphere(DVec3::new(0.0, 0.8, 0.0), 0.5, levels);
        let ball = over_a_floor(0.6, ("ball", mesh), DVec3::new(0.0, 3.0, 0.0));
        let triangles = 20.0 * 4_f64.powi(levels as i32);
        variants.push(step("triangles", triangles, &ball, bench.at(usual.clone(), 256)));
    }

    // Kernels of the same rays cover more texels as these shrink.
    for &side in bench.some(&SIDES, 3) {
        variants.push(step(
            "texels",
            (side * side) as f64,
            &ring,
            bench.at(usual.clone(), side),
        ));
    }

    // Far more rays, beside which starting the threads does not count.
    for threads in [1, 2] {
        let settings = BakeSettings {
            threads,
            ..thrifty(splat(if bench.quick { 1e4 } else { 1e7 }))
        };
        variants.push(step("threads", threads as f64, &ring, settings));
    }
    Ok(Sweep {
        note: "Splats on `ring`, maps of 256 × 256 texels but where those are counted; triangles: a glass ball over a floor.".into(),
        labels: &["what", "value"],
        columns: SCALING,
        groups: vec![Group {
            against: Against::Nothing,
            variants,
        }],
        plots: PLOTS,
        ..Sweep::default()
    })
}
