//! One level of one light by the wavefront estimator.

use glam::DVec2;

use super::carrier::Carrier;
use super::caustic::{BakeContext, CausticLayer, LightProgress, unwatched};
use super::light_level::{LevelKey, LightLevel, TraceKey};
use super::shards::PassSums;
use crate::error::Result;
use crate::illumination::Receiver;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::footprint_statistics::FootprintStatistics;
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::light_pass::pass_report::ProgressScope;
use crate::light_pass::receiver_maps::{ChartFor, ReceiverMaps};
use crate::light_pass::visibility::VisibleLight;
use crate::light_pass::wavefront::bumps::BumpCells;
use crate::light_pass::wavefront::cell::SubdivisionLimits;
use crate::light_pass::wavefront::edge_search::EdgeSearch;
use crate::light_pass::wavefront::kept_rays::RayCache;
use crate::light_pass::wavefront::lattice::WavefrontLattice;
use crate::light_pass::wavefront::pass::{Room, WavefrontDepositor};
use crate::light_pass::wavefront::receivers::Receivers;
use crate::light_pass::wavefront::refine::Refinement;
use crate::light_pass::wavefront::spectrum::LightPart;
use crate::light_pass::wavefront::subcell_features::SubcellFeatures;
use crate::light_pass::wavefront::trace::StrandTracer;
use crate::progress::Control;
use crate::settings::Estimator;

