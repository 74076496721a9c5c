//! Runs the lattice of one light: traces bands of cells, spreads their patches over the receivers, and deposits them.

use rayon::prelude::*;

use super::cell::Patch;
use super::coverage::{FluxTriangle, deposit_triangles};
use super::kept_rays::RayCache;
use super::lattice::{TracedBand, WavefrontLattice};
use super::receivers::Receivers;
use super::spread::{SpreadOutput, Spreader};
use crate::illumination::Receiver;
use crate::light_pass::ledger_sum::Account;
use crate::light_pass::pass_report::{PassReport, ProgressScope, Stopwatch};
use crate::light_pass::receiver_maps::{ChartFor, ReceiverMaps};
use crate::light_pass::shard_index::ShardIndex;
use crate::progress::{Control, Stage};

/// Patches that one task spreads.
const PATCHES_PER_TASK: usize = 128;

/// Tasks whose triangles are held until they are deposited: bounds the memory.
const TASKS_AT_ONCE: usize = 64;

/// The same while the number of triangles per task is unknown.
const FIRST_AT_ONCE: usize = 4;

/// Triangles held until they are deposited, roughly: 72 bytes each.
const MAX_TRIANGLES: usize = 1 << 21;

/// Triangles deposited between two checks for cancellation.
const TRIANGLES_AT_ONCE: usize = 1 << 13;

/// Traced bands of one light, which can be deposited again without tracing.
#[derive(Clone, Debug, Default)]
pub struct TracedLight {
    /// All bands, face by face.
    pub bands: Vec<TracedBand>,
}

impl TracedLight {
    /// Approximate memory [bytes].
    pub fn bytes(&self) -> u64 {
        self.bands.iter().map(TracedBand::bytes).sum()
    }
}

/// Memory that may be kept after a run [bytes].
#[derive(Clone, Copy, Debug, Default)]
pub struct Room {
    pub bands_bytes: u64,
    /// For all cached rays, those of earlier runs included.
    pub rays_bytes: u64,
}

/// Traces a lattice and deposits its patches into maps.
#[derive(Clone, Copy)]
pub struct WavefrontDepositor<'a> {
    pub receivers: &'a Receivers<'a>,
    /// Charts of the maps that receive light.
    pub chart_for: &'a ChartFor<'a>,
    pub lattice: WavefrontLattice<'a>,
    /// Flux that all lights send to specular surfaces [W, luminance].
    pub reference_w: f64,
    /// Coarseness of triangles relative to the usual one: above 1 is coarser.
    pub coarseness: f64,
}

