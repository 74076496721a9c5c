//! Runs the lattice of one light from the first row to the last, a band of rows at a time.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::arrival_cache::ArrivalCache;
use super::deposit::{Depositor, HalfBuffers, RowContext};
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

/// Traces the lattice of one light, or takes cached arrivals, and deposits it; or a shard of its bands, which traces
/// their neighbouring rows too. Returns the arrivals if they were traced to the end and fit the cache.
pub fn run(
    depositor: &Depositor,
    source: PassInput,
    share: Option<ShardIndex>,
    halves: &mut HalfBuffers,
    chart_for: &ChartFor,
    listener: &ProgressScope,
) -> (PassReport, Option<ArrivalCache>) {
    // Rows are traced in bands, so that memory does not grow with the number of rays.
    let mut report = PassReport::default();
    let mut recorder = Recorder::new(source);
    let lattice = &depositor.lattice;
    let (_, rows) = lattice.traced_size();
    let mut number = 0;
    for face in 0..lattice.launch.face_count() {
        let mut held: BTreeMap<usize, TracedRow> = BTreeMap::new();
        let mut next = 0;
        while next < rows {
            // Shards share out whole bands, which are numbered over all faces.
            let band = next..band_end(lattice, face, next);
            (next, number) = (band.end, number + 1);
            if share.is_some_and(|share| !share.has(number - 1)) {
                continue;
            }
            if listener.control.is_cancelled() {
                report.cancelled = true;
                return (report, None);
            }

            // The band's rows and their neighbours, of which the band before may have traced some.
            let watch = Stopwatch::start();
            let reach = band.start.saturating_sub(1)..(band.end + 1).min(rows);
            held.retain(|row, _| reach.contains(row));
            let missing: Vec<usize> = reach.filter(|row| !held.contains_key(row)).collect();
            let row_of = |row: usize| match source {
                PassInput::Rays { .. } => lattice.trace_row(face, row),
                PassInput::Cached(light) => light.row(lattice, face, row),
            };
            let traced = missing.into_par_iter().map(|row| (row, row_of(row)));
            held.par_extend(traced);
            let contexts: Vec<RowContext> = band
                .map(|index| RowContext {
                    row: &held[&index],
                    index,
                    before: index.checked_sub(1).and_then(|before| held.get(&before)),
                    after: held.get(&(index + 1)),
                })
                .collect();
            recorder.take(&contexts);
            report.count(&contexts);
            match source {
                PassInput::Rays { .. } => report.trace_s.add(watch.elapsed()),
                PassInput::Cached(_) => report.deposit_s.add(watch.elapsed()),
            }

            // Kernels of the band's own rows.
            let watch = Stopwatch::start();
            deposit_rows(depositor, &contexts, halves, chart_for, &mut report);
            report.deposit_s.add(watch.elapsed());
            let done = match source {
                PassInput::Rays { .. } => report.rays,
                PassInput::Cached(_) => report.splats,
            };
            listener
                .progress
                .advance(Stage::Caustic, listener.done + done, listener.total);
        }
    }

    // No path was traced: the cache knows what became of the light on the way.
    if let PassInput::Cached(light) = source {
        report.ledger.merge(light.ledger());
    }
    (report, recorder.light)
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

    fn take(&mut self, rows: &[RowContext]) {
        if let Some(light) = &mut self.light {
            light.push(rows);
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
    report.merge(depositor.deposit(contexts, halves));
}

impl PassReport {
    fn count(&mut self, rows: &[RowContext]) {
        for RowContext { row, .. } in rows {
            self.ledger.merge(&row.ledger);
            self.rays += row.rays;
            self.segments += row.segments;
        }
    }
}
