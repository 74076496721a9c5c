//! Runs the lattice of one light from the first row to the last: trace a band, deposit what has its neighbours.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::arrival_cache::ArrivalCache;
use super::deposit::{DepositReport, Depositor, HalfBuffers, RowContext};
use super::lattice::{Lattice, TracedRow};
use crate::illumination::Receiver;
use crate::light_pass::pass_report::{PassReport, ProgressScope, Stopwatch};
use crate::light_pass::receiver_maps::ChartFor;
use crate::light_pass::shard_index::ShardIndex;
use crate::progress::Stage;

/// Target number of rays per band: enough work for all cores, and few enough that the arrivals stay in their caches.
const RAYS_PER_BAND: usize = 1 << 14;

/// Limits on the rows of a band, whatever their number of rays.
const MIN_ROWS: usize = 4;
const MAX_ROWS: usize = 4096;

/// Source of the light of a pass.
#[derive(Clone, Copy, Debug)]
pub enum PassInput<'a> {
    /// Traced rays. Their arrivals are cached while they take at most `keep_bytes`.
    Rays {
        /// Most memory for the cache [bytes].
        keep_bytes: u64,
    },
    /// Arrivals of an earlier pass over the same lattice, or over one with strides of 1.
    Cached(&'a ArrivalCache),
}

/// Traces the whole lattice of one light, or takes cached arrivals, and deposits it. Returns the arrivals if they were
/// traced to the end and fit the cache.
pub fn run(
    depositor: &Depositor,
    source: PassInput,
    halves: &mut HalfBuffers,
    chart_for: &ChartFor,
    listener: &ProgressScope,
) -> (PassReport, Option<ArrivalCache>) {
    let mut report = PassReport::default();
    let mut recorder = Recorder::new(source);
    let lattice = &depositor.lattice;
    let (_, rows) = lattice.traced_size();
    for face in 0..lattice.launch.face_count() {
        let mut carried: Vec<TracedRow> = Vec::new();
        let mut first_row = 0;
        while first_row < rows {
            if listener.control.is_cancelled() {
                report.cancelled = true;
                return (report, None);
            }
            let end = band_end(lattice, face, first_row);
            let watch = Stopwatch::start();
            let traced: Vec<TracedRow> = (first_row..end)
                .into_par_iter()
                .map(|row| match source {
                    PassInput::Rays { .. } => lattice.trace_row(face, row),
                    PassInput::Cached(light) => light.row(lattice, face, row),
                })
                .collect();
            recorder.take(&traced);
            match source {
                PassInput::Rays { .. } => report.trace_s.add(watch.elapsed()),
                PassInput::Cached(_) => report.deposit_s.add(watch.elapsed()),
            }
            report.count(&traced);
            let watch = Stopwatch::start();
            carried = deposit_band(
                depositor,
                halves,
                chart_for,
                carried,
                traced,
                end,
                end == rows,
                &mut report,
            );
            report.deposit_s.add(watch.elapsed());
            let done = match source {
                PassInput::Rays { .. } => report.rays,
                PassInput::Cached(_) => report.splats,
            };
            listener
                .progress
                .advance(Stage::Caustic, listener.done + done, listener.total);
            first_row = end;
        }
    }
    if let PassInput::Cached(light) = source {
        report.ledger.merge(light.ledger());
    }
    (report, recorder.light)
}

/// Traces and deposits the bands of one shard.
///
/// A band needs its neighbours' rows: these are traced again for it, and booked only by their own band.
pub fn run_share(
    depositor: &Depositor,
    share: ShardIndex,
    halves: &mut HalfBuffers,
    chart_for: &ChartFor,
    listener: &ProgressScope,
) -> PassReport {
    let mut report = PassReport::default();
    let mut number = 0;
    let lattice = &depositor.lattice;
    let (_, rows) = lattice.traced_size();
    for face in 0..lattice.launch.face_count() {
        let mut first_row = 0;
        while first_row < rows {
            let end = band_end(lattice, face, first_row);
            let band = first_row..end;
            (first_row, number) = (end, number + 1);
            if !share.has(number - 1) {
                continue;
            }
            if listener.control.is_cancelled() {
                report.cancelled = true;
                return report;
            }
            let watch = Stopwatch::start();
            let lent_before = usize::from(band.start > 0);
            let with_lent = band.start - lent_before..(end + 1).min(rows);
            let traced: Vec<TracedRow> = with_lent
                .into_par_iter()
                .map(|row| lattice.trace_row(face, row))
                .collect();
            report.trace_s.add(watch.elapsed());
            let own = lent_before..lent_before + band.len();
            report.count(&traced[own.clone()]);
            let watch = Stopwatch::start();
            let context = |position: usize| RowContext {
                row: &traced[position],
                index: band.start + position - lent_before,
                before: position.checked_sub(1).map(|before| &traced[before]),
                after: traced.get(position + 1),
            };
            let contexts: Vec<RowContext> = own.map(context).collect();
            deposit_rows(depositor, &contexts, halves, chart_for, &mut report);
            report.deposit_s.add(watch.elapsed());
            listener
                .progress
                .advance(Stage::Caustic, listener.done + report.rays, listener.total);
        }
    }
    report
}

