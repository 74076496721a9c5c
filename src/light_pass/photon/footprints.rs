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

/// Goal of the squares: that of a first picture.
const GOAL: f64 = 0.2;

/// Looks at the light of one light without depositing any.
pub struct FootprintPass<'a> {
    pub launch: &'a PhotonLaunch<'a>,
    pub rules: PhotonRules<'a>,
    /// Of any size.
    pub chart_for: &'a ChartFor<'a>,
    /// Parts of each root of the launch domain whose footprints are asked for.
    pub cells: f64,
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
        for square in &squares.squares {
            for bundle in &square.bundles {
                self.add(bundle, square.place.area(), &receivers, &mut report.statistics);
            }
        }
        report.trace_s.add(watch.elapsed());
        report.cancelled = control.is_cancelled();
        report
    }

    /// Adds the footprints of a bundle of a square with this area.
    fn add(&self, bundle: &Bundle, area: f64, receivers: &Receivers, statistics: &mut FootprintStatistics) {
        let receiver = bundle.receiver();
        let Some(chart) = receivers.get(receiver) else {
            return;
        };
        let size = DVec2::new(chart.chart.width as f64, chart.chart.height as f64);
        bundle.triangles(area, |corners, flux_w, area| {
            let [a, b, c] = corners.map(|corner| corner / size);
            let cells = area * self.cells;
            let flux_w = flux_w.luminance() * area;
            let map_share = 0.5 * (b - a).perp_dot(c - a).abs() / cells;
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
