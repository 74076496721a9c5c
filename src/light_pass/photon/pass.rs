//! Many photons: blocks of them are followed side by side, and their hits counted into texels as whole numbers, so that
//! neither order nor threads change a bit.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use glam::DVec2;
use rayon::prelude::*;

use super::launch::PhotonLaunch;
use super::walk::{Hit, PhotonRules, PhotonWalk};
use crate::illumination::accumulator::FluxCount;
use crate::illumination::{Chart, Receiver};
use crate::light_pass::caustic::pass::{Listener, PassReport, Stopwatch};
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::light_pass::receiver_maps::{ChartFor, ReceiverMaps};
use crate::light_pass::share::Share;
use crate::progress::Stage;

/// Photons of a block, about: a short stretch of the domain's curve, so that neighbours meet the same triangles.
const BLOCK: u32 = 1 << 14;

/// Blocks that are followed before their hits are counted.
const BLOCKS_AT_ONCE: usize = 16;

/// Independent samples of the same strata: their difference is the noise.
pub const HALVES: usize = 2;

/// The photons of one light.
pub struct PhotonPass<'a> {
    /// Where they start.
    pub launch: &'a PhotonLaunch<'a>,
    /// What they share; the seed is that of the first half.
    pub rules: PhotonRules<'a>,
    /// Charts of maps.
    pub chart_for: &'a ChartFor<'a>,
}

/// Flux for one texel.
struct Deposit {
    receiver: Receiver,
    texel: u32,
    /// Band of its wavelength.
    band: Option<usize>,
    count: FluxCount,
}

/// What became of a block.
#[derive(Default)]
struct Block {
    half: usize,
    deposits: Vec<Deposit>,
    ledger: LedgerSum,
    rays: u64,
    segments: u64,
}

/// Charts that were asked for, by receiver.
type KnownCharts = Vec<OnceLock<Option<Arc<Chart>>>>;

impl PhotonPass<'_> {
    /// Follows the photons of both halves with these indices, or a share of the blocks that they are divided into.
    /// Each half has one set of maps, or one for each band.
    pub fn run(
        &self,
        indices: Range<u32>,
        share: Option<Share>,
        halves: &mut [&mut [ReceiverMaps]],
        listener: &Listener,
    ) -> PassReport {
        // Indices that are alike in their last bits have places that are alike in their first ones.
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
        let mut waiting: Vec<Block> = Vec::new();
        for chunk in blocks.chunks(BLOCKS_AT_ONCE).chain([&[][..]]) {
            let watch = Stopwatch::start();
            let follow = || -> Vec<Block> {
                let of = |&(half, first): &(usize, u32)| {
                    let cancelled = listener.control.is_cancelled();
                    let own = (first..indices.end).step_by(stride as usize);
                    let own = own.filter(|index| *index >= indices.start);
                    (!cancelled).then(|| self.block(half, own, &charts))
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

    fn block(&self, half: usize, indices: impl Iterator<Item = u32>, charts: &KnownCharts) -> Block {
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
            let Some(start) = self.launch.start(index, place, rules.seed) else {
                continue;
            };
            walk.follow(index, &start, |hit| {
                let count = rules.unit.count(hit.flux_w);
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

    /// The texel that a hit lies in; `None` without a map, and where the surface reaches none.
    fn texel(&self, hit: &Hit, charts: &KnownCharts) -> Option<u32> {
        let chart = charts[hit.receiver.index()].get_or_init(|| (self.chart_for)(hit.receiver));
        let chart = chart.as_ref()?;
        let uv = chart.uv(hit.triangle, hit.barycentric);
        let size = DVec2::new(chart.width as f64, chart.height as f64);
        let place = (uv * size).clamp(DVec2::ZERO, size - 0.5);
        let texel = chart.texel_at(place.x as usize, place.y as usize);
        (chart.texel_area_m2(texel) > 0.0).then_some(texel as u32)
    }

    fn deposit(&self, blocks: &[Block], halves: &mut [&mut [ReceiverMaps]]) {
        for block in blocks {
            for run in block
                .deposits
                .chunk_by(|a, b| (a.band, a.receiver) == (b.band, b.receiver))
            {
                let sets = &mut *halves[block.half];
                let set = if sets.len() == 1 {
                    0
                } else {
                    run[0].band.unwrap_or(0)
                };
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

/// The seed of a half.
pub fn half_seed(seed: u64, half: usize) -> u64 {
    seed.wrapping_mul(2)
        .wrapping_add(half as u64)
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
}
