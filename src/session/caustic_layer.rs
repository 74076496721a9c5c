//! The caustic layer of all lights: a coarse run where map sizes or mean footprints are wanted, then the whole lattice.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::finish;
use super::sizes::{self, MapSizes};
use super::splat_cache::SplatCache;
use super::{BakeCounts, Clock};
use crate::error::{Error, Result, Warning};
use crate::illumination::Chart;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::caustic::deposit::Depositor;
use crate::light_pass::caustic::lattice::Lattice;
use crate::light_pass::caustic::pass::{self, Listener, PassReport, Source};
use crate::light_pass::caustic::path::PathLimits;
use crate::light_pass::caustic::setup::{Aim, AimedLight};
use crate::light_pass::caustic::statistics::FootprintStatistics;
use crate::light_pass::ledger::LightLedger;
use crate::light_pass::receiver_maps::ReceiverMaps;
use crate::plan::{Effect, EffectPlan};
use crate::progress::{Control, Progress};
use crate::settings::{BakeSettings, Footprint, Kernel, MapResolution, Sigma};
use crate::transport::Tracer;

/// Each side of the coarse run's lattice is this many times smaller.
pub(super) const COARSENING: usize = 8;

/// Least side of the coarse run's lattice.
const LEAST_COARSE_SIDE: usize = 64;

/// All that the layer needs.
pub(super) struct CausticLayer<'a> {
    pub(super) tracer: &'a Tracer,
    pub(super) aim: &'a Aim,
    pub(super) settings: &'a BakeSettings,
    pub(super) sizes: &'a MapSizes,
    pub(super) plan: &'a EffectPlan,
}

/// What the layer gives.
#[derive(Debug, Default)]
pub(super) struct CausticOutcome {
    /// Flux per texel with its unit; `None` where the layer is off.
    pub(super) maps: Option<(ReceiverMaps, FluxUnit)>,
    /// By light.
    pub(super) ledgers: Vec<LightLedger>,
    /// Of this layer.
    pub(super) counts: BakeCounts,
    /// Maps coarser than they should be.
    pub(super) warnings: Vec<Warning>,
    /// Stopped before the end.
    pub(super) cancelled: bool,
}

