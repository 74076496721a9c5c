//! One light by splats: the full lattice at once, and sparser ones to estimate the error.

use super::band_maps::BandMaps;
use super::caustic::{BakeContext, CausticLayer, LightProgress};
use super::light_level::{LevelKey, LightLevel, LightState, TraceKey};
use super::shards::PassSums;
use crate::error::Result;
use crate::illumination::Receiver;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::accuracy::{self, Images, LightError};
use crate::light_pass::footprint_statistics::FootprintStatistics;
use crate::light_pass::ledger_sum::LedgerSum;
use crate::light_pass::pass_report::{PassReport, ProgressScope};
use crate::light_pass::receiver_maps::ReceiverMaps;
use crate::light_pass::shard_index::ShardIndex;
use crate::light_pass::splat::arrival_cache::ArrivalCache;
use crate::light_pass::splat::deposit::{Depositor, HalfBuffers};
use crate::light_pass::splat::lattice::Lattice;
use crate::light_pass::splat::pass::{self, PassInput};
use crate::light_pass::visibility::VisibleLight;
use crate::settings::{BakeSettings, Footprint, Sigma};

/// Maximum stride of the lattice for mean footprints.
const COARSENING: usize = 8;

/// Minimum side of that lattice.
const MIN_COARSE_SIDE: usize = 64;

/// Stride of the lattice that the blur of splats is estimated from.
const ERROR_STRIDE: usize = 2;

/// Input of a splat pass.
#[derive(Clone, Copy, Debug)]
struct Worker<'a> {
    /// Share of the lattice to trace without keeping its rays; `None` for all of it.
    share: Option<ShardIndex>,
    source: PassInput<'a>,
}

