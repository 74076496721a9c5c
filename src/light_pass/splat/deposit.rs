//! Deposits traced rows: footprints from the neighbouring rows, then kernels of flux.

use rayon::prelude::*;
use std::collections::BTreeMap;

use super::blocks::{self, SplatBounds};
use super::footprint::{Neighbours, footprint};
use super::kernel::Profile;
use super::lattice::{Lattice, TracedRow};
use super::neighbourhood::Neighbourhood;
use super::surface::{Surface, Surfaces};
use super::window::Splat;
use crate::illumination::Receiver;
use crate::light_pass::footprint_statistics::FootprintStatistics;
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::light_pass::pass_report::PassReport;
use crate::light_pass::path::Arrival;
use crate::light_pass::receiver_maps::{ChartFor, ReceiverMaps};
use crate::settings::{BakeSettings, Kernel, KernelSampling, Sigma};

/// Makes kernels of flux from arrivals and deposits them.
#[derive(Clone, Copy, Debug)]
pub struct Depositor<'a> {
    /// Lattice of the rays.
    pub lattice: Lattice<'a>,
    pub settings: &'a BakeSettings,
    /// Mean footprints of a coarser run, where the settings need them.
    pub statistics: Option<&'a FootprintStatistics>,
    /// Whether sizes of footprints are recorded.
    pub gathers: bool,
}

/// A traced row with its neighbours.
#[derive(Clone, Copy, Debug)]
pub struct RowContext<'a> {
    pub row: &'a TracedRow,
    /// Index in the lattice.
    pub index: usize,
    pub before: Option<&'a TracedRow>,
    pub after: Option<&'a TracedRow>,
}

/// Maps of both half sets of rays, or of all rays together.
#[derive(Debug)]
pub struct HalfBuffers<'a> {
    /// Of all rays, or of every other one.
    pub first: &'a mut ReceiverMaps,
    /// Of the remaining rays.
    pub second: Option<&'a mut ReceiverMaps>,
}

impl HalfBuffers<'_> {
    fn maps(&mut self, is_second: bool) -> &mut ReceiverMaps {
        match &mut self.second {
            Some(second) if is_second => second,
            _ => self.first,
        }
    }

    /// Allocates the maps of a receiver unless that was tried before.
    pub fn touch(&mut self, receiver: Receiver, chart_for: &ChartFor) {
        self.first.touch(receiver, chart_for);
        if let Some(second) = &mut self.second {
            second.touch(receiver, chart_for);
        }
    }
}

