//! The caustic layer by the wavefront estimator.

use glam::DVec2;

use super::Clock;
use super::caustic_layer::{CausticLayer, CausticOutcome};
use super::wavefront_cache::WavefrontCache;
use crate::error::Result;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::caustic::pass::Listener;
use crate::light_pass::caustic::setup::AimedLight;
use crate::light_pass::caustic::statistics::FootprintStatistics;
use crate::light_pass::receiver_maps::{ChartFor, ReceiverMaps};
use crate::light_pass::wavefront::bodies::SmallBodies;
use crate::light_pass::wavefront::lattice::WavefrontLattice;
use crate::light_pass::wavefront::pass::WavefrontDepositor;
use crate::light_pass::wavefront::receivers::Receivers;
use crate::light_pass::wavefront::refine::Refinement;
use crate::light_pass::wavefront::trace::StrandTracer;
use crate::progress::{Control, Progress};
use crate::settings::{MapResolution, Sigma};

impl CausticLayer<'_> {
    /// Traces and deposits all lights.
    pub(super) fn bake_wavefront(
        &self,
        progress: &dyn Progress,
        control: &Control,
        clock: &mut Clock,
        cache: &mut WavefrontCache,
    ) -> Result<CausticOutcome> {
        let unit = self.unit()?;
        let mut outcome = CausticOutcome::default();
        cache.prepare(self);
        let is_auto = self.settings.map_resolution == MapResolution::Auto;
        if is_auto && cache.statistics.is_none() {
            cache.statistics = Some(self.coarse_wavefront(unit, control, clock, &mut outcome));
        }
        let statistics = cache.statistics.as_ref().filter(|_| is_auto);
        let sizes = self.map_sizes(statistics)?;
        if let Some(statistics) = statistics {
            outcome.warnings = self.coarse_maps(&sizes, statistics);
        }
        let chart_for = |object: usize| self.chart(object, &sizes);
        let mut maps = ReceiverMaps::new(self.tracer.scene().objects.len());
        let bodies: Vec<SmallBodies> = self
            .aim
            .lights
            .iter()
            .map(|light| self.small_bodies(light, unit))
            .collect();
        let lattices: Vec<WavefrontLattice> = self
            .aim
            .lights
            .iter()
            .zip(&bodies)
            .map(|(light, bodies)| self.wavefront_lattice(light, bodies, 1, unit))
            .collect();
        let total = lattices.iter().map(WavefrontLattice::cell_count).sum();
        let receivers = Receivers::new(self.tracer, &chart_for);
        let reference_w = self.reference_w();
        let coarseness = self.settings.max_error.map_or(1.0, Refinement::coarseness);
        let refinement = self
            .settings
            .max_error
            .map(|target| Refinement::new(&receivers, reference_w, target, total));
        let kept = std::mem::take(&mut cache.lights);
        let is_kept = kept.len() == lattices.len();
        let mut keep_bytes = self.settings.kept_light_bytes();
        for (index, (light, lattice)) in self.aim.lights.iter().zip(lattices).enumerate() {
            let depositor = WavefrontDepositor {
                receivers: &receivers,
                chart_for: &chart_for,
                lattice: WavefrontLattice {
                    refinement: refinement.as_ref(),
                    ..lattice
                },
                reference_w,
                coarseness,
            };
            let listener = Listener {
                progress,
                control,
                done: outcome.counts.rays,
                total,
            };
            let report = if is_kept {
                depositor.deposit_again(&kept[index], &mut maps, &listener)
            } else {
                let (report, traced) = depositor.run(Some(&mut maps), &listener, keep_bytes);
                // One light too many: none is kept, and the next bake traces all.
                keep_bytes = traced
                    .as_ref()
                    .map_or(0, |light| keep_bytes.saturating_sub(light.bytes()));
                cache.lights.extend(traced);
                report
            };
            outcome.count(&report, clock);
            let name = &self.tracer.scene().lights[light.light].name;
            outcome.ledgers.push(report.ledger.report(name, unit));
        }
        if is_kept {
            cache.lights = kept;
        }
        if let Sigma::Constant(sigma) = self.settings.sigma {
            // A texel is a footprint of its own area: a disc of radius 1/√π.
            let spread_texels = (sigma / std::f64::consts::PI).sqrt();
            clock.time(|clock| &mut clock.deposit, || maps.smooth(spread_texels));
        }
        outcome.maps = Some((maps, unit));
        Ok(outcome)
    }

    /// Flux that all lights send to marked cells [W, luminance].
    fn reference_w(&self) -> f64 {
        let marked_w = |light: &AimedLight| {
            let whole = light.launch.cell_measure(DVec2::ZERO, DVec2::ONE) * light.launch.face_count() as f64;
            let luminance = light.launch.power_bound_w() * light.launch.light().colour.luminance()
                / light.launch.light().colour.max_channel();
            luminance * light.item_buffer.marked_measure(&light.launch) / whole
        };
        self.aim.lights.iter().map(marked_w).sum()
    }

    /// Bodies that are small beside the cells of the whole lattice.
    fn small_bodies(&self, light: &AimedLight, unit: FluxUnit) -> SmallBodies {
        let (columns, rows) = self.lattice(light, 1, unit).size;
        let cell = DVec2::new(1.0 / columns as f64, 1.0 / rows as f64);
        SmallBodies::find(self.tracer.scene(), &light.launch, cell)
    }

    fn wavefront_lattice<'a>(
        &'a self,
        light: &'a AimedLight,
        bodies: &'a SmallBodies,
        coarsening: usize,
        unit: FluxUnit,
    ) -> WavefrontLattice<'a> {
        let lattice = self.lattice(light, coarsening, unit);
        WavefrontLattice {
            tracer: StrandTracer {
                tracer: self.tracer,
                launch: &light.launch,
                limits: lattice.limits,
                steps: [1.0 / lattice.size.0 as f64, 1.0 / lattice.size.1 as f64],
            },
            item_buffer: &light.item_buffer,
            size: lattice.size,
            unit,
            refinement: None,
            bodies,
        }
    }

    /// Sizes of lit areas at the full density, from a thinner lattice.
    fn coarse_wavefront(
        &self,
        unit: FluxUnit,
        control: &Control,
        clock: &mut Clock,
        outcome: &mut CausticOutcome,
    ) -> FootprintStatistics {
        let chart_for: &ChartFor = &|object: usize| self.sizes.chart(object, self.default_size(object)?);
        let receivers = Receivers::new(self.tracer, chart_for);
        let mut statistics = FootprintStatistics::default();
        let none = SmallBodies::default();
        for light in &self.aim.lights {
            let fine = self.lattice(light, 1, unit).size;
            let lattice = self.wavefront_lattice(light, &none, super::caustic_layer::COARSENING, unit);
            let depositor = WavefrontDepositor {
                receivers: &receivers,
                chart_for,
                lattice,
                reference_w: self.reference_w(),
                coarseness: 1.0,
            };
            let listener = Listener {
                progress: &(),
                control,
                done: 0,
                total: 0,
            };
            let (report, _) = depositor.run(None, &listener, 0);
            outcome.count(&report, clock);
            // Its patches are in no map.
            outcome.counts.cells -= report.cells;
            outcome.counts.splats -= report.splats;
            let cells = |size: (usize, usize)| size.0 as f64 * size.1 as f64;
            statistics.merge(&report.statistics.refined(cells(fine) / cells(lattice.size)));
        }
        statistics
    }
}
