//! Cached arrivals of one light: other kernels and maps are deposited from them without a new ray.

use glam::DVec2;
use rayon::prelude::*;

use super::deposit::RowContext;
use super::lattice::{Lattice, Points, TracedRow};
use crate::illumination::Receiver;
use crate::light_pass::ledger_sum::LedgerSum;
use crate::light_pass::path::{Arrival, PathSignature};
use crate::optics::LinearSrgb;

/// All arrivals of one light at diffuse surfaces, row by row of its lattice.
#[derive(Debug, Default)]
pub struct ArrivalCache {
    /// Rows of all faces, face by face.
    rows: Vec<KeptRow>,
    /// Ledger of the paths, without `Deposited`.
    ledger: LedgerSum,
    bytes: u64,
}

fn is_grey(arrival: &Arrival) -> bool {
    let [r, g, b] = arrival.flux_w.to_array().map(f64::to_bits);
    r == g && g == b
}

/// Arrivals of one row, in order.
#[derive(Debug)]
struct KeptRow {
    arrivals: Box<[StoredArrival]>,
    /// Second and third channel of each arrival's flux [W]; empty if all are grey.
    colours: Box<[[f64; 2]]>,
}

/// An arrival without what can be derived from the rest: 56 bytes.
#[derive(Clone, Copy, Debug)]
struct StoredArrival {
    signature: u64,
    barycentric: [f64; 2],
    path_m: f64,
    /// First channel of the flux [W].
    flux_w: f64,
    column: u32,
    receiver: Receiver,
    triangle: u32,
}

impl ArrivalCache {
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    pub fn arrivals(&self) -> u64 {
        self.rows.iter().map(|row| row.arrivals.len() as u64).sum()
    }

    /// Ledger of the paths, without `Deposited`.
    pub fn ledger(&self) -> &LedgerSum {
        &self.ledger
    }

    /// Appends the next traced rows.
    pub fn push(&mut self, traced: &[RowContext]) {
        let rows: Vec<KeptRow> = traced
            .par_iter()
            .map(|traced| KeptRow::pack(traced.row))
            .collect();
        self.bytes += rows.iter().map(KeptRow::bytes).sum::<u64>();
        self.rows.extend(rows);
        traced
            .iter()
            .for_each(|traced| self.ledger.merge(&traced.row.ledger));
    }

    /// A row identical to that of [`Lattice::trace_row`], bit by bit, but without its ledger. A lattice with strides
    /// gets the arrivals of its own rays.
    pub fn row(&self, lattice: &Lattice, face: usize, row: usize) -> TracedRow {
        let fine_row = lattice.fine_row(row);
        let kept = &self.rows[face * lattice.size.1 + fine_row];
        let most = kept.arrivals.len().div_ceil(lattice.strides.0);
        let mut unpacked = TracedRow {
            columns: Vec::with_capacity(most),
            arrivals: Vec::with_capacity(most),
            ..TracedRow::default()
        };
        let mut points = Points::new(lattice.tracer.scene());
        for (index, arrival) in kept.arrivals.iter().enumerate() {
            if let Some(column) = lattice.coarse_column(arrival.column as usize) {
                let mut arrival = kept.unpack(index);
                arrival.point = points.of(&arrival);
                arrival.flux_w = arrival.flux_w * lattice.cells_of(column, row);
                unpacked.columns.push(column as u32);
                unpacked.arrivals.push(arrival);
            }
        }
        unpacked
    }
}

impl KeptRow {
    fn pack(row: &TracedRow) -> Self {
        let pack = |(&column, arrival): (&u32, &Arrival)| StoredArrival {
            signature: arrival.signature.0,
            barycentric: arrival.barycentric.to_array(),
            path_m: arrival.path_m,
            flux_w: arrival.flux_w.to_array()[0],
            column,
            receiver: arrival.receiver,
            triangle: arrival.triangle,
        };
        let colours = if row.arrivals.iter().all(is_grey) {
            Box::default()
        } else {
            let rest = |arrival: &Arrival| {
                let [_, g, b] = arrival.flux_w.to_array();
                [g, b]
            };
            row.arrivals.iter().map(rest).collect()
        };
        Self {
            arrivals: row.columns.iter().zip(&row.arrivals).map(pack).collect(),
            colours,
        }
    }

    /// Everything except its point.
    fn unpack(&self, index: usize) -> Arrival {
        let kept = &self.arrivals[index];
        let [g, b] = self
            .colours
            .get(index)
            .copied()
            .unwrap_or([kept.flux_w, kept.flux_w]);
        Arrival {
            receiver: kept.receiver,
            triangle: kept.triangle,
            signature: PathSignature(kept.signature),
            barycentric: DVec2::from_array(kept.barycentric),
            point: glam::DVec3::ZERO,
            flux_w: LinearSrgb::new(kept.flux_w, g, b),
            path_m: kept.path_m,
        }
    }

    fn bytes(&self) -> u64 {
        (size_of::<Self>() + size_of_val(&*self.arrivals) + size_of_val(&*self.colours)) as u64
    }
}
