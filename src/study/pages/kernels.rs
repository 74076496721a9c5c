//! Figure 5, Plates 1 and 2: shapes of kernels, and what scales them.

use super::{Bench, floor, paper, percent, pictures, scene_and_truth, verdict};
use crate::error::Result;
use crate::settings::{BakeSettings, Footprint, Kernel, RayPlacement, Sigma};
use crate::study::agreement::{Agreement, TexelPair};
use crate::study::page::{Cell, Page, Table};

/// Of all bakes [1/sr].
const DENSITY_PER_SR: f64 = 79_577.5;

/// Name, shape and σ, as the paper has them.
const SHAPES: [(&str, Kernel, Sigma); 7] = [
    ("box", Kernel::Box, Sigma::Constant(1.0)),
    ("disc", Kernel::Disc, Sigma::Constant(1.0)),
    ("cone", Kernel::Cone, Sigma::Constant(1.0)),
    ("gaussian 0.5", Kernel::Gaussian, Sigma::Constant(0.5)),
    ("gaussian 1", Kernel::Gaussian, Sigma::Constant(1.0)),
    ("gaussian 2", Kernel::Gaussian, Sigma::Constant(2.0)),
    ("gaussian adaptive", Kernel::Gaussian, Sigma::Adaptive),
];

/// Name and what sets the size.
const SIZES: [(&str, Footprint); 3] = [
    ("neighbours", Footprint::Disc),
    ("distance", Footprint::Distance),
    ("fixed", Footprint::Fixed),
];

/// Name, where rays start in their cells, and the contact sheet.
const RAYS: [(&str, RayPlacement, &str); 2] = [
    ("jittered", RayPlacement::Jittered, "kernels-jittered"),
    ("even", RayPlacement::Lattice, "kernels-even"),
];

const COLUMNS: [(&str, &str); 7] = [
    ("placement", "rays"),
    ("kernel", "kernel"),
    ("size", "scaled by"),
    ("relative_rmse", "error"),
    ("ard", "ARD"),
    ("paper_rms", "RMS as printed (5.1) [W/m²]"),
    ("paper_ard", "ARD as printed (5.2)"),
];

/// One kernel's errors.
struct Measure {
    shape: &'static str,
    size: &'static str,
    rmse: f64,
    ard: f64,
    printed_ard: f64,
}

pub(super) fn page(bench: &Bench) -> Result<Page> {
    let (scene, truth) = scene_and_truth("ring")?;
    let mut table = Table::new(&COLUMNS);
    let (mut sheets, mut findings) = (Vec::new(), Vec::new());
    for (placement, rays, sheet) in RAYS {
        let (mut measures, mut maps) = (Vec::new(), Vec::new());
        for ((size, footprint), (index, (shape, kernel, sigma))) in all() {
            let settings = BakeSettings {
                rays,
                footprint,
                kernel,
                sigma,
                ..paper(DENSITY_PER_SR)
            };
            let result = bench.bake(&scene, &bench.at(settings, bench.side()))?;
            let measure = Measure::new((shape, size), &truth.pairs(&result.maps)?, &mut table, placement);
            measures.extend(measure);
            if index == SHAPES.len() / 2 {
                // The reference is in the middle of its row.
                maps.extend(truth.grid().cloned());
            }
            maps.extend(floor(&scene, &result.maps));
        }
        findings.extend(
            said(&measures)
                .into_iter()
                .map(|text| format!("Rays {placement}: {text}")),
        );
        let caption = format!("Rays {placement}. {SHEET}");
        sheets.push(pictures::sheet(sheet, caption, &maps, (SHAPES.len() + 1, 160)));
    }
    Ok(Page {
        title: "Figure 5: shapes and sizes of kernels".into(),
        settings: format!(
            "`builtin:ring`, {DENSITY_PER_SR} rays/sr, maps of {0} × {0} texels, point-sampled kernels, the cube; rays jittered, as in the \
             paper, and even; against {1}. Error is relative RMSE and ARD leaves out texels below 1 % of the mean; the two last columns \
             are the paper's (5.1), which sums without a mean, and (5.2), which divides by every texel that is not black.",
            bench.side(),
            truth.kind
        ),
        table,
        plots: Vec::new(),
        pictures: sheets,
        findings,
    })
}

