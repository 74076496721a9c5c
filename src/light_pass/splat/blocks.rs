//! Adds splats to a map in parallel: each task adds neighbouring splats to a block of its own, and the block to the
//! map. Sums are integers, so that neither order nor number of threads matters.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::deposit::PlacedSplat;
use super::window::{Splat, Window, fold};
use crate::illumination::accumulator::{FluxAccumulator, FluxCount};
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::light_pass::receiver_maps::Coverage;
use crate::settings::KernelSampling;

/// Most splats of a task.
const MAX_SPLATS: usize = 1024;

/// Side of the tiles by which the narrowest splats are grouped [texels]. Each further class of splats has tiles twice
/// as wide, so that wide splats do not enlarge the blocks of many narrow ones.
const TILE: u32 = 32;

/// Rows of a map that are locked together.
const ROWS_PER_STRIPE: usize = 16;

/// Texels that a splat may add to, after folding at the map's borders.
#[derive(Clone, Copy, Debug)]
pub(super) struct SplatBounds {
    /// First and last.
    columns: (u32, u32),
    rows: (u32, u32),
}

impl SplatBounds {
    /// On a map of the given size.
    pub(super) fn of(splat: &Splat, (width, height): (usize, usize)) -> Self {
        let (columns, rows) = splat.columns_and_rows();
        Self {
            columns: folded(columns, splat.centre.x, width),
            rows: folded(rows, splat.centre.y, height),
        }
    }

    fn around(self, other: Self) -> Self {
        let around = |a: (u32, u32), b: (u32, u32)| (a.0.min(b.0), a.1.max(b.1));
        Self {
            columns: around(self.columns, other.columns),
            rows: around(self.rows, other.rows),
        }
    }

    /// Class and tile of a splat in one sort key.
    fn key(self, width: usize) -> u64 {
        let side = (self.columns.1 - self.columns.0).max(self.rows.1 - self.rows.0) + 1;
        let class = (2 * side / TILE).checked_ilog2().map_or(0, |class| class + 1);
        let tile = TILE << class;
        let tiles_across = (width as u32).div_ceil(tile);
        u64::from(class) << 26 | u64::from(self.rows.0 / tile * tiles_across + self.columns.0 / tile)
    }
}

/// Range of a line of `size` texels that a kernel over first to last covers after folding: a kernel that crosses a
/// border is folded back no farther than the mirror image of its far end.
fn folded((first, last): (i64, i64), centre: f64, size: usize) -> (u32, u32) {
    let size = size as i64;
    let home = fold(centre as i64, size as usize) as i64;
    let back = |index: i64| index.clamp(0, size - 1);
    let mut low = back(first).min(home);
    let mut high = back(last).max(home);
    if first < 0 {
        high = high.max(back(-1 - first));
    }
    if last >= size {
        low = low.min(back(2 * size - 1 - last));
    }
    (low as u32, high as u32)
}

/// Adds splats to one level of a map.
pub(super) fn add(
    splats: &[&PlacedSplat],
    flux: &mut FluxAccumulator,
    coverage: &impl Coverage,
    sampling: KernelSampling,
) -> LedgerSum {
    // A task takes neighbouring splats of similar width, which keeps its block small.
    let (width, _) = coverage.size();
    let mut order: Vec<u64> = splats
        .par_iter()
        .enumerate()
        .map(|(index, placed)| placed.reach.key(width) << 32 | index as u64)
        .collect();
    order.par_sort_unstable();
    let tasks: Vec<&[u64]> = order
        .chunk_by(|a, b| a >> 32 == b >> 32)
        .flat_map(|tile| tile.chunks(MAX_SPLATS))
        .collect();

    // Blocks lock the map in stripes of rows, so that tasks seldom wait for each other.
    let stripes: Vec<Mutex<&mut [FluxCount]>> = flux
        .texels_mut()
        .chunks_mut(ROWS_PER_STRIPE * width)
        .map(Mutex::new)
        .collect();

    // Each task fills a block of its own, and locks the map only to add it.
    tasks
        .into_par_iter()
        .map_init(
            || (Window::default(), Block::default()),
            |(window, block), task| {
                let splats = task.iter().map(|key| splats[(key & 0xffff_ffff) as usize]);
                block.clear(
                    splats
                        .clone()
                        .map(|placed| placed.reach)
                        .reduce(SplatBounds::around),
                );
                let ledger = add_all(
                    splats.map(|placed| &placed.splat),
                    coverage,
                    sampling,
                    window,
                    block,
                );
                block.add_to(&stripes, width);
                ledger
            },
        )
        .reduce(LedgerSum::default, |mut sum, part| {
            sum.merge(&part);
            sum
        })
}

fn add_all<'a>(
    splats: impl Iterator<Item = &'a Splat>,
    coverage: &impl Coverage,
    sampling: KernelSampling,
    window: &mut Window,
    block: &mut Block,
) -> LedgerSum {
    let mut deposited = [0_i128; 3];
    let mut ledger = LedgerSum::default();
    for splat in splats {
        splat.weigh(sampling, coverage, window);
        if window.is_placed() {
            window.add(splat.flux, coverage.size(), block);
            for (sum, channel) in deposited.iter_mut().zip(splat.flux) {
                *sum += i128::from(channel);
            }
        } else {
            ledger.book(Account::Unresolved, splat.flux);
        }
    }
    ledger.book_sum(Account::Deposited, deposited);
    ledger
}

