//! Adds splats to a map in parallel: tasks own bands of texel rows, so that no two add to the same texel. Sums are
//! integers, so that neither order nor number of threads matters.

use rayon::prelude::*;

use super::deposit::Placed;
use super::splat::{Coverage, Splat, Window};
use crate::illumination::accumulator::{FluxAccumulator, FluxCount};
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::settings::KernelSampling;

/// A splat over more than this share of a map's rows is weighed anew by each task that it reaches.
const TALL_SHARE: usize = 8;

/// Texel rows of a task for such splats.
const ROWS_PER_TASK: usize = 32;

/// Least rows of a task for the others.
const LEAST_ROWS: usize = 4;

/// Adds splats to one level of a map.
pub(super) fn add(
    splats: &[&Placed],
    flux: &mut FluxAccumulator,
    coverage: &impl Coverage,
    sampling: KernelSampling,
) -> LedgerSum {
    let size = coverage.size();
    let tallest = size.1 / TALL_SHARE;
    let extent = |placed: &Placed| (placed.rows.1 - placed.rows.0) as usize + 1;
    let (short, tall): (Vec<&Placed>, Vec<&Placed>) =
        splats.iter().partition(|placed| extent(placed) <= tallest);
    let highest = short.iter().map(|placed| extent(placed)).max().unwrap_or(0);
    let adder = Adder {
        coverage,
        sampling,
        size,
    };
    let mut ledger = adder.add_short(&short, highest.max(LEAST_ROWS), flux.texels_mut());
    ledger.merge(&adder.add_tall(&tall, flux.texels_mut()));
    ledger
}

struct Adder<'a, C> {
    coverage: &'a C,
    sampling: KernelSampling,
    /// Texels across and down.
    size: (usize, usize),
}

impl<C: Coverage> Adder<'_, C> {
    /// Each splat spans at most two bands of `height` rows: those that begin in an even band and then those that begin
    /// in an odd one are added by tasks that own both bands.
    fn add_short(&self, splats: &[&Placed], height: usize, texels: &mut [FluxCount]) -> LedgerSum {
        let mut by_band: Vec<Vec<&Splat>> = vec![Vec::new(); self.size.1.div_ceil(height)];
        for placed in splats {
            by_band[placed.rows.0 as usize / height].push(&placed.splat);
        }
        let mut ledger = LedgerSum::default();
        for parity in 0..2 {
            let begin = (parity * height * self.size.0).min(texels.len());
            let bands: Vec<&Vec<&Splat>> = by_band.iter().skip(parity).step_by(2).collect();
            let parts: Vec<LedgerSum> = texels[begin..]
                .par_chunks_mut(2 * height * self.size.0)
                .zip(bands)
                .enumerate()
                .map(|(pair, (texels, splats))| {
                    let first_row = (2 * pair + parity) * height;
                    self.add_all(splats.iter().copied(), first_row, texels)
                })
                .collect();
            parts.iter().for_each(|part| ledger.merge(part));
        }
        ledger
    }

    /// Each task adds what falls into its own rows.
    fn add_tall(&self, splats: &[&Placed], texels: &mut [FluxCount]) -> LedgerSum {
        let mut ledger = LedgerSum::default();
        if splats.is_empty() {
            return ledger;
        }
        let parts: Vec<LedgerSum> = texels
            .par_chunks_mut(ROWS_PER_TASK * self.size.0)
            .enumerate()
            .map(|(task, texels)| {
                let first_row = task * ROWS_PER_TASK;
                let end = (first_row + ROWS_PER_TASK) as u32;
                let here = |placed: &&&Placed| placed.rows.0 < end && placed.rows.1 >= first_row as u32;
                let splats = splats.iter().filter(here).map(|placed| &placed.splat);
                self.add_all(splats, first_row, texels)
            })
            .collect();
        parts.iter().for_each(|part| ledger.merge(part));
        ledger
    }

    /// Adds the parts of splats that fall into the rows from `first_row` on, which `texels` holds.
    fn add_all<'b>(
        &self,
        splats: impl Iterator<Item = &'b Splat>,
        first_row: usize,
        texels: &mut [FluxCount],
    ) -> LedgerSum {
        let rows = (first_row, first_row + texels.len() / self.size.0);
        let mut window = Window::default();
        let mut deposited = [0_i128; 3];
        let mut ledger = LedgerSum::default();
        for splat in splats {
            splat.weigh(self.sampling, self.coverage, &mut window);
            if window.is_placed() {
                let added = window.add(splat.flux, self.size, rows, texels);
                for channel in 0..3 {
                    deposited[channel] += i128::from(added[channel]);
                }
            } else if (rows.0..rows.1).contains(&splat.home_row(self.size.1)) {
                // Exactly one task owns the row of the centre.
                ledger.book(Account::Unresolved, splat.flux);
            }
        }
        ledger.book_many(Account::Deposited, deposited);
        ledger
    }
}

/// First and last row of a map of the given height that a splat may add to, after folding at the map's borders; always
/// with that of its centre.
pub(super) fn rows_of(splat: &Splat, height: usize) -> (u32, u32) {
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
    (low.min(home) as u32, high.max(home) as u32)
}
