//! Figure 6b: error against the gaussian's σ.

use super::{Bench, paper, percent, scene_and_truth, verdict};
use crate::error::Result;
use crate::settings::{BakeSettings, RayPlacement, Sigma};
use crate::study::page::{Curve, Page, Plot, Table};

const SIGMAS: [f64; 12] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9, 1.0, 1.4, 2.0, 3.0, 5.0];
/// Where time is short.
const FEW: [f64; 5] = [0.1, 0.3, 0.5, 1.0, 3.0];

/// The paper's densest lattice but one [1/sr].
const DENSITY_PER_SR: f64 = 79_577.5;

/// Where the paper has the least error.
const PAPER_MINIMUM: (f64, f64) = (0.9, 1.0);

/// σ counts squared lengths: in squares of half the side of the square of the footprint's area instead of squares of the
/// radius of its disc, the same kernel has a σ so many times as large.
const PER_HALF_SIDE: f64 = 4.0 / std::f64::consts::PI;

const COLUMNS: [(&str, &str); 5] = [
    ("kernel", "kernel"),
    ("sigma", "σ"),
    ("sigma_half_sides", "σ in half sides"),
    ("relative_rmse", "error"),
    ("ard", "ARD"),
];

pub(super) fn page(bench: &Bench) -> Result<Page> {
    let (scene, truth) = scene_and_truth("ring")?;
    let mut table = Table::new(&COLUMNS);
    let (mut curves, mut findings) = (Vec::new(), Vec::new());
    let ours = BakeSettings {
        density_per_sr: DENSITY_PER_SR,
        ..BakeSettings::splat()
    };
    let even = BakeSettings {
        rays: RayPlacement::Lattice,
        ..paper(DENSITY_PER_SR)
    };
    for (name, settings) in [
        ("as the paper", paper(DENSITY_PER_SR)),
        ("as the paper, without jitter", even),
        ("ellipses, integrated", ours),
    ] {
        let mut points = Vec::new();
        for &sigma in if bench.quick { &FEW[..] } else { &SIGMAS[..] } {
            let settings = BakeSettings {
                sigma: Sigma::Constant(sigma),
                ..settings.clone()
            };
            let measured = bench.measure(&scene, &bench.at(settings, bench.side()), &truth)?;
            points.push((sigma, measured.agreement.relative_rmse));
            table.rows.push(vec![
                name.into(),
                sigma.into(),
                (sigma * PER_HALF_SIDE).into(),
                measured.rmse(),
                measured.ard(),
            ]);
        }
        findings.push(finding(name, &points));
        curves.push(Curve {
            name: name.into(),
            points,
        });
    }
    Ok(Page {
        title: "Figure 6b: error against σ".into(),
        settings: format!(
            "`builtin:ring`, {DENSITY_PER_SR} rays/sr, maps of {0} × {0} texels, against {1}. The paper writes the kernel as \
             exp(−r²/2σ) without the unit of r. Here r is 1 on the edge of the disc of the footprint's area; the second column has \
             the same kernel with r = 1 at half a side of the square of that area.",
            bench.side(),
            truth.kind
        ),
        table,
        plots: vec![Plot {
            name: "sigma",
            title: "ring".into(),
            x: "σ [footprint radii²]",
            y: "relative RMSE",
            is_share: true,
            curves,
        }],
        pictures: Vec::new(),
        findings,
    })
}

fn finding(name: &str, points: &[(f64, f64)]) -> String {
    let least = points.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let Some(&(sigma, error)) = least else {
        return format!("{name}: nothing was measured.");
    };
    let at_one = points.iter().find(|point| (point.0 - 1.0).abs() < 1e-9);
    let (low, high) = PAPER_MINIMUM;
    let half_sides = sigma * PER_HALF_SIDE;
    let agrees = [sigma, half_sides]
        .iter()
        .any(|sigma| (0.8 * low..=1.2 * high).contains(sigma));
    let is_last = points.last().is_some_and(|last| last.0 <= sigma);
    format!(
        "{name}: the error is least, {}, at σ = {sigma} ({half_sides:.2} in half sides), and {} at σ = 1. The paper has its minimum \
         at {low} to {high}; this {}{}",
        percent(error),
        at_one.map_or("unknown".into(), |point| percent(point.1)),
        verdict(agrees),
        match (agrees, is_last) {
            (true, _) if !(0.8 * low..=1.2 * high).contains(&sigma) => " where r counts half sides.",
            (true, _) => ".",
            (false, true) => {
                ": the widest kernel is the best: round kernels that are sampled at texels' centres leave gaps and peaks, \
                 which outweigh what width blurs. The paper does not say how large its map is and how its reference came about."
            }
            (false, false) =>
                ": the unevenness of rays and kernels weighs otherwise against blur than in the paper's scene.",
        }
    )
}