/// Caches arrivals until they exceed the limit.
struct Recorder {
    light: Option<ArrivalCache>,
    most_bytes: u64,
}

impl Recorder {
    fn new(source: PassInput) -> Self {
        let most_bytes = match source {
            PassInput::Rays { keep_bytes } => keep_bytes,
            PassInput::Cached(_) => 0,
        };
        Self {
            light: (most_bytes > 0).then(ArrivalCache::default),
            most_bytes,
        }
    }

    fn take(&mut self, traced: &[TracedRow]) {
        if let Some(light) = &mut self.light {
            light.push(traced);
            if light.bytes() > self.most_bytes {
                self.light = None;
            }
        }
    }
}

/// End of the band that starts at `first_row`.
fn band_end(lattice: &Lattice, face: usize, first_row: usize) -> usize {
    let rows = lattice.traced_size().1.min(first_row + MAX_ROWS);
    let (mut end, mut rays) = (first_row, 0);
    while end < rows && (rays < RAYS_PER_BAND || end < first_row + MIN_ROWS) {
        rays += lattice.row_ray_count(face, end);
        end += 1;
    }
    end
}

/// Deposits all rows that have a row after them (all at the end of a face). Returns the last two rows, which the next
/// band needs. `end` is the lattice index after the last traced row.
#[allow(
    clippy::too_many_arguments,
    reason = "one call site; the band's state travels through it"
)]
fn deposit_band(
    depositor: &Depositor,
    halves: &mut HalfBuffers,
    chart_for: &ChartFor,
    mut rows: Vec<TracedRow>,
    traced: Vec<TracedRow>,
    end: usize,
    last: bool,
    report: &mut PassReport,
) -> Vec<TracedRow> {
    // The carried rows: one that was deposited and only serves as a neighbour, and one that waits.
    let lent = rows.len().saturating_sub(1);
    rows.extend(traced);
    let first_index = end - rows.len();
    let ready = if last { rows.len() } else { rows.len() - 1 };
    let contexts: Vec<RowContext> = (lent..ready)
        .map(|position| RowContext {
            row: &rows[position],
            index: first_index + position,
            before: position.checked_sub(1).map(|before| &rows[before]),
            after: rows.get(position + 1),
        })
        .collect();
    deposit_rows(depositor, &contexts, halves, chart_for, report);
    let keep = rows.len().saturating_sub(2);
    rows.split_off(keep)
}

/// Deposits rows, and allocates the maps that are missing.
fn deposit_rows(
    depositor: &Depositor,
    contexts: &[RowContext],
    halves: &mut HalfBuffers,
    chart_for: &ChartFor,
    report: &mut PassReport,
) {
    let receivers: BTreeSet<Receiver> = contexts
        .iter()
        .flat_map(|context| context.row.arrivals.chunk_by(|a, b| a.receiver == b.receiver))
        .map(|run| run[0].receiver)
        .collect();
    for receiver in receivers {
        halves.touch(receiver, chart_for);
    }
    report.add(&depositor.deposit(contexts, halves));
}

impl PassReport {
    fn count(&mut self, traced: &[TracedRow]) {
        for row in traced {
            self.ledger.merge(&row.ledger);
            self.rays += row.rays;
            self.segments += row.segments;
        }
    }

    fn add(&mut self, deposit: &DepositReport) {
        self.ledger.merge(&deposit.ledger);
        self.splats += deposit.splats;
        self.statistics.merge(&deposit.statistics);
    }
}
