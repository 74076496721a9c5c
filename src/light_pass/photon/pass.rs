//! Traces many photons in parallel blocks and counts hits as integers, so that neither order nor thread count changes a
//! bit.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use glam::DVec2;
use rayon::prelude::*;

use super::bundles::{Bundles, Carried};
use super::launch::{PhotonLaunch, Start};
use super::survey::Surveyor;
use super::walk::{Hit, PhotonArrival, PhotonRules, PhotonWalk};
use crate::geometry::sampling::GOLDEN_64;
use crate::illumination::accumulator::FluxCount;
use crate::illumination::{Chart, Receiver};
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::light_pass::pass_report::{PassReport, ProgressScope, Stopwatch};
use crate::light_pass::receiver_maps::{ChartFor, ReceiverMaps};
use crate::light_pass::shard_index::ShardIndex;
use crate::light_pass::wavefront::coverage::deposit_triangles;
use crate::progress::{Control, Stage};

/// Approximate number of photons in a block: a short stretch of the domain's curve, so that neighbours hit the same
/// triangles.
const BLOCK: u32 = 1 << 12;

/// Blocks that are traced before their hits are deposited.
const BLOCKS_AT_ONCE: usize = 64;

/// Independent samples of the same strata; their difference is the noise.
pub const HALVES: usize = 2;

/// The photons of one light.
pub struct PhotonPass<'a> {
    pub launch: &'a PhotonLaunch<'a>,
    /// Both halves derive their seeds from the one here.
    pub rules: PhotonRules<'a>,
    /// Whether bundles serve as a control variate.
    pub has_bundles: bool,
    pub chart_for: &'a ChartFor<'a>,
}

/// Flux for one texel.
struct Deposit {
    receiver: Receiver,
    texel: u32,
    band: Option<usize>,
    count: FluxCount,
}

/// Result of a block of photons.
#[derive(Default)]
struct Block {
    half: usize,
    deposits: Vec<Deposit>,
    ledger: LedgerSum,
    rays: u64,
    segments: u64,
}

/// Charts requested so far, by receiver.
type KnownCharts = Vec<OnceLock<Option<Arc<Chart>>>>;

