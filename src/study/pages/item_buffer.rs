//! Section 3.1.2: cells of a cube against cells of equal solid angle.

use super::{Bench, scene_and_truth};
use crate::error::Result;
use crate::settings::{BakeSettings, ItemBufferKind, RayPlacement};
use crate::study::page::{Cell, Curve, Page, Plot, Table};

/// [1/sr].
const DENSITIES: [f64; 4] = [1e3, 1e4, 1e5, 1e6];

/// The flux of a map is right within this.
const NO_BIAS: f64 = 0.01;

const KINDS: [(&str, ItemBufferKind); 2] = [("equal", ItemBufferKind::Equal), ("cube", ItemBufferKind::Cube)];
const SCENES: [&str; 2] = ["ring", "ball"];

const COLUMNS: [(&str, &str); 7] = [
    ("scene", "scene"),
    ("item_buffer", "item buffer"),
    ("density_per_sr", "rays/sr"),
    ("rays", "rays"),
    ("flux_ratio", "flux, over the true one"),
    ("relative_rmse", "error"),
    ("ard", "ARD"),
];

pub(super) fn page(bench: &Bench) -> Result<Page> {
    let mut table = Table::new(&COLUMNS);
    let (mut curves, mut findings) = (Vec::new(), Vec::new());
    for name in bench.some(&SCENES, 1) {
        let (scene, truth) = scene_and_truth(name)?;
        let mut worst = [0.0_f64; 2];
        let mut last = [0.0; 2];
        for (index, (kind, item_buffer)) in KINDS.into_iter().enumerate() {
            let mut points = Vec::new();
            for &density_per_sr in bench.some(&DENSITIES, 2) {
                let settings = BakeSettings {
                    density_per_sr,
                    item_buffer,
                    rays: RayPlacement::Jittered,
                    ..BakeSettings::splat()
                };
                let measured = bench.measure(&scene, &bench.at(settings, bench.side()), &truth)?;
                let agreement = &measured.agreement;
                points.push((measured.result.counts.rays as f64, agreement.relative_rmse));
                worst[index] = worst[index].max((agreement.flux_ratio - 1.0).abs());
                last[index] = agreement.relative_rmse;
                table.rows.push(vec![
                    (*name).into(),
                    kind.into(),
                    density_per_sr.into(),
                    measured.rays(),
                    agreement.flux_ratio.into(),
                    measured.rmse(),
                    Cell::Share(agreement.average_relative_difference),
                ]);
            }
            curves.push(Curve {
                name: format!("{name}, {kind}"),
                points,
            });
        }
        findings.push(finding(name, worst, last));
    }
    Ok(Page {
        title: "Item buffers: the cube against equal solid angles".into(),
        settings: format!(
            "Splats of jittered rays, maps of {0} × {0} texels, against the analytic maps. The cube's cells have equal areas on its \
             faces, so that their solid angles differ by up to 5.2 times; each ray carries the flux of its own cell's solid angle.",
            bench.side()
        ),
        table,
        plots: vec![Plot {
            name: "item-buffer",
            title: "equal solid angles and the cube".into(),
            x: "light rays",
            y: "relative RMSE",
            is_share: true,
            curves,
        }],
        pictures: Vec::new(),
        findings,
    })
}

fn finding(name: &str, worst: [f64; 2], last: [f64; 2]) -> String {
    let is_unbiased = worst[1] < worst[0].max(NO_BIAS);
    format!(
        "`{name}`: the flux of the map is off by at most {:.2} % with equal solid angles and {:.2} % with the cube. The paper expects a \
         bias towards the middle of the cube's faces; {}. With most rays the cube's error is {:.2} times that of equal solid angles: its \
         rays are unevenly dense.",
        100.0 * worst[0],
        100.0 * worst[1],
        if is_unbiased {
            "here there is none, since a ray's flux is that of its cell and only the density of rays is uneven, so this disagrees"
        } else {
            "so it is here, and this agrees"
        },
        last[1] / last[0],
    )
}