impl CausticLayer<'_> {
    /// Traces and deposits a level, or deposits cached paths on other maps; `None` if it was stopped.
    pub(super) fn make_wavefront(
        &self,
        progress: &mut LightProgress,
        key: LevelKey,
        unit: FluxUnit,
        context: &mut BakeContext,
    ) -> Result<Option<LightLevel>> {
        let (light, state) = (progress.visible, &mut progress.state);
        let chart_for = |receiver: Receiver| self.chart(receiver, &key.sizes);
        let receivers = Receivers::new(self.tracer, &chart_for);
        let refinement = Refinement {
            receivers: &receivers,
            rounds: &key.trace.rounds,
        };
        let mut traced = None;
        // Bands are too many to keep, and a shard has another share of each pass.
        let keeps_bands = !self.spectra.has_bands(light) && !context.role.is_cut();
        let room = self.room(keeps_bands);
        let mut taken = keeps_bands.then(|| state.take_traced(&key)).flatten();
        let nothing = PassSums::new(vec![self.part_maps()]);
        let mut sums = context.pass(&chart_for, nothing, |context, share, mut sums| {
            let maps = &mut sums.maps[0];
            let size = self.spectra.part_size(light.light, key.trace.size);
            let bodies = self.small_bodies(light, size, Self::closeness(&key.trace));
            for (number, (band, part)) in self.spectra.parts(light.light).into_iter().enumerate() {
                let share = share.map(|share| share.shifted(number as u64));
                let depositor = WavefrontDepositor {
                    receivers: &receivers,
                    chart_for: &chart_for,
                    lattice: WavefrontLattice {
                        refinement: Some(&refinement),
                        ..self.bumpy_lattice(light, part, &key.trace, &bodies, unit, context.control)
                    },
                    reference_w: reference_w(light),
                    coarseness: key.coarseness,
                };
                let cells = depositor.lattice.cell_count();
                let listener = ProgressScope {
                    progress: self.progress,
                    control: context.control,
                    done: context.outcome.counts.rays + sums.report.rays,
                    total: share.map_or(cells, |share| share.of(cells)),
                };
                let maps = maps.of(band);
                let (of_part, kept) = match taken.take() {
                    Some(taken) => (depositor.deposit_again(&taken, maps, &listener), Some(taken)),
                    None => depositor.run(share, &mut state.rays, Some(maps), &listener, room),
                };
                sums.report.merge(of_part);
                traced = kept;
                if sums.report.cancelled {
                    break;
                }
            }
            sums
        })?;
        let mut report = sums.report;
        let (mut maps, bands) = sums.maps.swap_remove(0).into_sum();
        let traced = traced.filter(|_| room.bands_bytes > 0);
        self.spectra
            .to_linear_srgb(light.light, &mut maps, &mut report.ledger);
        let strays = drop_negligible_maps(&mut maps, &mut report.ledger);
        context.outcome.count(&report, context.clock);
        Ok((!report.cancelled).then(|| LightLevel {
            strays,
            overshoots: report.overshoots,
            traced,
            work: (report.cells, report.receiver_queries),
            ..self.level(light, (key, unit), (maps, bands), report.ledger)
        }))
    }

    /// A level with these maps; what only some levels have is empty.
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
            strays: Vec::new(),
            overshoots: Vec::new(),
            noise: None,
            goal: 0.0,
            error: None,
            photons: None,
            work: (0, 0),
            traced: None,
            has_own_colour: self.spectra.has(light.light),
        }
    }

    /// Limits on splitting cells.
    pub(super) fn splits(&self) -> SubdivisionLimits {
        if self.settings.max_error.is_some() {
            SubdivisionLimits::BEFORE_ROUNDS
        } else {
            SubdivisionLimits::FULL
        }
    }

    fn room(&self, keeps_bands: bool) -> Room {
        let rays_bytes = self.kept_light_bytes() / 2;
        Room {
            bands_bytes: if keeps_bands { rays_bytes } else { 0 },
            rays_bytes,
        }
    }

    fn closeness(trace: &TraceKey) -> EdgeSearch {
        if trace.is_negligible {
            EdgeSearch::DIM
        } else {
            EdgeSearch::SHARP
        }
    }

    /// Bodies that are small compared to the cells of a lattice.
    fn small_bodies(
        &self,
        light: &VisibleLight,
        (columns, rows): (usize, usize),
        closeness: EdgeSearch,
    ) -> SubcellFeatures {
        let cell = DVec2::new(1.0 / columns as f64, 1.0 / rows as f64);
        SubcellFeatures::find(self.tracer, &light.launch, light.visible(), cell, closeness)
    }

    /// The lattice of a level, with cells as fine as the detail of normals requires.
    fn bumpy_lattice<'a>(
        &'a self,
        light: &'a VisibleLight,
        part: LightPart<'a>,
        trace: &TraceKey,
        bodies: &'a SubcellFeatures,
        unit: FluxUnit,
        control: &'a Control,
    ) -> WavefrontLattice<'a> {
        let size = self.spectra.part_size(light.light, trace.size);
        let mut lattice = self.wavefront_lattice(light, part, size, bodies, unit, control);
        lattice.tracer = lattice.tracer.with_closeness(Self::closeness(trace));
        lattice.tracer.bumps = BumpCells::for_lattice(lattice.cell_count(), trace.coarser);
        lattice
    }

    /// A lattice that is not refined, neither by rounds nor for the detail of normals.
    fn wavefront_lattice<'a>(
        &'a self,
        light: &'a VisibleLight,
        part: LightPart<'a>,
        size: (usize, usize),
        bodies: &'a SubcellFeatures,
        unit: FluxUnit,
        control: &'a Control,
    ) -> WavefrontLattice<'a> {
        let tracer = StrandTracer::new(
            self.tracer,
            &light.launch,
            self.limits(),
            [1.0 / size.0 as f64, 1.0 / size.1 as f64],
            control,
        );
        let mut tracer = tracer;
        tracer.bumps = BumpCells::UNDIVIDED;
        WavefrontLattice {
            tracer: tracer.at_node(part, 0),
            item_buffer: &light.item_buffer,
            size,
            unit,
            refinement: None,
            bodies,
            splits: self.splits(),
            light: part,
        }
    }
}

/// Drops maps that next to no light reaches, and books their flux as unresolved.
pub(super) fn drop_negligible_maps(maps: &mut ReceiverMaps, ledger: &mut LedgerSum) -> Vec<Receiver> {
    let (receivers, strays) = maps.drop_negligible_maps();
    ledger.book_sum(Account::Deposited, strays.map(|count| -count));
    ledger.book_sum(Account::Unresolved, strays);
    receivers
}

/// Flux that a light sends to marked cells at unit strength [W].
fn reference_w(light: &VisibleLight) -> f64 {
    light.launch.power_bound_w() * light.visible().marked_share(&light.launch)
}