impl WavefrontDepositor<'_> {
    /// Traces and deposits a lattice, or one shard's bands of it. Returns the bands if they take less than
    /// `room.bands_bytes`; adds the hits of rays to `rays`. A cancelled run is to be discarded, except for its rays.
    pub fn run(
        &self,
        share: Option<ShardIndex>,
        rays: &mut RayCache,
        maps: Option<&mut ReceiverMaps>,
        listener: &ProgressScope,
        room: Room,
    ) -> (PassReport, Option<TracedLight>) {
        let mut report = PassReport::default();
        let mut kept = Some(TracedLight::default());
        let (mut kept_bytes, mut number) = (0, 0);
        let mut maps = maps;
        for face in 0..self.lattice.tracer.launch.face_count() {
            for band in self.lattice.bands(face) {
                number += 1;
                if share.is_some_and(|share| !share.has(number)) {
                    continue;
                }
                let watch = Stopwatch::start();
                let mut band = self.lattice.knowing(rays).trace(face, band);
                for fresh in band.fresh.drain(..) {
                    rays.insert(fresh, room.rays_bytes);
                }
                report.trace_s.add(watch.elapsed());
                report.count_traced(&band);
                self.deposit(&band, maps.as_deref_mut(), listener.control, &mut report);
                if listener.control.is_cancelled() {
                    report.cancelled = true;
                    return (report, None);
                }
                listener
                    .progress
                    .advance(Stage::Caustic, listener.done + report.rays, listener.total);
                kept_bytes += band.bytes();
                if kept_bytes > room.bands_bytes {
                    kept = None;
                }
                if let Some(kept) = &mut kept {
                    kept.bands.push(band);
                }
            }
        }
        (report, kept)
    }

    /// Deposits kept bands without tracing.
    pub fn deposit_again(
        &self,
        traced: &TracedLight,
        maps: &mut ReceiverMaps,
        listener: &ProgressScope,
    ) -> PassReport {
        let mut report = PassReport::default();
        for band in &traced.bands {
            report.ledger.merge(&band.ledger);
            report.cells += band.cells;
            report.splats += band.splats;
            self.deposit(band, Some(&mut *maps), listener.control, &mut report);
            if listener.control.is_cancelled() {
                report.cancelled = true;
                return report;
            }
        }
        report
    }

    /// Spreads a band's patches and adds them to the maps; only counts without maps.
    fn deposit(
        &self,
        band: &TracedBand,
        maps: Option<&mut ReceiverMaps>,
        control: &Control,
        report: &mut PassReport,
    ) {
        let watch = Stopwatch::start();
        let tasks: Vec<_> = band
            .patches
            .iter()
            .flat_map(|row| row.chunks(PATCHES_PER_TASK))
            .collect();
        let mut maps = maps;
        let (mut rest, mut at_once) = (&tasks[..], FIRST_AT_ONCE);
        while !rest.is_empty() {
            let (tasks, later) = rest.split_at(at_once.min(rest.len()));
            rest = later;
            let parts = self.spread(band, tasks, control, maps.is_none());
            for part in &parts {
                report.ledger.merge(&part.ledger);
                report.receiver_queries += part.queries;
                report.statistics.merge(&part.statistics);
                report.overshoots.extend_from_slice(&part.overshoots);
            }
            let triangles: usize = parts.iter().map(SpreadOutput::triangle_count).sum();
            // Neighbouring patches are divided alike.
            at_once = (MAX_TRIANGLES * tasks.len() / triangles.max(1)).clamp(1, TASKS_AT_ONCE);
            if let Some(maps) = maps.as_deref_mut() {
                let lists = parts.iter().flat_map(|part| &part.triangles);
                let pieces = lists.flat_map(|(receiver, triangles)| {
                    let pieces = triangles.chunks(TRIANGLES_AT_ONCE);
                    pieces.map(|piece| (*receiver, piece))
                });
                for (receiver, piece) in pieces.take_while(|_| !control.is_cancelled()) {
                    self.place(receiver, piece, maps, report);
                }
            }
        }
        report.deposit_s.add(watch.elapsed());
    }

    /// Spreads patches, task by task; `gathers`: whether positions of footprints are recorded.
    fn spread(
        &self,
        band: &TracedBand,
        tasks: &[&[Patch]],
        control: &Control,
        gathers: bool,
    ) -> Vec<SpreadOutput> {
        let spreader = Spreader {
            receivers: self.receivers,
            face: band.face,
            samples: &band.samples,
            unit: self.lattice.unit,
            absorption: self.lattice.tracer.limits.effects.absorption,
            reference_w: self.reference_w,
            coarseness: self.coarseness,
            gathers,
            light: self.lattice.light,
        };
        let spread = |patches: &&[Patch]| {
            let mut output = SpreadOutput::default();
            for patch in patches.iter().take_while(|_| !control.is_cancelled()) {
                spreader.spread(patch, &mut output);
            }
            output
        };
        tasks.par_iter().map(spread).collect()
    }

    /// Adds triangles to a map.
    fn place(
        &self,
        receiver: Receiver,
        triangles: &[FluxTriangle],
        maps: &mut ReceiverMaps,
        report: &mut PassReport,
    ) {
        maps.touch(receiver, self.chart_for);
        let Some(map) = maps.get_mut(receiver) else {
            return;
        };
        let placed = deposit_triangles(triangles, map);
        for (account, counts) in [
            (Account::Deposited, placed.deposited),
            (Account::Escaped, placed.outside),
            (Account::Unresolved, placed.unplaced),
            (Account::NonFinite, placed.non_finite),
        ] {
            report.ledger.book_sum(account, counts);
        }
    }
}

impl PassReport {
    fn count_traced(&mut self, band: &TracedBand) {
        self.ledger.merge(&band.ledger);
        self.rays += band.rays;
        self.segments += band.segments;
        self.cells += band.cells;
        self.splats += band.splats;
    }
}