const SHEET: &str = "Rows: scaled by neighbours, by distance, fixed. Columns: box, disc, cone, the reference, gaussians of σ = 0.5, 1, 2 \
                     and adaptive.";

type Size = (&'static str, Footprint);
type Shape = (&'static str, Kernel, Sigma);

/// Every size with every shape and its place in the row.
fn all() -> impl Iterator<Item = (Size, (usize, Shape))> {
    let shapes = || SHAPES.into_iter().enumerate();
    SIZES
        .into_iter()
        .flat_map(move |size| shapes().map(move |shape| (size, shape)))
}

impl Measure {
    /// Also a row of the table; `None` where the reference is dark.
    fn new(
        (shape, size): (&'static str, &'static str),
        pairs: &[TexelPair],
        table: &mut Table,
        placement: &str,
    ) -> Option<Self> {
        let agreement = Agreement::of(pairs)?;
        let (rms, printed_ard) = printed(pairs);
        table.rows.push(vec![
            placement.into(),
            shape.into(),
            size.into(),
            Cell::Share(agreement.relative_rmse),
            Cell::Share(agreement.average_relative_difference),
            rms.into(),
            Cell::Share(printed_ard),
        ]);
        Some(Self {
            shape,
            size,
            rmse: agreement.relative_rmse,
            ard: agreement.average_relative_difference,
            printed_ard,
        })
    }
}

/// RMS and ARD as the paper prints them.
fn printed(pairs: &[TexelPair]) -> (f64, f64) {
    let squares: f64 = pairs
        .iter()
        .map(|pair| (pair.image - pair.reference).powi(2))
        .sum();
    let lit = pairs.iter().filter(|pair| pair.reference > 0.0);
    let differences: f64 = lit
        .map(|pair| (pair.image - pair.reference).abs() / pair.reference)
        .sum();
    (squares.sqrt(), differences / pairs.len() as f64)
}

fn said(measures: &[Measure]) -> Vec<String> {
    let of = |size: &'static str| measures.iter().filter(move |measure| measure.size == size);
    let best = |size: &'static str| of(size).min_by(|a, b| a.rmse.total_cmp(&b.rmse));
    let find = |shape: &str, size: &'static str| of(size).find(|measure| measure.shape == shape);
    let mut findings = Vec::new();
    if let Some(best) = best("neighbours") {
        findings.push(format!(
            "scaled by neighbours, {} has the least error, {}. The paper finds the gaussian of σ = 1 best; this {}.",
            best.shape,
            percent(best.rmse),
            verdict(best.shape == "gaussian 1")
        ));
    }
    if let (Some(adaptive), Some(one)) = (
        find("gaussian adaptive", "neighbours"),
        find("gaussian 1", "neighbours"),
    ) {
        findings.push(format!(
            "the adaptive σ gives {}, σ = 1 {}. The paper is surprised that adapting is worse; this {}.",
            percent(adaptive.rmse),
            percent(one.rmse),
            verdict(adaptive.rmse > one.rmse)
        ));
    }
    if let (Some(fixed), Some(neighbours)) = (best("fixed"), best("neighbours")) {
        findings.push(format!(
            "the best fixed kernel ({}) has an error of {}, the best scaled one {}: that a fixed size misses the curves {}.",
            fixed.shape,
            percent(fixed.rmse),
            percent(neighbours.rmse),
            verdict(fixed.rmse > neighbours.rmse)
        ));
    }
    if let (Some(distance), Some(one)) = (find("gaussian 1", "distance"), find("gaussian 1", "neighbours")) {
        findings.push(format!(
            "a gaussian of σ = 1 scaled by distance: error {} and ARD {}, by neighbours {} and {}. The paper finds the distance's ARD to \
             tell of noise that its RMS hides; that its ARD is the worse by more than its RMS {}.",
            percent(distance.rmse),
            percent(distance.ard),
            percent(one.rmse),
            percent(one.ard),
            verdict(distance.ard / one.ard > distance.rmse / one.rmse)
        ));
    }
    let most = measures
        .iter()
        .map(|measure| measure.printed_ard)
        .fold(0.0, f64::max);
    let ours = measures.iter().map(|measure| measure.ard).fold(0.0, f64::max);
    findings.push(format!(
        "as printed, ARD reaches {} where ours reaches {}: nearly black texels beside an edge, which wide kernels light, are divided by \
         next to nothing.",
        percent(most),
        percent(ours)
    ));
    findings
}
