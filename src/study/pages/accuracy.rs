//! What accuracy costs: every built-in scene by both estimators, and how well that was predicted.

use std::sync::Arc;

use super::{Bench, percent, scene};
use crate::error::Result;
use crate::scene::{Scene, builtin};
use crate::session::forecast::{forecast, stood_at};
use crate::session::{BakeResult, CostPoint, Forecast, StopReason};
use crate::settings::{BakeSettings, Estimator};
use crate::study::agreement::Agreement;
use crate::study::convergence::name;
use crate::study::cost::{self, Cost};
use crate::study::page::{Cell, Curve, Page, Plot, Table};
use crate::study::references::Reference;
use crate::study::repeats::light_pass_cpu_s;

/// Relative RMSE that bakes aim at.
const TARGETS: [f64; 5] = [0.10, 0.05, 0.02, 0.01, 0.005];

/// Splats have no target, but these densities [1/sr].
const DENSITIES: [f64; 4] = [1e4, 1e5, 1e6, 4e6];

/// Of the bake that is the reference where there is no other.
const TRUTH: f64 = 0.002;

/// A bake is no reference where it is not known better than this.
const TRUSTED: f64 = 0.01;

/// Nothing is said of costs this many times beyond the most that was measured.
const FARTHEST: f64 = 100.0;

/// Bakes end after so long [s].
const LIMIT_S: f64 = 20.0;
const TRUTH_LIMIT_S: f64 = 60.0;

/// A target's prediction is made when the error is so many times as large: 5 % for 1 %.
const MADE_AT: f64 = 5.0;

/// The target that predictions are judged by.
const JUDGED: f64 = 0.01;

const COLUMNS: [(&str, &str); 16] = [
    ("scene", "scene"),
    ("estimator", "estimator"),
    ("target", "target"),
    ("density_per_sr", "rays/sr"),
    ("rays", "rays"),
    ("cpu_s", "CPU s"),
    ("wall_s", "wall s"),
    ("memory_mb", "MB"),
    ("estimated_rmse", "estimated"),
    ("true_rmse", "true"),
    ("stop", "ended by"),
    ("made_at_rmse", "predicted at"),
    ("predicted_rays", "rays predicted"),
    ("predicted_cpu_s", "CPU s predicted"),
    ("rays_ratio", "rays, predicted/actual"),
    ("cpu_ratio", "CPU, predicted/actual"),
];

/// One bake.
struct Run {
    scene: &'static str,
    estimator: Estimator,
    target: Option<f64>,
    density_per_sr: f64,
    result: BakeResult,
    agreement: Option<Agreement>,
    predicted: Option<(CostPoint, Forecast)>,
}

pub(super) fn page(bench: &Bench) -> Result<Page> {
    let names: &[&'static str] = if bench.quick {
        &["mirror", "pool"]
    } else {
        &builtin::NAMES
    };
    let (mut runs, mut references) = (Vec::new(), Vec::new());
    for name in names {
        let scene = scene(name)?;
        let reference = match Reference::analytic(&scene)? {
            Some(reference) => Some(reference),
            None => truth(bench, &scene)?,
        };
        let kind = reference.as_ref().map_or("nothing", |reference| &reference.kind);
        references.push(format!("`{name}`: {kind}"));
        let reference = reference.as_ref();
        for &target in bench.some(&TARGETS, 4) {
            runs.push(towards(bench, (name, &scene), target, reference)?);
        }
        for &density in bench.some(&DENSITIES, 2) {
            runs.push(splats(bench, (name, &scene), density, reference)?);
        }
    }
    let mut table = Table::new(&COLUMNS);
    table.rows = runs.iter().map(Run::row).collect();
    Ok(Page {
        title: "What accuracy costs".into(),
        settings: format!(
            "Every built-in scene, maps of {0} × {0} texels, caustic layer. The wavefront refines towards each target; splats \
             trace lattices of given densities. Bakes end after {LIMIT_S} s. Errors are relative RMSE: as estimated by the bake, \
             and true, against {1}. The prediction for a target is made at the first level whose estimated error is at most \
             {MADE_AT} times the target.",
            bench.side(),
            references.join("; ")
        ),
        table,
        plots: plots(names, &runs),
        pictures: Vec::new(),
        findings: findings(names, &runs),
    })
}