impl CausticLayer<'_> {
    /// Traces and deposits all lights; deposits what the cache holds, where it does.
    pub(super) fn bake(
        &self,
        progress: &dyn Progress,
        control: &Control,
        clock: &mut Clock,
        cache: &mut SplatCache,
    ) -> Result<CausticOutcome> {
        let unit = self.unit()?;
        cache.prepare(self);
        let mut outcome = CausticOutcome::default();
        let statistics = if self.wants_statistics() {
            let statistics = self.coarse_run(unit, progress, control, clock, cache, &mut outcome);
            Some(statistics)
        } else {
            None
        };
        let sizes = self.map_sizes(statistics.as_ref())?;
        if let (MapResolution::Auto, Some(statistics)) = (self.settings.map_resolution, &statistics) {
            outcome.warnings = self.coarse_maps(&sizes, statistics);
        }
        let chart_for = |object: usize| self.chart(object, &sizes);
        let mut maps = ReceiverMaps::new(self.tracer.scene().objects.len());
        let total = cache.arrivals().unwrap_or_else(|| {
            let lights = self.aim.lights.iter();
            lights.map(|light| self.lattice(light, 1, unit).ray_count()).sum()
        });
        let mut done = 0;
        for (index, light) in self.aim.lights.iter().enumerate() {
            let depositor = Depositor {
                lattice: self.lattice(light, 1, unit),
                settings: self.settings,
                statistics: statistics.as_ref(),
                gathers: false,
            };
            let listener = Listener {
                progress,
                control,
                done,
                total,
            };
            let (report, kept) = pass::run(&depositor, cache.source(index), &mut maps, &chart_for, &listener);
            cache.keep(kept);
            done += if report.rays > 0 {
                report.rays
            } else {
                report.splats
            };
            outcome.count(&report, clock);
            let name = &self.tracer.scene().lights[light.light].name;
            outcome.ledgers.push(report.ledger.report(name, unit));
        }
        cache.finish();
        outcome.maps = Some((maps, unit));
        Ok(outcome)
    }

    /// The unit of the sums: by the lights that take part, so that others do not change a bit.
    pub(super) fn unit(&self) -> Result<FluxUnit> {
        let power_w: f64 = self
            .aim
            .lights
            .iter()
            .map(|light| light.launch.power_bound_w())
            .sum();
        if power_w.is_finite() && power_w > 0.0 {
            return Ok(FluxUnit::for_power(power_w));
        }
        Err(Error::failure(
            &self.tracer.scene().source,
            format!("its lights send {power_w:e} W together"),
            "give them intensities whose sum is a finite number above zero",
        ))
    }

    pub(super) fn lattice<'a>(
        &'a self,
        light: &'a AimedLight,
        coarsening: usize,
        unit: FluxUnit,
    ) -> Lattice<'a> {
        let (columns, rows) = light
            .launch
            .lattice_size(self.settings.density_per_sr, self.aim.reach_m);
        let coarse = |side: usize| (side / coarsening).max(side.min(LEAST_COARSE_SIDE));
        let size = if coarsening == 1 {
            (columns, rows)
        } else {
            (coarse(columns), coarse(rows))
        };
        Lattice {
            tracer: self.tracer,
            launch: &light.launch,
            item_buffer: &light.item_buffer,
            size,
            strides: (1, 1),
            placement: self.settings.rays,
            seed: self.settings.seed,
            limits: PathLimits {
                max_depth: self.settings.max_depth,
                branch_threshold: self.settings.branch_threshold,
                absorption: self.plan.is_on(Effect::Absorption),
            },
            unit,
        }
    }

    fn wants_statistics(&self) -> bool {
        let adaptive = self.settings.kernel == Kernel::Gaussian && self.settings.sigma == Sigma::Adaptive;
        adaptive
            || self.settings.footprint == Footprint::Fixed
            || self.settings.map_resolution == MapResolution::Auto
    }

    /// Mean footprints at the full density, from a lattice some 64 times thinner. Its maps, doubled while their own
    /// footprints are finer than texels, are the first picture.
    fn coarse_run(
        &self,
        unit: FluxUnit,
        progress: &dyn Progress,
        control: &Control,
        clock: &mut Clock,
        cache: &SplatCache,
        outcome: &mut CausticOutcome,
    ) -> FootprintStatistics {
        let mut statistics = FootprintStatistics::default();
        let settings = BakeSettings {
            footprint: Footprint::Ellipse,
            sigma: Sigma::Constant(1.0),
            ..self.settings.clone()
        };
        let chart_for = |object: usize| -> Option<Arc<Chart>> {
            let aspect = self.sizes.parametrisation(object)?.suggested_aspect;
            self.sizes.chart(object, sizes::first_size(aspect))
        };
        let mut maps = ReceiverMaps::new(self.tracer.scene().objects.len());
        for (index, light) in self.aim.lights.iter().enumerate() {
            let lattice = thinned(self.lattice(light, 1, unit));
            let depositor = Depositor {
                lattice,
                settings: &settings,
                statistics: None,
                gathers: true,
            };
            let listener = Listener {
                progress: &(),
                control,
                done: 0,
                total: 0,
            };
            let source = match cache.source(index) {
                Source::Rays { .. } => Source::Rays { keep_bytes: 0 },
                kept @ Source::Kept(_) => kept,
            };
            let (report, _) = pass::run(&depositor, source, &mut maps, &chart_for, &listener);
            outcome.count(&report, clock);
            // The kernels of the coarse run are in no map.
            outcome.counts.splats -= report.splats;
            for object in 0..self.tracer.scene().objects.len() {
                if let (Some(map), Some(size)) = (
                    maps.get_mut(object),
                    self.automatic_size(object, &report.statistics),
                ) {
                    map.grow_to(size, &|size| self.sizes.chart(object, size));
                }
            }
            statistics.merge(
                &report
                    .statistics
                    .refined((lattice.strides.0 * lattice.strides.1) as f64),
            );
        }
        progress.preview(finish::preview(&maps, unit));
        statistics
    }

    /// Sizes of the maps that the coarse run saw lit.
    pub(super) fn map_sizes(
        &self,
        statistics: Option<&FootprintStatistics>,
    ) -> Result<BTreeMap<usize, (usize, usize)>> {
        let mut sizes = BTreeMap::new();
        for object in 0..self.tracer.scene().objects.len() {
            let size = match (self.settings.map_resolution, statistics) {
                (MapResolution::Fixed { width, height }, _) => Some((width, height)),
                (MapResolution::Auto, Some(statistics)) => self.automatic_size(object, statistics),
                (MapResolution::Auto, None) => None,
            };
            if let Some(size) = size {
                sizes.insert(object, size);
            }
        }
        if self.settings.map_resolution == MapResolution::Auto {
            let texels = |(width, height): (usize, usize)| width as u64 * height as u64;
            let total =
                |sizes: &BTreeMap<usize, (usize, usize)>| sizes.values().copied().map(texels).sum::<u64>();
            let limit = self.settings.memory_bytes / sizes::BYTES_PER_TEXEL;
            // Halve the largest until all fit.
            while total(&sizes) > limit {
                let Some(largest) = sizes.values_mut().max_by_key(|size| texels(**size)) else {
                    break;
                };
                if texels(*largest) <= 1 {
                    break;
                }
                *largest = ((largest.0 / 2).max(1), (largest.1 / 2).max(1));
            }
        } else if let MapResolution::Fixed { width, height } = self.settings.map_resolution {
            sizes::check_memory(width as u64 * height as u64, self.settings)?;
        }
        Ok(sizes)
    }

    /// Says which automatic maps stay coarser than their light, for the largest automatic size or for memory.
    pub(super) fn coarse_maps(
        &self,
        sizes: &BTreeMap<usize, (usize, usize)>,
        statistics: &FootprintStatistics,
    ) -> Vec<Warning> {
        let coarse = |(&object, &(width, height)): (&usize, &(usize, usize))| {
            let footprint_texels = (width * height) as f64 * statistics.mean(object)?.map_share;
            (footprint_texels < 1.0).then(|| {
                Warning::new(
                    &self.tracer.scene().objects[object].name,
                    format!(
                        "its map of {width} x {height} texels is coarser than the light it holds: a ray's mean \
                         footprint is {footprint_texels:.2} texels"
                    ),
                    "ask for a larger --map-resolution, or allow more --memory",
                )
            })
        };
        sizes.iter().filter_map(coarse).collect()
    }

    fn automatic_size(&self, object: usize, statistics: &FootprintStatistics) -> Option<(usize, usize)> {
        self.sizes
            .doubled_size(object, self.sizes.doublings(object, statistics)?)
    }

    /// The chart of an object at its size among `sizes`.
    pub(super) fn chart(&self, object: usize, sizes: &BTreeMap<usize, (usize, usize)>) -> Option<Arc<Chart>> {
        let size = sizes
            .get(&object)
            .copied()
            .or_else(|| self.default_size(object))?;
        self.sizes.chart(object, size)
    }

    /// For a surface that only the full lattice reached.
    pub(super) fn default_size(&self, object: usize) -> Option<(usize, usize)> {
        Some(sizes::first_size(
            self.sizes.parametrisation(object)?.suggested_aspect,
        ))
    }
}

/// The lattice for mean footprints: every so many-th of the same rays, so that kept ones will do.
fn thinned(lattice: Lattice) -> Lattice {
    let stride = |side: usize| (side / LEAST_COARSE_SIDE).clamp(1, COARSENING);
    Lattice {
        strides: (stride(lattice.size.0), stride(lattice.size.1)),
        ..lattice
    }
}

impl CausticOutcome {
    pub(super) fn count(&mut self, report: &PassReport, clock: &mut Clock) {
        self.counts.rays += report.rays;
        self.counts.segments += report.segments;
        self.counts.splats += report.splats;
        self.counts.cells += report.cells;
        self.counts.receiver_queries += report.receiver_queries;
        self.cancelled |= report.cancelled;
        clock.trace.add(report.trace_s);
        clock.deposit.add(report.deposit_s);
    }
}
