//! Footprints of a light's bundles: they tell how fine the maps have to be.

use glam::DVec2;

use super::bundle::Bundle;
use super::domain::LitCells;
use super::edge;
use super::launch::PhotonLaunch;
use super::paths::PathFinder;
use super::receivers::Receivers;
use super::squares::{Squares, Surveyor};
use super::walk::PhotonRules;
use crate::light_pass::footprint_statistics::{FootprintSample, FootprintStatistics};
use crate::light_pass::pass_report::{PassReport, Stopwatch};
use crate::light_pass::receiver_maps::ChartFor;
use crate::progress::Control;
use crate::scene::Object;

/// Goal of the squares: that of a first picture.
const GOAL: f64 = 0.2;

/// Distance of the light of a small caster that is to be resolved, in radii of the caster: as far as receivers are from
/// the casters of the built-in scenes.
const REACH_IN_RADII: f64 = 5.0;

/// Texels across the image of a lamp: its edges are no sharper.
const TEXELS_PER_IMAGE: f64 = 2.0;

/// Looks at the light of one light without depositing any.
pub struct FootprintPass<'a> {
    pub launch: &'a PhotonLaunch<'a>,
    pub rules: PhotonRules<'a>,
    /// Of any size.
    pub chart_for: &'a ChartFor<'a>,
    /// Parts of each root of the launch domain whose footprints are asked for.
    pub cells: f64,
    /// Angular diameter of the light.
    pub blur_rad: f64,
    /// Distance that the cells of a sun are made for [m]. Casters that are small beside it have finer ones: a glass in a
    /// wide landscape throws its light no farther than one in a room.
    pub reach_m: Option<f64>,
}

impl FootprintPass<'_> {
    /// Rays, times and the footprints.
    pub fn run(&self, control: &Control) -> PassReport {
        let watch = Stopwatch::start();
        let mut report = PassReport::default();
        let receivers = Receivers::new(self.rules.tracer.scene().objects.len(), self.chart_for);
        let finder = PathFinder {
            launch: self.launch,
            rules: self.rules,
            receivers: &receivers,
        };
        let surveyor = Surveyor {
            finder,
            control,
            lit: LitCells::of(self.launch),
            sought: None,
        };
        let mut squares = Squares::default();
        surveyor.refine(&mut squares, GOAL);
        edge::finish(&finder, &mut squares, control, &mut report);
        report.rays += squares.points.len() as u64;
        let finer = self.finer_cells();
        for square in &squares.squares {
            for bundle in &square.bundles {
                let chain = bundle.route.chain;
                let steps = (0..chain.len()).filter_map(|depth| chain.step(depth));
                let finest = steps.map(|step| finer[step.object as usize]).fold(1.0, f64::max);
                self.add(
                    bundle,
                    (square.place.area(), finest),
                    &receivers,
                    &mut report.statistics,
                );
            }
        }
        report.trace_s.add(watch.elapsed());
        report.cancelled = control.is_cancelled();
        report
    }

    /// By object: how many cells there are for one, so that its own light is resolved.
    fn finer_cells(&self) -> Vec<f64> {
        let of_object = |object: &Object| {
            let (low, high) = object.bounds()?;
            let reach_m = REACH_IN_RADII * 0.5 * low.distance(high);
            Some((self.reach_m? / reach_m).max(1.0).powi(2)).filter(|cells| cells.is_finite())
        };
        let objects = &self.rules.tracer.scene().objects;
        objects
            .iter()
            .map(|object| of_object(object).unwrap_or(1.0))
            .collect()
    }

    /// Adds the footprints of a bundle of a square with this area, for `finer` times the cells.
    fn add(
        &self,
        bundle: &Bundle,
        (area, finer): (f64, f64),
        receivers: &Receivers,
        statistics: &mut FootprintStatistics,
    ) {
        let receiver = bundle.receiver();
        let Some(chart) = receivers.get(receiver) else {
            return;
        };
        let blurred_m = f64::from(bundle.route.leg_m) * self.blur_rad / TEXELS_PER_IMAGE;
        let size = DVec2::new(chart.chart.width as f64, chart.chart.height as f64);
        bundle.triangles(area, |corners, flux_w, area| {
            let [a, b, c] = corners.map(|corner| corner / size);
            let cells = area * finer * self.cells;
            let flux_w = flux_w.luminance() * area;
            let map_share =
                (0.5 * (b - a).perp_dot(c - a).abs() / cells).max(blurred_m * blurred_m / chart.area_m2);
            statistics.add(receiver, flux_w, map_share * chart.area_m2, map_share);
            statistics.add_spot(FootprintSample {
                receiver,
                bounds: (a.min(b).min(c), a.max(b).max(c)),
                flux_w,
                map_share,
            });
        });
    }
}
