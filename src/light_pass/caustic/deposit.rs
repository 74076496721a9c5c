//! Takes traced rows to the maps: footprints from the neighbouring rows, then kernels of flux, in parallel over bands
//! of texel rows. Sums are integers, so that neither order nor number of threads matters.

use rayon::prelude::*;
use std::collections::BTreeMap;

use super::footprint::{Neighbours, footprint};
use super::kernel::Profile;
use super::lattice::{Lattice, TracedRow};
use super::path::Arrival;
use super::splat::{Coverage, Splat, Window};
use super::statistics::FootprintStatistics;
use crate::illumination::accumulator::FluxCount;
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::light_pass::receiver_maps::{ReceiverMap, ReceiverMaps};
use crate::settings::{BakeSettings, Footprint, Kernel, KernelSampling, Sigma};

/// Texel rows that one task adds to.
const ROWS_PER_TASK: usize = 32;

/// How kernels are made from arrivals.
#[derive(Clone, Copy, Debug)]
pub struct Depositor<'a> {
    /// Of the rays.
    pub lattice: Lattice<'a>,
    /// Kernel, footprint, sigma.
    pub settings: &'a BakeSettings,
    /// Mean footprints of a coarser run, where the settings ask for them.
    pub statistics: Option<&'a FootprintStatistics>,
}

/// A traced row with those before and after it.
#[derive(Clone, Copy, Debug)]
pub struct RowContext<'a> {
    /// The row itself.
    pub row: &'a TracedRow,
    /// Its index in the lattice.
    pub index: usize,
    /// The row before.
    pub before: Option<&'a TracedRow>,
    /// The row after.
    pub after: Option<&'a TracedRow>,
}

/// What a deposit did.
#[derive(Clone, Debug, Default)]
pub struct DepositReport {
    /// Deposited and unresolved flux.
    pub ledger: LedgerSum,
    /// Kernels deposited.
    pub splats: u64,
    /// Sizes of their footprints.
    pub statistics: FootprintStatistics,
}

impl Depositor<'_> {
    /// Deposits rows of one face. Maps must have been touched for every object of the arrivals.
    pub fn deposit(&self, rows: &[RowContext], maps: &mut ReceiverMaps) -> DepositReport {
        let parts: Vec<RowSplats> = rows.par_iter().map(|row| self.splats_of(row, maps)).collect();
        let mut report = DepositReport::default();
        let mut groups: BTreeMap<(u32, usize), Vec<Splat>> = BTreeMap::new();
        for part in parts {
            report.ledger.merge(&part.ledger);
            report.statistics.merge(&part.statistics);
            report.splats += part.splats.len() as u64;
            for (object, level, splat) in part.splats {
                groups.entry((object, level)).or_default().push(splat);
            }
        }
        for ((object, level), splats) in groups {
            let map = maps
                .get_mut(object as usize)
                .expect("splats are made only for allocated maps");
            report
                .ledger
                .merge(&add_splats(&splats, map, level, self.settings.kernel_sampling));
        }
        report
    }

    fn splats_of(&self, context: &RowContext, maps: &ReceiverMaps) -> RowSplats {
        let mut made = RowSplats::default();
        for (&column, arrival) in context.row.columns.iter().zip(&context.row.arrivals) {
            match self.splat_of(column, arrival, context, maps, &mut made.statistics) {
                Some((level, splat)) => made.splats.push((arrival.object, level, splat)),
                None => made
                    .ledger
                    .book(Account::Unresolved, self.lattice.unit.count(arrival.flux_w)),
            }
        }
        made
    }

    fn splat_of(
        &self,
        column: u32,
        arrival: &Arrival,
        context: &RowContext,
        maps: &ReceiverMaps,
        statistics: &mut FootprintStatistics,
    ) -> Option<(usize, Splat)> {
        let object = arrival.object as usize;
        let map = maps.get(object)?;
        let (centre, rows) = map.locate(self.lattice.tracer.scene(), arrival)?;
        let (low, high) = self.lattice.cell(column as usize, context.index);
        let unbent_area_m2 = self.lattice.launch.cell_area_at_m2(low, high, arrival.path_m);
        let neighbours = Neighbours {
            across: [
                column
                    .checked_sub(1)
                    .and_then(|before| context.row.matching(before, arrival)),
                context.row.matching(column + 1, arrival),
            ],
            down: [
                context.before.and_then(|row| row.matching(column, arrival)),
                context.after.and_then(|row| row.matching(column, arrival)),
            ],
        };
        let mean = self.statistics.and_then(|statistics| statistics.mean(object));
        let fixed_area_m2 = match self.settings.footprint {
            // A surface that the coarse run missed has no mean.
            Footprint::Fixed => mean.map_or(unbent_area_m2, |mean| mean.area_m2),
            Footprint::Ellipse | Footprint::Disc | Footprint::Distance => unbent_area_m2,
        };
        let ellipse = footprint(
            self.settings.footprint,
            arrival,
            &neighbours,
            &rows,
            unbent_area_m2,
            fixed_area_m2,
        );
        if !ellipse.is_finite() {
            return None;
        }
        let texels_per_m2 = rows[0].cross(rows[1]).length();
        let area_m2 = ellipse.area_texels() / texels_per_m2;
        let texels = (map.chart.width * map.chart.height) as f64;
        statistics.add(
            object,
            arrival.flux_w.luminance(),
            area_m2,
            ellipse.area_texels() / texels,
        );
        let sigma = match (self.settings.kernel, self.settings.sigma) {
            (Kernel::Gaussian, Sigma::Constant(sigma)) => sigma,
            // The range of the paper's figure 5.
            (Kernel::Gaussian, Sigma::Adaptive) => {
                mean.map_or(1.0, |mean| (area_m2 / mean.area_m2).sqrt().clamp(0.5, 2.0))
            }
            (Kernel::Cone | Kernel::Disc | Kernel::Box, _) => 1.0,
        };
        let flux = self.lattice.unit.count(arrival.flux_w);
        let splat = Splat {
            centre,
            ellipse,
            profile: Profile::new(self.settings.kernel, sigma),
            flux,
            island: map.island(arrival),
        };
        // Only a gaussian is smooth at every level; point samples are to be the paper's.
        let smooth = self.settings.kernel == Kernel::Gaussian
            && self.settings.kernel_sampling == KernelSampling::Integrated;
        let level = if smooth {
            map.level_for(splat.narrowest_spread())
        } else {
            0
        };
        Some((level, splat.at_level(level)))
    }
}

