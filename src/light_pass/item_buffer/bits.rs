//! One bit per cell of a face.

use super::CELLS_PER_SIDE;
use super::grid::CellRange;

const WORDS_PER_ROW: usize = CELLS_PER_SIDE / 64;

// Rows are also read as one 128-bit word.
const _: () = assert!(WORDS_PER_ROW == 2);

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct CellBits(Vec<[u64; WORDS_PER_ROW]>);

impl CellBits {
    /// No bit set, or all.
    pub(super) fn filled(on: bool) -> Self {
        let word = if on { u64::MAX } else { 0 };
        Self(vec![[word; WORDS_PER_ROW]; CELLS_PER_SIDE])
    }

    pub(super) fn get(&self, column: usize, row: usize) -> bool {
        self.0[row][column / 64] >> (column % 64) & 1 == 1
    }

    pub(super) fn set(&mut self, column: usize, row: usize) {
        self.0[row][column / 64] |= 1 << (column % 64);
    }

    pub(super) fn clear(&mut self, column: usize, row: usize) {
        self.0[row][column / 64] &= !(1 << (column % 64));
    }

    pub(super) fn count(&self) -> u64 {
        self.0
            .iter()
            .flatten()
            .map(|word| u64::from(word.count_ones()))
            .sum()
    }

    /// Whether any bit of a rectangle is set.
    pub(super) fn any_in(&self, cells: &CellRange) -> bool {
        let mask = row_mask(cells.columns);
        (cells.rows.0..=cells.rows.1).any(|row| {
            let words = &self.0[row];
            (0..WORDS_PER_ROW).any(|word| words[word] & mask[word] != 0)
        })
    }

    /// Set bits of a rectangle as (column, row), row by row.
    pub(super) fn list(&self, cells: &CellRange) -> Vec<(usize, usize)> {
        let mask = row_mask(cells.columns);
        let mut list = Vec::new();
        for row in cells.rows.0..=cells.rows.1 {
            for (word, mask) in mask.iter().enumerate() {
                let mut bits = self.0[row][word] & mask;
                while bits != 0 {
                    list.push((64 * word + bits.trailing_zeros() as usize, row));
                    bits &= bits - 1;
                }
            }
        }
        list
    }

    /// Bits set here but not in the other.
    #[must_use]
    pub(super) fn without(&self, other: &Self) -> Self {
        let rows = self.0.iter().zip(&other.0);
        Self(
            rows.map(|(a, b)| std::array::from_fn(|word| a[word] & !b[word]))
                .collect(),
        )
    }

    /// Runs of columns set in any of some rows, as ascending half-open spans.
    pub(super) fn runs(&self, rows: (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
        let mut any: u128 = 0;
        for row in &self.0[rows.0..=rows.1] {
            any |= u128::from(row[1]) << 64 | u128::from(row[0]);
        }
        std::iter::from_fn(move || {
            if any == 0 {
                return None;
            }
            let begin = any.trailing_zeros();
            let length = (any >> begin).trailing_ones();
            let end = begin + length;
            any = any.checked_shr(end).map_or(0, |rest| rest << end);
            Some((begin as usize, end as usize))
        })
    }
}

/// Bits of the columns from first to last, both included.
fn row_mask((first, last): (usize, usize)) -> [u64; WORDS_PER_ROW] {
    let below = |end: usize| if end >= 64 { u64::MAX } else { (1 << end) - 1 };
    std::array::from_fn(|word| {
        let base = 64 * word;
        below((last + 1).saturating_sub(base)) & !below(first.saturating_sub(base))
    })
}