/// A rectangle of a map's texels with what one task adds to them.
#[derive(Debug, Default)]
pub struct Block {
    /// Column and row of its first texel.
    origin: (usize, usize),
    /// Columns and rows.
    size: (usize, usize),
    texels: Vec<FluxCount>,
}

impl Block {
    fn clear(&mut self, reach: Option<SplatBounds>) {
        self.texels.clear();
        self.size = (0, 0);
        if let Some(SplatBounds { columns, rows }) = reach {
            let count = |range: (u32, u32)| (range.1 - range.0) as usize + 1;
            self.origin = (columns.0 as usize, rows.0 as usize);
            self.size = (count(columns), count(rows));
            self.texels.resize(self.size.0 * self.size.1, [0; 3]);
        }
    }

    /// Consecutive texels of one of the map's rows. The block contains all texels that its splats reach.
    pub(super) fn row_mut(&mut self, column: usize, row: usize, count: usize) -> &mut [FluxCount] {
        let begin = (row - self.origin.1) * self.size.0 + column - self.origin.0;
        &mut self.texels[begin..begin + count]
    }

    fn add_to(&self, stripes: &[Mutex<&mut [FluxCount]>], width: usize) {
        let mut row = self.origin.1;
        let end = row + self.size.1;
        while row < end {
            let stripe = row / ROWS_PER_STRIPE;
            let last = ((stripe + 1) * ROWS_PER_STRIPE).min(end);
            let mut texels = stripes[stripe].lock().unwrap_or_else(PoisonError::into_inner);
            for row in row..last {
                let begin = (row - stripe * ROWS_PER_STRIPE) * width + self.origin.0;
                let own = (row - self.origin.1) * self.size.0;
                let parts = &self.texels[own..own + self.size.0];
                for (texel, part) in texels[begin..begin + self.size.0].iter_mut().zip(parts) {
                    for channel in 0..3 {
                        texel[channel] += part[channel];
                    }
                }
            }
            row = last;
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::light_pass::splat::footprint::Ellipse;
    use crate::light_pass::splat::kernel::Profile;
    use crate::settings::Kernel;

    /// A map of so many texels across and down, all of them covered.
    struct Whole(usize);

    impl Coverage for Whole {
        fn size(&self) -> (usize, usize) {
            (self.0, self.0)
        }

        fn is_full(&self) -> bool {
            true
        }

        fn covers(&self, _: usize, _: usize, _: u32) -> bool {
            true
        }
    }

    /// Each texel has the part of the flux that the kernel's integral over it is of the whole.
    #[test]
    fn texels_take_their_share_of_a_kernel() {
        const SIDE: usize = 24;
        const SAMPLES: usize = 16;
        for kernel in [Kernel::Gaussian, Kernel::Cone, Kernel::Disc] {
            let ellipse = Ellipse {
                xx: 4.0,
                xy: 0.8,
                yy: 2.5,
            };
            let splat = Splat {
                centre: DVec2::new(12.3, 11.6),
                ellipse,
                profile: Profile::new(kernel, 0.5),
                flux: [1 << 40; 3],
                island: 0,
            };
            let mut window = Window::default();
            splat.weigh(KernelSampling::Integrated, &Whole(SIDE), &mut window);
            let mut block = Block::default();
            let range = (0, SIDE as u32 - 1);
            block.clear(Some(SplatBounds {
                columns: range,
                rows: range,
            }));
            window.add(splat.flux, (SIDE, SIDE), &mut block);

            let determinant = ellipse.xx * ellipse.yy - ellipse.xy * ellipse.xy;
            let mut integrals = vec![0.0; SIDE * SIDE];
            for (texel, integral) in integrals.iter_mut().enumerate() {
                for sample in 0..SAMPLES * SAMPLES {
                    let within = DVec2::new((sample % SAMPLES) as f64, (sample / SAMPLES) as f64) + 0.5;
                    let corner = DVec2::new((texel % SIDE) as f64, (texel / SIDE) as f64);
                    let DVec2 { x, y } = corner + within / SAMPLES as f64 - splat.centre;
                    let square = ellipse.yy * x * x - 2.0 * ellipse.xy * x * y + ellipse.xx * y * y;
                    *integral += splat.profile.weight((square / determinant).sqrt(), 0.0);
                }
            }
            let whole: f64 = integrals.iter().sum();
            for (count, integral) in block.texels.iter().zip(&integrals) {
                let share = count[1] as f64 / splat.flux[1] as f64;
                assert!(
                    (share - integral / whole).abs() < 2e-3,
                    "{kernel:?}: {share} of {}",
                    integral / whole
                );
            }
        }
    }

    #[test]
    fn folded_ranges_hold_every_folded_index() {
        for size in [1_usize, 2, 7, 40] {
            let most = size as i64;
            for first in -most..2 * most {
                for last in first..2 * most {
                    let centre = (0.5 * (first + last + 1) as f64).clamp(0.0, most as f64);
                    let (low, high) = folded((first, last), centre, size);
                    for index in first..=last {
                        let place = fold(index, size) as u32;
                        assert!(
                            (low..=high).contains(&place),
                            "{first} to {last} of {size}: {place}"
                        );
                    }
                }
            }
        }
    }
}
