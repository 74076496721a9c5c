//! The lattice of light rays over a launch domain, traced a band of rows at a time, so that memory does not grow with
//! the number of rays.

use glam::DVec2;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::path::{Arrival, PathLimits, PathTracer};
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::item_buffer::ItemBuffer;
use crate::light_pass::launch::Launch;
use crate::light_pass::ledger_sum::LedgerSum;
use crate::settings::RayPlacement;
use crate::transport::Tracer;

/// All that is needed to trace the lattice of one light.
#[derive(Clone, Copy, Debug)]
pub struct Lattice<'a> {
    /// The scene.
    pub tracer: &'a Tracer,
    /// Where rays start.
    pub launch: &'a Launch,
    /// Which cells are worth a ray.
    pub item_buffer: &'a ItemBuffer,
    /// Columns and rows of each face.
    pub size: (usize, usize),
    /// Where in its cell a ray starts.
    pub placement: RayPlacement,
    /// Of the jitter.
    pub seed: u64,
    /// Of the paths.
    pub limits: PathLimits,
    /// Of the accounts.
    pub unit: FluxUnit,
}

/// One traced row: arrivals in ascending order of their column.
#[derive(Clone, Debug, Default)]
pub struct TracedRow {
    /// Column of each arrival.
    pub columns: Vec<u32>,
    /// What arrived.
    pub arrivals: Vec<Arrival>,
    /// Accounts of the row.
    pub ledger: LedgerSum,
    /// Rays launched.
    pub rays: u64,
    /// Closest-hit queries.
    pub segments: u64,
}

impl TracedRow {
    /// The arrival from a column that took the same way to the same object as `like`.
    pub fn matching(&self, column: u32, like: &Arrival) -> Option<&Arrival> {
        let start = self.columns.partition_point(|&c| c < column);
        self.columns[start..]
            .iter()
            .zip(&self.arrivals[start..])
            .take_while(|(c, _)| **c == column)
            .map(|(_, arrival)| arrival)
            .find(|arrival| arrival.object == like.object && arrival.signature == like.signature)
    }
}

impl Lattice<'_> {
    /// Corners of a cell in the unit square of its face.
    pub fn cell(&self, column: usize, row: usize) -> (DVec2, DVec2) {
        let (columns, rows) = (self.size.0 as f64, self.size.1 as f64);
        let low = DVec2::new(column as f64 / columns, row as f64 / rows);
        let high = DVec2::new((column + 1) as f64 / columns, (row + 1) as f64 / rows);
        (low, high)
    }

    /// Upper bound of the rays: lattice cells that touch a marked cell of the item buffer.
    pub fn ray_count(&self) -> u64 {
        self.item_buffer
            .lattice_cells(self.launch.face_count(), self.size)
    }

    /// Traces one row of one face.
    pub fn trace_row(&self, face: usize, row: usize) -> TracedRow {
        let mut traced = TracedRow::default();
        let mut paths = PathTracer::new(self.tracer, self.limits, self.unit);
        for (start, end) in self.item_buffer.lattice_spans(face, row, self.size) {
            for column in start..end {
                let (low, high) = self.cell(column, row);
                let square = low + (high - low) * self.place(face, column, row);
                let ray = self.launch.ray(face, square);
                let flux_w = self.launch.cell_flux_w(low, high, ray.direction);
                if flux_w.max_channel() <= 0.0 {
                    continue;
                }
                traced.rays += 1;
                paths.trace(ray, flux_w, |arrival| {
                    traced.columns.push(column as u32);
                    traced.arrivals.push(arrival);
                });
            }
        }
        traced.ledger = paths.ledger;
        traced.segments = paths.segments;
        traced
    }

    /// Place of the ray within its cell, [0, 1)².
    fn place(&self, face: usize, column: usize, row: usize) -> DVec2 {
        match self.placement {
            RayPlacement::Lattice => DVec2::splat(0.5),
            RayPlacement::Jittered => {
                // A generator per cell: the same whatever the order of tracing.
                let cell = (face as u64) << 60 ^ (row as u64) << 30 ^ column as u64;
                let mut generator = Pcg64Mcg::seed_from_u64(self.seed.rotate_left(17) ^ cell);
                let unit = |bits: u64| (bits >> 11) as f64 * (-53_f64).exp2();
                DVec2::new(unit(generator.next_u64()), unit(generator.next_u64()))
            }
        }
    }
}
