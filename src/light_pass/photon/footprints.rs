//! Footprints of a light's bundles: they tell how fine the maps have to be.

use glam::{DVec2, DVec3};

use super::bundle::Bundle;
use super::edge;
use super::launch::PhotonLaunch;
use super::paths::{PathFinder, Route};
use super::receivers::Receivers;
use super::squares::Squares;
use super::survey::Surveyor;
use super::walk::PhotonRules;
use crate::light_pass::footprint_statistics::{FootprintSample, FootprintStatistics};
use crate::light_pass::pass_report::{PassReport, Stopwatch};
use crate::light_pass::receiver_maps::ChartFor;
use crate::progress::Control;
use crate::scene::Object;

/// Goal of the squares: that of a first picture.
const GOAL: f64 = 0.2;

/// Distance from which the light of a caster that touches its receiver is resolved, in mean radii of the caster: foci of
/// a glass ball and of a cup are nearer.
const MIN_LEG_IN_RADII: f64 = 10.0;

/// Minimum thickness of a caster for its mean radius, in diagonals of its box.
const MIN_THICKNESS: f64 = 0.05;

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
    /// Angular width of the light as casters see it.
    pub blur_rad: f64,
    /// Distance that the cells of a sun are made for [m]; `None` keeps them. Light that ends nearer has finer ones: a glass
    /// in a wide landscape throws light as fine as one in a room.
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
        let surveyor = Surveyor::new(finder, control, None);
        let mut squares = Squares::default();
        surveyor.refine(&mut squares, GOAL);
        edge::finish(&finder, &mut squares, control, &mut report);
        report.rays += squares.points.len() as u64;
        let legs_m = self.min_legs_m();
        for square in &squares.squares {
            for bundle in &square.bundles {
                let nearer = self.nearer(&bundle.route, &legs_m);
                self.add(
                    bundle,
                    (square.place.area(), nearer),
                    &receivers,
                    &mut report.statistics,
                );
            }
        }
        report.trace_s.add(watch.elapsed());
        report.cancelled = control.is_cancelled();
        report
    }

    /// By object: the distance at which its light is resolved at least [m].
    fn min_legs_m(&self) -> Vec<f64> {
        let of_object = |object: &Object| {
            object.bounds().map_or(f64::INFINITY, |(low, high)| {
                let sides = (high - low).max(DVec3::splat(MIN_THICKNESS * low.distance(high)));
                MIN_LEG_IN_RADII * 0.5 * sides.element_product().cbrt()
            })
        };
        self.rules.tracer.scene().objects.iter().map(of_object).collect()
    }

    /// By how much the details of a path's light are smaller than its footprints.
    fn nearer(&self, route: &Route, legs_m: &[f64]) -> f64 {
        let Some(reach_m) = self.reach_m else {
            return 1.0;
        };
        let steps = (0..route.chain.len()).filter_map(|depth| route.chain.step(depth));
        let least_m = steps
            .map(|step| legs_m[step.object as usize])
            .fold(f64::INFINITY, f64::min);
        let nearer = reach_m / least_m.max(f64::from(route.leg_m));
        if nearer.is_finite() {
            nearer.max(1.0).powi(2)
        } else {
            1.0
        }
    }

    /// Adds the footprints of a bundle of a square with this area, with details so much smaller.
    fn add(
        &self,
        bundle: &Bundle,
        (area, nearer): (f64, f64),
        receivers: &Receivers,
        statistics: &mut FootprintStatistics,
    ) {
        let receiver = bundle.receiver();
        let Some(chart) = receivers.get(receiver) else {
            return;
        };
        let size = DVec2::new(chart.chart.width as f64, chart.chart.height as f64);
        let blurred_m = f64::from(bundle.route.leg_m) * self.blur_rad / TEXELS_PER_IMAGE;
        let blurred_share = blurred_m * blurred_m / chart.area_m2;
        bundle.triangles(area, |corners, flux_w, area| {
            let [a, b, c] = corners.map(|corner| corner / size);
            let flux_w = flux_w.luminance() * area;
            let map_share = 0.5 * (b - a).perp_dot(c - a).abs() / (area * self.cells);
            // Light that is seen edge-on has no detail to resolve.
            if map_share <= 0.0 {
                return;
            }
            let detail_share = (map_share / nearer).max(blurred_share);
            let map_share = map_share.max(blurred_share);
            statistics.add(receiver, flux_w, map_share * chart.area_m2, map_share);
            statistics.add_spot(FootprintSample {
                receiver,
                bounds: (a.min(b).min(c), a.max(b).max(c)),
                flux_w,
                map_share: detail_share,
            });
        });
    }
}
