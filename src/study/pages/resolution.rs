//! Plate 6: maps of three resolutions.

use super::{Bench, floor, pictures, scene, verdict, wavefront};
use crate::error::Result;
use crate::settings::BakeSettings;
use crate::study::page::{Page, Table};
use crate::study::references::Reference;

/// Texels across and down.
const SIDES: [usize; 3] = [30, 100, 300];

/// [1/sr].
const DENSITY_PER_SR: f64 = 79_577.5;

/// The bake that each size is measured against has so many times the rays.
const TRUTH_FACTOR: f64 = 4.0;

/// "Little effect on the rendering times": less than this ratio between the longest and the shortest.
const LITTLE: f64 = 1.25;

const COLUMNS: [(&str, &str); 7] = [
    ("estimator", "estimator"),
    ("side_texels", "texels across"),
    ("rays", "rays"),
    ("light_pass_cpu_s", "light pass [CPU s]"),
    ("eye_pass_cpu_s", "eye pass [CPU s]"),
    ("relative_rmse", "error at that size"),
    ("ard", "ARD"),
];

const PLATES: [&str; 3] = ["plate6-30", "plate6-100", "plate6-300"];

pub(super) fn page(bench: &Bench) -> Result<Page> {
    let scene = scene("ring")?;
    let mut table = Table::new(&COLUMNS);
    let (mut plates, mut maps) = (Vec::new(), Vec::new());
    let (mut light_s, mut eye_s, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    let splat = BakeSettings {
        density_per_sr: DENSITY_PER_SR,
        ..BakeSettings::splat()
    };
    for (&side, name) in bench.some(&SIDES, 2).iter().zip(PLATES) {
        let finer = wavefront(TRUTH_FACTOR * if bench.quick { 2e3 } else { DENSITY_PER_SR });
        let truth = bench.bake(&scene, &bench.at(finer, side))?;
        let truth = Reference::of_bake(truth.maps, "a finer bake".into());
        for (estimator, settings) in [("splat", splat.clone()), ("wavefront", wavefront(DENSITY_PER_SR))] {
            let measured = bench.measure(&scene, &bench.at(settings, side), &truth)?;
            let caption = format!("{estimator}, {side} × {side} texels");
            let camera = scene.cameras[0].clone();
            let (plate, cpu_s) =
                pictures::view(bench, (name, caption), &scene, &measured.result.maps, camera)?;
            table.rows.push(vec![
                estimator.into(),
                (side as u64).into(),
                measured.rays(),
                measured.cpu_s().into(),
                cpu_s.into(),
                measured.rmse(),
                measured.ard(),
            ]);
            if estimator == "splat" {
                light_s.push(measured.cpu_s());
                eye_s.push(cpu_s);
                errors.push(measured.agreement.relative_rmse);
                plates.push(plate);
                maps.extend(floor(&scene, &measured.result.maps));
            }
        }
    }
    let caption = "The maps themselves, coarsest first.".into();
    plates.push(pictures::sheet("maps", caption, &maps, (maps.len().max(1), 300)));
    Ok(Page {
        title: "Plate 6: resolution of maps".into(),
        settings: format!(
            "`builtin:ring`, {DENSITY_PER_SR} rays/sr; each size against a wavefront of the same size with {TRUTH_FACTOR} times the \
             rays, so that the error is what the rays and kernels leave, not what texels average."
        ),
        table,
        plots: Vec::new(),
        pictures: plates,
        findings: findings(&light_s, &eye_s, &errors),
    })
}

fn findings(light_s: &[f64], eye_s: &[f64], errors: &[f64]) -> Vec<String> {
    let spread = |values: &[f64]| {
        values.iter().copied().fold(0.0, f64::max) / values.iter().copied().fold(f64::INFINITY, f64::min)
    };
    let falls = errors.windows(2).all(|pair| pair[1] > pair[0]);
    vec![
        format!(
            "The paper finds that resolution has little effect on times. The eye pass's differ by a factor of {:.2} here, which {}; \
             the light pass's by {:.2}, which {}.",
            spread(eye_s),
            verdict(spread(eye_s) < LITTLE),
            spread(light_s),
            verdict(spread(light_s) < LITTLE)
        ),
        if falls {
            "At the same rays, finer maps have larger errors: what a coarse texel averages away is noise and blur as well as detail."
                .into()
        } else {
            "At the same rays, the error does not grow with the resolution throughout.".into()
        },
    ]
}