impl CausticLayer<'_> {
    /// Traces and deposits a light, or deposits cached arrivals with other kernels or on other maps; `None` if it was
    /// stopped.
    pub(super) fn make_splats(
        &self,
        progress: &mut LightProgress,
        key: LevelKey,
        unit: FluxUnit,
        context: &mut BakeContext,
    ) -> Result<Option<LightLevel>> {
        // Arrivals of the full lattice are cached for other kernels and maps. Bands would each need a cache of their
        // own.
        let (light, state) = (progress.visible, &mut progress.state);
        let lattice = Lattice {
            strides: (key.stride, key.stride),
            ..self.lattice(light, unit)
        };
        let source = match source_of(state, &key.trace) {
            PassInput::Rays { .. } if key.stride == 1 && !self.spectra.has(light.light) => PassInput::Rays {
                keep_bytes: self.kept_light_bytes(),
            },
            source => source,
        };

        // Rays go to two half sets, whose difference is the noise.
        let chart_for = |receiver: Receiver| self.chart(receiver, &key.sizes);
        let nothing = PassSums::new(vec![self.part_maps(), self.part_maps()]);
        let mut arrived = None;
        let mut sums = context.pass(&chart_for, nothing, |context, share, sums| {
            let worker = Worker { share, source };
            let (sums, kept) = self.deposit_parts(light, lattice, worker, &key, sums, context);
            arrived = kept;
            sums
        })?;
        if let Some(arrived) = arrived {
            state.arrivals = Some((key.trace.clone(), arrived));
        }

        // Dispersed light was counted as XYZ.
        let mut report = sums.report;
        let (mut second, more) = sums.maps.swap_remove(1).into_sum();
        let (mut maps, mut bands) = sums.maps.swap_remove(0).into_sum();
        let mut none = LedgerSum::default();
        self.spectra
            .to_linear_srgb(light.light, &mut maps, &mut report.ledger);
        self.spectra.to_linear_srgb(light.light, &mut second, &mut none);
        context.outcome.count(&report, context.clock);

        // The halves of a shard hold a part of the light and tell nothing about the whole.
        let is_known = !report.cancelled && !context.role.is_shard();
        let noise = is_known.then(|| {
            context.clock.time(
                |clock| &mut clock.deposit,
                || {
                    let [a, b] = [&maps, &second].map(|maps| accuracy::images(maps, unit));
                    accuracy::half_set_noise(&a, &b)
                },
            )
        });

        // Only a complete lattice makes a level: rows that are missing would be black.
        maps.add(&second);
        for (band, more) in bands.iter_mut().zip(more) {
            band.add(&more);
        }
        Ok((!report.cancelled).then(|| LightLevel {
            noise,
            ..self.level(light, (key, unit), (maps, bands), report.ledger)
        }))
    }

    /// Deposits all parts of a light's spectrum. Arrivals are returned for light without parts only.
    fn deposit_parts(
        &self,
        light: &VisibleLight,
        lattice: Lattice,
        worker: Worker,
        key: &LevelKey,
        mut sums: PassSums,
        context: &BakeContext,
    ) -> (PassSums, Option<ArrivalCache>) {
        // Each band has its own lattice, at places that fill the gaps between those of the other bands. Its shards are
        // shifted, so that lattices of few rows do not all begin with the same shard.
        let mut kept = None;
        let (first, second) = sums.maps.split_at_mut(1);
        for (number, (band, part)) in self.spectra.parts(light.light).into_iter().enumerate() {
            let mut halves = HalfBuffers {
                first: first[0].of(band),
                second: second.first_mut().map(|second| second.of(band)),
            };
            let lattice = Lattice {
                band: part,
                size: self.spectra.part_size(light.light, lattice.size),
                centre: self.spectra.ray_place(light.light, band),
                ..lattice
            };
            let worker = Worker {
                share: worker.share.map(|share| share.shifted(number as u64)),
                source: if band.is_some() {
                    PassInput::Rays { keep_bytes: 0 }
                } else {
                    worker.source
                },
            };
            let (of_part, arrived) = self.deposit_splats(lattice, worker, key, &mut halves, context);
            sums.report.merge(of_part);
            kept = arrived;
            if sums.report.cancelled {
                break;
            }
        }
        (sums, kept)
    }

    /// Deposits one part. A share keeps no arrivals.
    fn deposit_splats(
        &self,
        lattice: Lattice,
        worker: Worker,
        key: &LevelKey,
        halves: &mut HalfBuffers,
        context: &BakeContext,
    ) -> (PassReport, Option<ArrivalCache>) {
        let depositor = Depositor {
            lattice,
            settings: self.settings,
            statistics: context.statistics.as_deref(),
            gathers: false,
        };
        let rays = lattice.ray_count();
        let total = worker.share.map_or(rays, |share| share.of(rays));
        let listener = self.listener(context, total);
        let chart_for = |receiver: Receiver| self.chart(receiver, &key.sizes);
        let source = match worker.share {
            Some(_) => PassInput::Rays { keep_bytes: 0 },
            None => worker.source,
        };
        pass::run(&depositor, source, worker.share, halves, &chart_for, &listener)
    }

    /// Error of a level, estimated from a thinner one; `None` for a level that is thinned itself, and for a shard's
    /// part.
    pub(super) fn error_of_splats(
        &self,
        light: &LightProgress,
        level: &LightLevel,
        context: &mut BakeContext,
    ) -> Result<Option<LightError>> {
        let thinner = self.thinned_images(light, level, context)?;
        let (Some(thinner), Some(noise), false) = (thinner, &level.noise, context.role.is_shard()) else {
            return Ok(None);
        };
        let fine = accuracy::images(&level.maps, level.unit);
        Ok(accuracy::estimate_splats(&fine, &thinner, noise, &level.energy()))
    }

    /// Maps from every second ray across and down, which stands for four; `None` for a level that is thinned itself.
    fn thinned_images(
        &self,
        progress: &LightProgress,
        level: &LightLevel,
        context: &mut BakeContext,
    ) -> Result<Option<Images>> {
        let (light, state) = (progress.visible, &progress.state);
        if level.key.stride > 1 {
            return Ok(None);
        }
        let lattice = Lattice {
            strides: (ERROR_STRIDE, ERROR_STRIDE),
            ..self.lattice(light, level.unit)
        };
        let source = source_of(state, &level.key.trace);
        let chart_for = |receiver: Receiver| self.chart(receiver, &level.key.sizes);
        let nothing = PassSums::new(vec![self.part_maps()]);
        let mut sums = context.pass(&chart_for, nothing, |context, share, sums| {
            let worker = Worker { share, source };
            self.deposit_parts(light, lattice, worker, &level.key, sums, context)
                .0
        })?;
        let mut report = sums.report;
        let (mut maps, _) = sums.maps.swap_remove(0).into_sum();
        self.spectra
            .to_linear_srgb(light.light, &mut maps, &mut report.ledger);
        context.outcome.count(&report, context.clock);
        Ok(Some(accuracy::images(&maps, level.unit)))
    }

    /// A level with these maps; what only photons have is empty.
    pub(super) fn level(
        &self,
        light: &VisibleLight,
        (key, unit): (LevelKey, FluxUnit),
        (maps, bands): (ReceiverMaps, Vec<ReceiverMaps>),
        ledger: LedgerSum,
    ) -> LightLevel {
        LightLevel {
            key,
            maps: maps.packed(),
            bands: self.spectra.level_bands(light.light, bands),
            radiant: self.spectra.radiant(light.light),
            unit,
            reach_m: light.reach_m,
            ledger,
            noise: None,
            goal: 0.0,
            found: 0.0,
            error: None,
            photons: None,
            segments: 0,
            has_own_colour: self.spectra.has(light.light),
        }
    }

    /// Maps without light, per band if bands are kept.
    pub(super) fn part_maps(&self) -> BandMaps {
        BandMaps::new(self.tracer.scene().objects.len(), self.spectra.kept_bands())
    }

    pub(super) fn no_maps(&self) -> ReceiverMaps {
        ReceiverMaps::new(self.tracer.scene().objects.len())
    }

    /// Mean footprints at the full density, from a lattice about 64 times thinner.
    pub(super) fn splat_statistics(
        &self,
        progress: &LightProgress,
        unit: FluxUnit,
        context: &mut BakeContext,
    ) -> FootprintStatistics {
        // The statistics are of the ellipses themselves, whatever footprint and width the kernels of the bake have.
        let (light, state) = (progress.visible, &progress.state);
        let settings = BakeSettings {
            footprint: Footprint::Ellipse,
            sigma: Sigma::Constant(1.0),
            ..self.settings.clone()
        };

        // A thin subset of the rays does: it may use cached ones, and its footprints are larger by a known factor.
        let lattice = thinned(self.lattice(light, unit));
        let depositor = Depositor {
            lattice,
            settings: &settings,
            statistics: None,
            gathers: true,
        };
        let listener = ProgressScope {
            progress: &(),
            ..self.listener(context, 0)
        };

        // The flux itself is thrown away, so that charts of the smallest size do.
        let chart_for = |receiver: Receiver| {
            self.sizes
                .chart(receiver, self.sizes.doubled_size(receiver.object(), 0)?)
        };
        let mut maps = self.no_maps();
        let mut all = HalfBuffers {
            first: &mut maps,
            second: None,
        };
        let source = source_of(state, &self.trace_key(light));
        let (mut report, _) = pass::run(&depositor, source, None, &mut all, &chart_for, &listener);
        // Kernels of the coarse run are on no map.
        report.splats = 0;
        context.outcome.count(&report, context.clock);
        let cells = (lattice.strides.0 * lattice.strides.1) as f64;
        report.statistics.refined(cells)
    }
}

/// Strides of a light's levels: a quick first picture, then every ray.
pub(super) const LEVEL_STRIDES: [usize; 2] = [8, 1];

/// Cached arrivals, or rays that are not kept.
fn source_of<'a>(state: &'a LightState, key: &TraceKey) -> PassInput<'a> {
    match &state.arrivals {
        Some((known, kept)) if known == key => PassInput::Cached(kept),
        _ => PassInput::Rays { keep_bytes: 0 },
    }
}

/// The lattice for mean footprints: a subset of the same rays, so that cached ones can be used.
fn thinned(lattice: Lattice) -> Lattice {
    let stride = |side: usize| (side / MIN_COARSE_SIDE).clamp(1, COARSENING);
    Lattice {
        strides: (stride(lattice.size.0), stride(lattice.size.1)),
        ..lattice
    }
}