/// A bake far finer than the others; `None` where that is not known well enough in the time.
fn truth(bench: &Bench, scene: &Arc<Scene>) -> Result<Option<Reference>> {
    let settings = bench.at(
        BakeSettings {
            max_error: Some(TRUTH),
            max_time_s: Some(TRUTH_LIMIT_S),
            ..super::wavefront(BakeSettings::starting_density_per_sr(TRUTH))
        },
        bench.side(),
    );
    let result = bench.bake(scene, &settings)?;
    let trusted = result.estimated_relative_rmse.filter(|error| *error <= TRUSTED);
    Ok(trusted.map(|error| {
        let rays = result.counts.rays;
        let kind = format!("a bake of {rays} rays at an estimated {}", percent(error));
        Reference::of_bake(result.maps, kind)
    }))
}

fn towards(
    bench: &Bench,
    (name, scene): (&'static str, &Arc<Scene>),
    target: f64,
    reference: Option<&Reference>,
) -> Result<Run> {
    let density_per_sr = BakeSettings::starting_density_per_sr(target);
    let settings = BakeSettings {
        max_error: Some(target),
        max_time_s: Some(LIMIT_S),
        ..super::wavefront(density_per_sr)
    };
    let result = bench.bake(scene, &bench.at(settings, bench.side()))?;
    let course = &result.course;
    let predicted = stood_at(course, MADE_AT * target).and_then(|made| {
        let expected = forecast(&course[..=made], target, Estimator::Wavefront)?;
        (result.stop_reason == StopReason::MaxError).then_some((course[made], expected))
    });
    Ok(Run {
        scene: name,
        estimator: Estimator::Wavefront,
        target: Some(target),
        density_per_sr,
        agreement: agreement(reference, &result)?,
        result,
        predicted,
    })
}

fn splats(
    bench: &Bench,
    (name, scene): (&'static str, &Arc<Scene>),
    density_per_sr: f64,
    reference: Option<&Reference>,
) -> Result<Run> {
    let settings = BakeSettings {
        density_per_sr,
        max_time_s: Some(LIMIT_S),
        ..BakeSettings::splat()
    };
    let result = bench.bake(scene, &bench.at(settings, bench.side()))?;
    Ok(Run {
        scene: name,
        estimator: Estimator::Splat,
        target: None,
        density_per_sr,
        agreement: agreement(reference, &result)?,
        result,
        predicted: None,
    })
}

fn agreement(reference: Option<&Reference>, result: &BakeResult) -> Result<Option<Agreement>> {
    let measure = |reference: &Reference| reference.measure(&result.maps);
    reference.map(measure).transpose()
}

impl Run {
    fn rays(&self) -> f64 {
        self.result.counts.rays as f64
    }

    fn cpu_s(&self) -> f64 {
        light_pass_cpu_s(&self.result)
    }

    fn true_error(&self) -> Option<f64> {
        Some(self.agreement?.relative_rmse)
    }

    /// Predicted over actual: rays and CPU time.
    fn ratios(&self) -> Option<(f64, f64)> {
        let (_, expected) = self.predicted?;
        let actual = self.result.course.last()?;
        Some((
            expected.rays as f64 / actual.rays as f64,
            expected.cpu_s / actual.cpu_s,
        ))
    }

    fn row(&self) -> Vec<Cell> {
        let result = &self.result;
        let times = &result.timings_s;
        let or_empty = |value: Option<f64>, cell: fn(f64) -> Cell| value.map_or(Cell::Empty, cell);
        let memory_mb = result.course.last().map(|point| point.bytes as f64 / 1e6);
        let (made_at, expected) = (
            self.predicted.map(|(point, _)| point.relative_rmse),
            self.predicted.map(|(_, expected)| expected),
        );
        vec![
            self.scene.into(),
            name(self.estimator).into(),
            or_empty(self.target, Cell::Share),
            self.density_per_sr.into(),
            result.counts.rays.into(),
            self.cpu_s().into(),
            (times.plan + times.trace + times.deposit).into(),
            or_empty(memory_mb, Cell::Number),
            or_empty(result.estimated_relative_rmse, Cell::Share),
            or_empty(self.true_error(), Cell::Share),
            match result.stop_reason {
                StopReason::MaxError => "target",
                StopReason::MaxTime => "time",
                StopReason::Memory => "memory",
                StopReason::Density => "density",
                StopReason::NothingToDo => "nothing",
                StopReason::Cancelled => "cancelled",
            }
            .into(),
            or_empty(made_at, Cell::Share),
            expected.map_or(Cell::Empty, |expected| expected.rays.into()),
            or_empty(expected.map(|expected| expected.cpu_s), Cell::Number),
            or_empty(self.ratios().map(|ratios| ratios.0), Cell::Number),
            or_empty(self.ratios().map(|ratios| ratios.1), Cell::Number),
        ]
    }
}

/// (cost, true error) of an estimator on a scene, cheapest first; without bakes that time cut off.
fn points(runs: &[Run], scene: &str, estimator: Estimator, cost: fn(&Run) -> f64) -> Vec<(f64, f64)> {
    let of = runs.iter().filter(|run| {
        run.scene == scene && run.estimator == estimator && run.result.stop_reason != StopReason::MaxTime
    });
    let point = |run: &Run| Some((cost(run), run.true_error()?));
    let mut points: Vec<(f64, f64)> = of.filter_map(point).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
}

fn plots(names: &[&'static str], runs: &[Run]) -> Vec<Plot> {
    let plot = |file, title: &str, x, estimator, cost: fn(&Run) -> f64| Plot {
        name: file,
        title: title.into(),
        x,
        y: "relative RMSE",
        is_share: true,
        curves: names
            .iter()
            .map(|name| Curve {
                name: (*name).into(),
                points: points(runs, name, estimator, cost),
            })
            .filter(|curve| !curve.points.is_empty())
            .collect(),
    };
    let (rays, cpu_s) = ("light rays", "CPU time of the light pass [s]");
    vec![
        plot(
            "wavefront-cpu",
            "wavefront",
            cpu_s,
            Estimator::Wavefront,
            Run::cpu_s,
        ),
        plot(
            "wavefront-rays",
            "wavefront",
            rays,
            Estimator::Wavefront,
            Run::rays,
        ),
        plot("splat-cpu", "splat", cpu_s, Estimator::Splat, Run::cpu_s),
        plot("splat-rays", "splat", rays, Estimator::Splat, Run::rays),
    ]
}

fn findings(names: &[&'static str], runs: &[Run]) -> Vec<String> {
    let mut findings = Vec::new();
    let judged = runs.iter().filter(|run| run.target == Some(JUDGED));
    let ratios: Vec<(&str, f64, f64)> = judged
        .filter_map(|run| run.ratios().map(|(rays, cpu)| (run.scene, rays, cpu)))
        .collect();
    let off = |ratio: f64| ratio.max(1.0 / ratio);
    let within = |of: fn(&(&str, f64, f64)) -> f64| ratios.iter().filter(|r| off(of(r)) <= 2.0).count();
    let worst = ratios.iter().max_by(|a, b| off(a.2).total_cmp(&off(b.2)));
    if let Some((scene, _, ratio)) = worst {
        findings.push(format!(
            "Predicted when the error stood at {} or below, the CPU time to {} was right within a factor of two on {} of {} \
             scenes that got there, the rays on {}; farthest off was `{scene}`, by {:.2}.",
            percent(MADE_AT * JUDGED),
            percent(JUDGED),
            within(|r| r.2),
            ratios.len(),
            within(|r| r.1),
            off(*ratio)
        ));
    }
    let is_judged = |name: &&&str| {
        runs.iter()
            .any(|run| run.scene == **name && run.agreement.is_some())
    };
    let (judged, others): (Vec<&&str>, Vec<&&str>) = names.iter().partition(is_judged);
    for name in judged {
        let price = |estimator, cost: fn(&Run) -> f64| price(&points(runs, name, estimator, cost));
        findings.push(format!(
            "`{name}`: a true error of {} takes the wavefront {} rays and {} CPU s, splats {} and {} (~ extrapolated, < already \
             with the least).",
            percent(JUDGED),
            price(Estimator::Wavefront, Run::rays),
            price(Estimator::Wavefront, Run::cpu_s),
            price(Estimator::Splat, Run::rays),
            price(Estimator::Splat, Run::cpu_s),
        ));
    }
    if !others.is_empty() {
        let names: Vec<String> = others.iter().map(|name| format!("`{name}`")).collect();
        findings.push(format!(
            "{}: no bake is known to {} after {TRUTH_LIMIT_S} s, so that their true errors are not.",
            names.join(", "),
            percent(TRUSTED)
        ));
    }
    findings
}

/// What the judged target costs, for people.
fn price(points: &[(f64, f64)]) -> String {
    let most = points.iter().map(|point| point.0).fold(0.0, f64::max);
    match cost::cost_of(points, JUDGED) {
        Some(Cost::Extrapolated(value)) if value > FARTHEST * most => "far more than was measured".into(),
        Some(cost) => cost.to_string(),
        None => "an unknown number".into(),
    }
}
