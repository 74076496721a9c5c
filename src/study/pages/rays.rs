//! Figure 6a: error against the number of light rays.

use super::{Bench, paper, scene_and_truth, verdict, wavefront};
use crate::error::Result;
use crate::settings::BakeSettings;
use crate::study::cost::slope;
use crate::study::page::{Curve, Page, Plot, Table};

/// [1/sr].
const DENSITIES: [f64; 7] = [1e3, 3e3, 1e4, 3e4, 1e5, 3e5, 1e6];

/// Error of random rays falls with rays to this power; kernels that shrink do better.
const RANDOM: f64 = -0.5;

/// Powers are taken as the same within this.
const SAME_POWER: f64 = 0.05;

/// Why an error may fall more slowly.
const STAYS: &str = "does not hold: where footprints are larger than texels, kernels shrink as rays are added, and noise \
                     stays";

/// One way to bake.
type Way = (&'static str, fn(f64) -> BakeSettings);

const WAYS: [Way; 3] = [
    ("splat, as the paper", paper),
    ("splat", |density_per_sr| BakeSettings {
        density_per_sr,
        ..BakeSettings::splat()
    }),
    ("wavefront", wavefront),
];

const COLUMNS: [(&str, &str); 6] = [
    ("estimator", "estimator"),
    ("density_per_sr", "rays/sr"),
    ("rays", "rays"),
    ("cpu_s", "CPU s"),
    ("relative_rmse", "error"),
    ("ard", "ARD"),
];

pub(super) fn page(bench: &Bench) -> Result<Page> {
    let (scene, truth) = scene_and_truth("ring")?;
    let mut table = Table::new(&COLUMNS);
    let (mut curves, mut findings) = (Vec::new(), Vec::new());
    for (name, settings) in WAYS {
        let mut points = Vec::new();
        for &density in bench.some(&DENSITIES, 4) {
            let measured = bench.measure(&scene, &bench.at(settings(density), bench.side()), &truth)?;
            points.push((
                measured.result.counts.rays as f64,
                measured.agreement.relative_rmse,
            ));
            table.rows.push(vec![
                name.into(),
                density.into(),
                measured.rays(),
                measured.cpu_s().into(),
                measured.rmse(),
                measured.ard(),
            ]);
        }
        let power = slope(&points).unwrap_or(f64::NAN);
        let falls = points.windows(2).filter(|pair| pair[1].1 < pair[0].1).count();
        findings.push(format!(
            "{name}: error ~ rays^{power:.2}; it fell with {falls} of {} steps. That more rays are better {} with Figure 6a; that \
             the error falls at least as fast as that of random rays (rays^{RANDOM}) {}.",
            points.len() - 1,
            verdict(power < 0.0),
            if power < RANDOM + SAME_POWER { "holds" } else { STAYS },
        ));
        curves.push(Curve {
            name: name.into(),
            points,
        });
    }
    Ok(Page {
        title: "Figure 6a: error against light rays".into(),
        settings: format!(
            "`builtin:ring`, maps of {0} × {0} texels, against {1}.",
            bench.side(),
            truth.kind
        ),
        table,
        plots: vec![Plot {
            name: "rays",
            title: "ring".into(),
            x: "light rays",
            y: "relative RMSE",
            is_share: true,
            curves,
        }],
        pictures: Vec::new(),
        findings,
    })
}
