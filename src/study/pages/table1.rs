//! Table 1: what the paper measured at three densities, and what this program does at the same ones.

use super::{Bench, growth, paper, pictures, scene_and_truth, verdict, wavefront};
use crate::error::Result;
use crate::study::page::{Cell, Page, Table};

/// The paper's table: rays per steradian, light rays, light-pass seconds, eye-pass seconds (a 486 at 66 MHz).
const PAPER: [(f64, f64, f64, f64); 3] = [
    (7_957.7, 3_467.0, 11.57, 148.33),
    (79_577.5, 34_680.0, 53.27, 144.72),
    (795_774.7, 346_813.0, 379.22, 135.96),
];

/// Ratios of rays to rays are the same in the paper and here within this.
const SAME_RATIO: f64 = 0.1;

/// Eye passes over maps of different densities take the same time within this.
const SAME_TIME: f64 = 0.25;

const COLUMNS: [(&str, &str); 10] = [
    ("density_per_sr", "rays/sr"),
    ("estimator", "estimator"),
    ("rays", "rays"),
    ("relative_rmse", "error"),
    ("ard", "ARD"),
    ("light_pass_cpu_s", "light pass [CPU s]"),
    ("eye_pass_cpu_s", "eye pass [CPU s]"),
    ("paper_rays", "paper: rays"),
    ("paper_light_pass_s", "paper: light pass [s]"),
    ("paper_eye_pass_s", "paper: eye pass [s]"),
];

pub(super) fn page(bench: &Bench) -> Result<Page> {
    let (scene, truth) = scene_and_truth("ring")?;
    let mut table = Table::new(&COLUMNS);
    let mut plates = Vec::new();
    let (mut rays, mut light_s, mut eye_s) = (Vec::new(), Vec::new(), Vec::new());
    for &(density, paper_rays, paper_light_s, paper_eye_s) in bench.some(&PAPER, 2) {
        for (kind, settings) in [
            ("splat, as the paper", paper(density)),
            ("wavefront", wavefront(density)),
        ] {
            let measured = bench.measure(&scene, &bench.at(settings, bench.side()), &truth)?;
            let name = ["density-a", "density-b", "density-c"][plates.len().min(2)];
            let caption = format!("{kind}, {density} rays/sr");
            let camera = scene.cameras[0].clone();
            let seen = pictures::view(bench, (name, caption), &scene, &measured.result.maps, camera)?;
            table.rows.push(vec![
                density.into(),
                kind.into(),
                measured.rays(),
                measured.rmse(),
                measured.ard(),
                measured.cpu_s().into(),
                seen.1.into(),
                Cell::Count(paper_rays as u64),
                paper_light_s.into(),
                paper_eye_s.into(),
            ]);
            if kind != "wavefront" {
                rays.push(measured.result.counts.rays as f64);
                light_s.push(measured.cpu_s());
                eye_s.push(seen.1);
                plates.push(seen.0);
            }
        }
    }
    Ok(Page {
        title: "Table 1: density of light rays".into(),
        settings: format!(
            "`builtin:ring` in place of the paper's test scene, whose measures it does not give; maps of {0} × {0} texels. \
             \"As the paper\": jittered rays, a cube around the light, discs of the wavefront's area, point samples of a gaussian \
             with σ = 1. Errors are relative RMSE and ARD against {1}. The eye pass is this program's ray tracer on the CPU.",
            bench.side(),
            truth.kind
        ),
        table,
        plots: Vec::new(),
        pictures: plates,
        findings: findings(&rays, &light_s, &eye_s),
    })
}

fn findings(rays: &[f64], light_s: &[f64], eye_s: &[f64]) -> Vec<String> {
    let used = &PAPER[..rays.len()];
    let paper_rays: Vec<f64> = used.iter().map(|row| row.1).collect();
    let paper_light: Vec<f64> = used.iter().map(|row| row.2).collect();
    let ratio = |values: &[f64]| values[values.len() - 1] / values[0];
    let same_rays = (ratio(rays) / ratio(&paper_rays)).ln().abs() < SAME_RATIO;
    let (least, most) = (ratio(light_s), ratio(&paper_light));
    let sublinear = least < ratio(rays) && most < ratio(&paper_rays);
    let spread =
        eye_s.iter().copied().fold(0.0, f64::max) / eye_s.iter().copied().fold(f64::INFINITY, f64::min);
    let solid_sr = |rays: f64, density: f64| rays / density;
    vec![
        format!(
            "Rays grow with the density: {} here, {} in the paper; this {}. Casters fill {:.3} sr around the light here, {:.3} sr \
             there (rays over density).",
            growth(rays),
            growth(&paper_rays),
            verdict(same_rays),
            solid_sr(rays[0], used[0].0),
            solid_sr(paper_rays[0], used[0].0)
        ),
        format!(
            "The light pass grows more slowly than its rays, {} here and {} in the paper, since part of it does not depend on them; \
             this {}. Here that part is the item buffer and the map.",
            growth(light_s),
            growth(&paper_light),
            verdict(sublinear)
        ),
        format!(
            "The eye pass does not depend on the density: its longest time is {spread:.2} times its shortest here, {:.2} times in \
             the paper; this {}.",
            PAPER[0].3 / PAPER[2].3,
            verdict(spread < 1.0 + SAME_TIME)
        ),
    ]
}
