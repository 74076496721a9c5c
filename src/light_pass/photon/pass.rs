//! Traces many photons in parallel blocks and counts hits as integers, so that neither order nor thread count changes a
//! bit.

use std::ops::Range;

use rayon::prelude::*;

use super::launch::PhotonLaunch;
use super::receivers::Receivers;
use super::walk::{Followed, Hit, PhotonArrival, PhotonRules, PhotonWalk};
use crate::geometry::sampling::GOLDEN_64;
use crate::illumination::Receiver;
use crate::illumination::accumulator::FluxCount;
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::light_pass::pass_report::{PassReport, ProgressScope, Stopwatch};
use crate::light_pass::receiver_maps::{ChartFor, ReceiverMaps};
use crate::light_pass::shard_index::ShardIndex;
use crate::progress::Stage;

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
    pub chart_for: &'a ChartFor<'a>,
}

/// Flux for one texel.
pub(super) struct Deposit {
    pub(super) receiver: Receiver,
    pub(super) texel: u32,
    pub(super) band: Option<usize>,
    pub(super) count: FluxCount,
}

/// Result of a block of photons.
#[derive(Default)]
pub(super) struct Block {
    pub(super) half: usize,
    pub(super) deposits: Vec<Deposit>,
    pub(super) ledger: LedgerSum,
    pub(super) rays: u64,
    pub(super) segments: u64,
}

impl Block {
    /// Adds photons.
    pub(super) fn take(&mut self, deposits: Vec<Deposit>, ledger: &LedgerSum) {
        self.deposits.extend(deposits);
        self.ledger.merge(ledger);
    }
}

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

        let receivers = Receivers::new(self.rules.tracer.scene().objects.len(), self.chart_for);
        let mut report = PassReport::default();
        let trace = |&(half, first): &(usize, u32)| {
            let own = (first..indices.end).step_by(stride as usize);
            let own = own.filter(|index| *index >= indices.start);
            (vec![self.block(half, own, &receivers)], ())
        };
        let watch = Stopwatch::start();
        trace_and_deposit(&blocks, trace, halves, self.chart_for, &mut report, listener);
        report.trace_s.add(watch.elapsed());
        report.cancelled = listener.control.is_cancelled();
        report
    }

    fn block(&self, half: usize, indices: impl Iterator<Item = u32>, receivers: &Receivers) -> Block {
        // Halves are independent samples, with a seed for each.
        let rules = PhotonRules {
            seed: half_seed(self.rules.seed, half),
            ..self.rules
        };
        let mut block = Block {
            half,
            ..Block::default()
        };

        // Photons start in the order of the launch domain's curve, so that neighbours meet the same triangles.
        let mut order: Vec<(u64, u32)> = indices
            .map(|index| (PhotonLaunch::place(index, rules.seed), index))
            .collect();
        order.sort_unstable();
        block.rays = order.len() as u64;

        // Flux counts as deposited only if a texel takes it. Without a map, or on a texel without surface, it is
        // unresolved.
        let mut walk = PhotonWalk::new(rules);
        let mut placed = LedgerSum::default();
        for (place, index) in order {
            let start = self.launch.start(index, place, rules.seed);
            walk.follow(index, start, Followed::default(), |hit| {
                let count = rules.unit.count(hit.flux_w);
                match texel(&hit, receivers) {
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
}

/// The texel that a hit lies in; `None` without a map, or if the texel has no surface.
fn texel(hit: &Hit, receivers: &Receivers) -> Option<u32> {
    let chart = receivers.get(hit.receiver)?;
    let place = match hit.place {
        PhotonArrival::Surface {
            triangle,
            barycentric,
        } => chart.place(triangle, barycentric),
        PhotonArrival::Map { place, .. } => place,
    };
    chart.texel_at(place)
}

/// Traces blocks of photons for each piece of `work`, deposits them, and returns what `trace` tells besides: of fewer
/// pieces than there are if that is cancelled.
pub(super) fn trace_and_deposit<W: Sync, T: Send>(
    work: &[W],
    trace: impl Fn(&W) -> (Vec<Block>, T) + Sync,
    halves: &mut [&mut [ReceiverMaps]],
    chart_for: &ChartFor,
    report: &mut PassReport,
    listener: &ProgressScope,
) -> Vec<T> {
    // Hits of one chunk are deposited while the next one is traced; an empty last chunk flushes the rest.
    let mut told = Vec::with_capacity(work.len());
    let mut waiting: Vec<Block> = Vec::new();
    for chunk in work.chunks(BLOCKS_AT_ONCE).chain([&[][..]]) {
        let follow = || -> Vec<(Vec<Block>, T)> {
            let of = |piece: &W| (!listener.control.is_cancelled()).then(|| trace(piece));
            chunk.par_iter().filter_map(of).collect()
        };
        let (traced, ()) = rayon::join(follow, || deposit_blocks(&waiting, halves, chart_for));

        // A chunk that was cancelled may lack blocks, and is dropped.
        if listener.control.is_cancelled() {
            break;
        }

        // Counts are merged once, when a chunk is traced; its hits wait for the next round.
        waiting.clear();
        for (blocks, more) in traced {
            for block in blocks {
                report.ledger.merge(&block.ledger);
                report.rays += block.rays;
                report.segments += block.segments;
                report.splats += block.deposits.len() as u64;
                waiting.push(block);
            }
            told.push(more);
        }
        listener
            .progress
            .advance(Stage::Caustic, listener.done + report.rays, listener.total);
    }
    told
}

/// Adds what blocks deposit to the maps of their halves.
fn deposit_blocks(blocks: &[Block], halves: &mut [&mut [ReceiverMaps]], chart_for: &ChartFor) {
    for block in blocks {
        for run in block
            .deposits
            .chunk_by(|a, b| (a.band, a.receiver) == (b.band, b.receiver))
        {
            let sets = &mut *halves[block.half];
            let set = set_of(run[0].band, sets.len());
            sets[set].touch(run[0].receiver, chart_for);
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

/// The set of maps for light of a band: one set holds all bands, or each band has its own.
pub(super) fn set_of(band: Option<usize>, sets: usize) -> usize {
    if sets == 1 { 0 } else { band.unwrap_or(0) }
}

pub fn half_seed(seed: u64, half: usize) -> u64 {
    seed.wrapping_mul(2)
        .wrapping_add(half as u64)
        .wrapping_mul(GOLDEN_64)
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn halves_of_all_seeds_are_independent() {
        let seeds = (0..1000).flat_map(|seed| (0..HALVES).map(move |half| half_seed(seed, half)));
        assert_eq!(seeds.collect::<HashSet<_>>().len(), 1000 * HALVES);
    }
}