impl Depositor<'_> {
    /// Deposits rows of one face. Maps must have been touched for every receiver of the arrivals. Half sets, if there
    /// are two, take rays in a checkerboard pattern. Reports kernels, and deposited and unresolved flux.
    pub fn deposit(&self, rows: &[RowContext], halves: &mut HalfBuffers) -> PassReport {
        // Each row makes its splats by itself; they are then grouped by the map and level that they go to.
        let parts: Vec<RowSplats> = rows
            .par_iter()
            .map(|row| self.splats_of(row, halves.first))
            .collect();
        let mut report = PassReport::default();
        let mut groups: BTreeMap<(bool, Receiver, u32), Vec<&PlacedSplat>> = BTreeMap::new();
        for part in &parts {
            report.ledger.merge(&part.ledger);
            report.statistics.merge(&part.statistics);
            report.splats += part.splats.len() as u64;
            // Neighbours mostly go to the same map.
            for run in part
                .splats
                .chunk_by(|a, b| (a.receiver, a.level) == (b.receiver, b.level))
            {
                if halves.second.is_none() {
                    let group = groups.entry((false, run[0].receiver, run[0].level)).or_default();
                    group.extend(run);
                    continue;
                }
                for splat in run {
                    let key = (splat.is_second, splat.receiver, splat.level);
                    groups.entry(key).or_default().push(splat);
                }
            }
        }

        // One map after the other, each filled by all threads.
        for ((is_second, receiver, level), splats) in groups {
            let map = halves
                .maps(is_second)
                .get_mut(receiver)
                .expect("splats are made only for allocated maps");
            let (flux, covered) = map.level(level as usize);
            let ledger = blocks::add(&splats, flux, &covered, self.settings.kernel_sampling);
            report.ledger.merge(&ledger);
        }
        report
    }

    fn splats_of(&self, context: &RowContext, maps: &ReceiverMaps) -> RowSplats {
        let mut made = RowSplats::default();
        made.splats.reserve_exact(context.row.arrivals.len());
        let mut surfaces = Surfaces::new(self.lattice.tracer.scene(), maps);
        let mut neighbourhood = Neighbourhood::new(context);
        for index in 0..context.row.arrivals.len() {
            let arrival = &context.row.arrivals[index];
            let neighbours = neighbourhood.of(index);
            let column = context.row.columns[index] as usize;
            let unbent_area_m2 = || {
                let (low, high) = self.lattice.cell(column, context.index);
                self.lattice.launch.cell_area_at_m2(low, high, arrival.path_m)
            };
            let placed = surfaces
                .of(arrival)
                .and_then(|surface| self.place(arrival, &neighbours, surface, &unbent_area_m2, &mut made));
            match placed {
                Some(placed) => {
                    made.splats.push(PlacedSplat {
                        is_second: (column + context.index) % 2 == 1,
                        ..placed
                    });
                }
                None => made
                    .ledger
                    .book(Account::Unresolved, self.lattice.unit.count(arrival.flux_w)),
            }
        }
        made
    }

    fn place(
        &self,
        arrival: &Arrival,
        neighbours: &Neighbours,
        surface: &Surface,
        unbent_area_m2: &dyn Fn() -> f64,
        made: &mut RowSplats,
    ) -> Option<PlacedSplat> {
        // The area that the ray lights, on the map; footprints of fixed size are as large as the receiver's mean.
        let map = surface.map;
        let mean = self
            .statistics
            .and_then(|statistics| statistics.mean(arrival.receiver));
        let fixed_area_m2 = || match mean {
            Some(mean) => mean.area_m2,
            // A surface that the coarse run missed.
            None => unbent_area_m2(),
        };
        let ellipse = footprint(
            self.settings.footprint,
            arrival,
            neighbours,
            &surface.texel_from_world,
            unbent_area_m2,
            &fixed_area_m2,
        );
        if !ellipse.is_finite() {
            return None;
        }

        // Later runs need the mean footprint of each receiver.
        let area_m2 = || ellipse.area_texels() / surface.texels_per_m2;
        if self.gathers {
            let texels = (map.chart.width * map.chart.height) as f64;
            let share = ellipse.area_texels() / texels;
            made.statistics
                .add(arrival.receiver, arrival.flux_w.luminance(), area_m2(), share);
        }

        // Sigma is a Gaussian's width relative to its footprint; other kernels have the footprint's size.
        let sigma = match (self.settings.kernel, self.settings.sigma) {
            (Kernel::Gaussian, Sigma::Constant(sigma)) => sigma,
            // The range of the paper's figure 5.
            (Kernel::Gaussian, Sigma::Adaptive) => {
                mean.map_or(1.0, |mean| (area_m2() / mean.area_m2).sqrt().clamp(0.5, 2.0))
            }
            (Kernel::Cone | Kernel::Disc | Kernel::Box, _) => 1.0,
        };

        // The kernel in texels of the finest level, with its flux as counts.
        let splat = Splat {
            centre: surface.centre(arrival),
            ellipse,
            profile: Profile::new(self.settings.kernel, sigma),
            flux: self.lattice.unit.count(arrival.flux_w),
            island: map.island(arrival),
        };
        // Only a Gaussian is smooth at every level. Point samples have to be those of the paper.
        let smooth = self.settings.kernel == Kernel::Gaussian
            && self.settings.kernel_sampling == KernelSampling::Integrated;
        let level = if smooth && map.level_for(splat.narrower_spread()) > 0 {
            map.level_for(splat.narrowest_spread())
        } else {
            0
        };

        // A wide kernel reaches fewer texels on a coarser level.
        let splat = if level > 0 { splat.at_level(level) } else { splat };
        let reach = SplatBounds::of(&splat, (map.chart.width >> level, map.chart.height >> level));
        Some(PlacedSplat {
            receiver: arrival.receiver,
            level: level as u32,
            is_second: false,
            reach,
            splat,
        })
    }
}

/// A splat with its target.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlacedSplat {
    receiver: Receiver,
    /// Level of the map.
    level: u32,
    /// Whether its ray belongs to the second half set.
    is_second: bool,
    /// Texels that it may add to.
    pub(super) reach: SplatBounds,
    pub(super) splat: Splat,
}

/// Result of one row.
#[derive(Debug, Default)]
struct RowSplats {
    splats: Vec<PlacedSplat>,
    ledger: LedgerSum,
    statistics: FootprintStatistics,
}