/// What one row gave.
#[derive(Debug, Default)]
struct RowSplats {
    /// Object, level of its map, kernel.
    splats: Vec<(u32, usize, Splat)>,
    ledger: LedgerSum,
    statistics: FootprintStatistics,
}

/// Adds splats to one level of a map, each task to its own rows of texels.
fn add_splats(splats: &[Splat], map: &mut ReceiverMap, level: usize, sampling: KernelSampling) -> LedgerSum {
    let (flux, covered) = map.level(level);
    let size = covered.size();
    let tasks = size.1.div_ceil(ROWS_PER_TASK);
    let mut by_task: Vec<Vec<u32>> = vec![Vec::new(); tasks];
    for (index, splat) in splats.iter().enumerate() {
        for task in tasks_of(splat, size.1) {
            by_task[task].push(index as u32);
        }
    }
    let parts: Vec<LedgerSum> = flux
        .texels_mut()
        .par_chunks_mut(ROWS_PER_TASK * size.0)
        .zip(by_task)
        .enumerate()
        .map(|(task, (texels, indices))| {
            let rows = (task * ROWS_PER_TASK, task * ROWS_PER_TASK + texels.len() / size.0);
            let mut ledger = LedgerSum::default();
            let mut window = Window::default();
            for index in indices {
                add_splat(
                    &splats[index as usize],
                    &covered,
                    sampling,
                    rows,
                    texels,
                    &mut window,
                    &mut ledger,
                );
            }
            ledger
        })
        .collect();
    let mut ledger = LedgerSum::default();
    for part in &parts {
        ledger.merge(part);
    }
    ledger
}

fn add_splat(
    splat: &Splat,
    coverage: &impl Coverage,
    sampling: KernelSampling,
    rows: (usize, usize),
    texels: &mut [FluxCount],
    window: &mut Window,
    ledger: &mut LedgerSum,
) {
    let size = coverage.size();
    splat.weigh(sampling, coverage, window);
    if window.is_placed() {
        let added = window.add(splat.flux, size, rows, texels);
        ledger.book(Account::Deposited, added);
    } else if splat.home_row(size.1) >= rows.0 && splat.home_row(size.1) < rows.1 {
        // Exactly one task owns the row of the centre.
        ledger.book(Account::Unresolved, splat.flux);
    }
}

/// Tasks whose rows a splat may reach, after folding at the map's borders; always that of its centre.
fn tasks_of(splat: &Splat, height: usize) -> std::ops::RangeInclusive<usize> {
    let (first, last) = splat.rows();
    let height = height as i64;
    // A kernel that crosses a border comes back at most to that border's mirror image of its far end.
    let low = if first < 0 { 0 } else { first };
    let high = if last >= height { height - 1 } else { last };
    let low = if last >= height {
        low.min((2 * height - 1 - last).max(0))
    } else {
        low
    };
    let high = if first < 0 {
        high.max((-1 - first).min(height - 1))
    } else {
        high
    };
    let home = splat.home_row(height as usize) as i64;
    (low.min(home) as usize / ROWS_PER_TASK)..=(high.max(home) as usize / ROWS_PER_TASK)
}