impl PhotonPass<'_> {
    /// Traces the photons of both halves with these indices, or a shard of their blocks. Each half has one set of maps,
    /// or one for each band.
    pub fn run(
        &self,
        indices: Range<u32>,
        share: Option<ShardIndex>,
        halves: &mut [&mut [ReceiverMaps]],
        listener: &ProgressScope,
    ) -> PassReport {
        // Indices that agree in their last bits have places that agree in their first ones.
        let stride = (indices.end / BLOCK).max(1).next_power_of_two();
        let blocks: Vec<(usize, u32)> = (0..stride)
            .flat_map(|first| (0..HALVES).map(move |half| (half, first)))
            .enumerate()
            .filter(|(number, _)| share.is_none_or(|share| share.has(*number as u64)))
            .map(|(_, block)| block)
            .collect();
        let objects = self.rules.tracer.scene().objects.len();
        let charts: KnownCharts = Receiver::all(objects).map(|_| OnceLock::new()).collect();
        let mut report = PassReport::default();
        let watch = Stopwatch::start();
        let bundles = self.bundles(&charts, indices.len() as f64, listener.control);
        if share.is_none_or(|share| share.has(0)) {
            report
                .ledger
                .merge(&self.deposit_bundles(&bundles, &indices, halves));
        }
        report.trace_s.add(watch.elapsed());
        let mut waiting: Vec<Block> = Vec::new();
        for chunk in blocks.chunks(BLOCKS_AT_ONCE).chain([&[][..]]) {
            let watch = Stopwatch::start();
            let follow = || -> Vec<Block> {
                let of = |&(half, first): &(usize, u32)| {
                    let cancelled = listener.control.is_cancelled();
                    let own = (first..indices.end).step_by(stride as usize);
                    let own = own.filter(|index| *index >= indices.start);
                    (!cancelled).then(|| self.block(half, own, &bundles, &charts))
                };
                chunk.par_iter().filter_map(of).collect()
            };
            let (traced, ()) = rayon::join(follow, || self.deposit(&waiting, halves));
            report.trace_s.add(watch.elapsed());
            if listener.control.is_cancelled() {
                report.cancelled = true;
                return report;
            }
            for block in &traced {
                report.ledger.merge(&block.ledger);
                report.rays += block.rays;
                report.segments += block.segments;
                report.splats += block.deposits.len() as u64;
            }
            listener
                .progress
                .advance(Stage::Caustic, listener.done + report.rays, listener.total);
            waiting = traced;
        }
        report
    }

    /// Bundles for this number of photons in each half.
    fn bundles(&self, charts: &KnownCharts, photons: f64, control: &Control) -> Bundles {
        if !self.has_bundles {
            return Bundles::default();
        }
        let chart_of = |receiver: Receiver| self.chart(receiver, charts);
        let surveyor = Surveyor {
            launch: self.launch,
            rules: self.rules,
            chart_of: &chart_of,
            control,
        };
        Bundles::new(&surveyor, photons * HALVES as f64)
    }

    /// Deposits bundles into the maps of both halves, for photons of these indices in each.
    fn deposit_bundles(
        &self,
        bundles: &Bundles,
        indices: &Range<u32>,
        halves: &mut [&mut [ReceiverMaps]],
    ) -> LedgerSum {
        let count = |flux_w| self.rules.unit.count(flux_w);
        let of_half = |(half, sets): (usize, &mut &mut [ReceiverMaps])| {
            let seed = half_seed(self.rules.seed, half).wrapping_add(u64::from(indices.start));
            let mut ledger = LedgerSum::default();
            let photons = (indices.len() as f64, seed);
            bundles.deposit(
                photons,
                self.rules.spectrum,
                count,
                |band, receiver, triangles| {
                    let set = set_of(band, sets.len());
                    sets[set].touch(receiver, self.chart_for);
                    if let Some(map) = sets[set].get_mut(receiver) {
                        let placed = deposit_triangles(triangles, map).deposited;
                        ledger.book_sum(Account::Deposited, placed);
                        ledger.book_sum(Account::Bundled, placed);
                        ledger.book_sum(Account::Sampling, placed.map(|count| -count));
                    }
                },
            );
            ledger
        };
        let ledgers: Vec<LedgerSum> = halves.par_iter_mut().enumerate().map(of_half).collect();
        ledgers.iter().fold(LedgerSum::default(), |mut sum, ledger| {
            sum.merge(ledger);
            sum
        })
    }

    fn block(
        &self,
        half: usize,
        indices: impl Iterator<Item = u32>,
        bundles: &Bundles,
        charts: &KnownCharts,
    ) -> Block {
        let rules = PhotonRules {
            seed: half_seed(self.rules.seed, half),
            ..self.rules
        };
        let mut block = Block {
            half,
            ..Block::default()
        };
        let mut order: Vec<(u64, u32)> = indices
            .map(|index| (PhotonLaunch::place(index, rules.seed), index))
            .collect();
        order.sort_unstable();
        block.rays = order.len() as u64;
        let mut walk = PhotonWalk::new(rules);
        let mut placed = LedgerSum::default();
        for (place, index) in order {
            let lamp = self.launch.lamp_place(index, rules.seed);
            let (start, carried) = match bundles.beginning(place, lamp) {
                None => (self.launch.start(index, place, rules.seed), Carried::default()),
                Some((cell, within, carried)) => {
                    let start = self.launch.start_in(cell, within, lamp).map(|start| Start {
                        flux_w: start.flux_w * carried.scale,
                        ..start
                    });
                    (start, carried)
                }
            };
            walk.follow(index, start, carried, |hit| {
                let count = rules.unit.count(hit.flux_w);
                if let PhotonArrival::Map(_) = hit.place {
                    placed.book(Account::Sampling, count.map(|count| -count));
                }
                match self.texel(&hit, charts) {
                    Some(texel) => {
                        placed.book(Account::Deposited, count);
                        block.deposits.push(Deposit {
                            receiver: hit.receiver,
                            texel,
                            band: hit.band,
                            count,
                        });
                    }
                    None => placed.book(Account::Unresolved, count),
                }
            });
        }
        block.ledger = walk.ledger;
        block.ledger.merge(&placed);
        block.segments = walk.segments;
        block
    }

    /// The texel that a hit lies in; `None` without a map, or if the texel has no surface.
    fn texel(&self, hit: &Hit, charts: &KnownCharts) -> Option<u32> {
        let chart = self.chart(hit.receiver, charts)?;
        let size = DVec2::new(chart.width as f64, chart.height as f64);
        let place = match hit.place {
            PhotonArrival::Surface {
                triangle,
                barycentric,
            } => chart.uv(triangle, barycentric) * size,
            PhotonArrival::Map(place) => place,
        };
        let place = place.clamp(DVec2::ZERO, size - 0.5);
        let texel = chart.texel_at(place.x as usize, place.y as usize);
        (chart.texel_area_m2(texel) > 0.0).then_some(texel as u32)
    }

    fn chart<'c>(&self, receiver: Receiver, charts: &'c KnownCharts) -> Option<&'c Chart> {
        let chart = charts[receiver.index()].get_or_init(|| (self.chart_for)(receiver));
        chart.as_deref()
    }

    fn deposit(&self, blocks: &[Block], halves: &mut [&mut [ReceiverMaps]]) {
        for block in blocks {
            for run in block
                .deposits
                .chunk_by(|a, b| (a.band, a.receiver) == (b.band, b.receiver))
            {
                let sets = &mut *halves[block.half];
                let set = set_of(run[0].band, sets.len());
                sets[set].touch(run[0].receiver, self.chart_for);
                let Some(map) = sets[set].get_mut(run[0].receiver) else {
                    continue;
                };
                let texels = map.texels_mut();
                for deposit in run {
                    let sum = &mut texels[deposit.texel as usize];
                    for (sum, count) in sum.iter_mut().zip(deposit.count) {
                        *sum += count;
                    }
                }
            }
        }
    }
}

/// The set of maps for light of a band: one set holds all bands, or each band has its own.
fn set_of(band: Option<usize>, sets: usize) -> usize {
    if sets == 1 { 0 } else { band.unwrap_or(0) }
}

pub fn half_seed(seed: u64, half: usize) -> u64 {
    seed.wrapping_mul(2)
        .wrapping_add(half as u64)
        .wrapping_mul(GOLDEN_64)
}
