//! Triangles that have area: their part in each texel of a row, from the areas beside their sides.

use std::ops::Range;

use glam::DVec2;

use super::row::{RowShares, Sink, Span};
use super::shape::{cells, least, most};
use super::sides::{Cut, Reach, Sides};

/// The order of the corners from top to bottom, by which of a > b, b > c, a > c hold of their heights (1, 2, 4).
const ORDERS: [[usize; 3]; 8] = [
    [0, 1, 2],
    [1, 0, 2],
    [0, 2, 1],
    [0, 1, 2],
    [0, 1, 2],
    [1, 2, 0],
    [2, 0, 1],
    [2, 1, 0],
];

/// A triangle that has area; x counts from the map's first column that it reaches, where numbers are finer.
#[derive(Clone, Copy, Debug)]
pub struct Area {
    /// Column that x = 0 stands for.
    origin: usize,
    /// Columns that it reaches from there on, and whether it leaves the map on either side.
    columns: usize,
    crosses_border: bool,
    sides: Sides,
}

impl Area {
    /// A triangle that reaches `columns` of the map.
    #[inline(always)]
    pub fn new(corners: &[DVec2; 3], columns: Range<usize>, crosses_border: bool) -> Self {
        let [a, b, c] = corners.map(|corner| corner.y);
        let order = ORDERS[usize::from(a > b) | usize::from(b > c) << 1 | usize::from(a > c) << 2];
        let origin = DVec2::new(columns.start as f64, 0.0);
        Self {
            origin: columns.start,
            columns: columns.len(),
            crosses_border,
            sides: Sides::new(order.map(|corner| corners[corner] - origin)),
        }
    }

    /// Gives the shares of each of some rows that the triangle reaches.
    #[inline(always)]
    pub fn for_each_row(&self, rows: Range<usize>, shares: &mut RowShares, sink: &mut impl Sink) {
        match self.columns {
            _ if self.crosses_border => self.for_each_wide_row(rows, shares, sink),
            1 => self.for_each_narrow_row::<1>(rows, sink),
            2 => self.for_each_narrow_row::<2>(rows, sink),
            3 => self.for_each_narrow_row::<3>(rows, sink),
            4 => self.for_each_narrow_row::<4>(rows, sink),
            _ => self.for_each_wide_row(rows, shares, sink),
        }
    }

    /// For triangles of `N` columns, without any decision that depends on the
    /// triangle's shape, as mistaken guesses of the processor would cost more than texels that get nothing.
    #[inline(always)]
    fn for_each_narrow_row<const N: usize>(&self, rows: Range<usize>, sink: &mut impl Sink) {
        let mut from = self.sides.cut(rows.start as f64);
        for row in rows {
            let to = self.sides.cut((row + 1) as f64);
            let pieces = self.sides.between(&from, &to);
            let mut ends = [to.above; N];
            for (border, end) in ends.iter_mut().take(N - 1).enumerate() {
                let here = pieces.share_up_to((border + 1) as f64);
                *end = least(to.above, from.above + here);
            }
            let mut before = from.above;
            for end in &mut ends {
                *end = most(before, *end);
                before = *end;
            }
            sink.add(
                row,
                Span {
                    first: self.origin,
                    start: from.above,
                    ends: &ends,
                },
            );
            from = to;
        }
    }

    fn for_each_wide_row(&self, rows: Range<usize>, shares: &mut RowShares, sink: &mut impl Sink) {
        let mut from = self.sides.cut(rows.start as f64);
        for row in rows {
            let to = self.sides.cut((row + 1) as f64);
            if let Some(span) = self.wide_span(&from, &to, shares) {
                sink.add(row, span);
            }
            from = to;
        }
    }

    /// The row between two cuts: border by border where sides are, in even steps between them.
    fn wide_span<'a>(&self, from: &Cut, to: &Cut, shares: &'a mut RowShares) -> Option<Span<'a>> {
        let pieces = self.sides.between(from, to);
        let reach = self.sides.reach(&pieces);
        let width = self.columns as f64;
        if reach.right <= 0.0 || reach.left >= width {
            return None;
        }
        let columns = cells(reach.left, reach.right, self.columns);
        let share_up_to = |x: f64| most(from.above, least(to.above, from.above + pieces.share_up_to(x)));
        let start = if reach.left >= 0.0 {
            from.above
        } else {
            share_up_to(0.0)
        };
        let end = if reach.right <= width {
            to.above
        } else {
            share_up_to(width)
        };
        let ends = &mut shares.ends[..columns.len()];
        fill(
            ends,
            columns.start,
            &reach,
            (start, end),
            pieces.full,
            share_up_to,
        );
        Some(Span {
            first: self.origin + columns.start,
            start,
            ends,
        })
    }
}

/// Fills the shares `ends` of columns from `first` on, which begin with the share `start` and end with `end`.
fn fill(
    ends: &mut [f64],
    first: usize,
    reach: &Reach,
    (start, end): (f64, f64),
    full: f64,
    share_up_to: impl Fn(f64) -> f64,
) {
    let Some(last) = ends.len().checked_sub(1) else {
        return;
    };
    // Whole columns from the border after the first one on.
    let columns_to = |x: f64| (most(0.0, x - (first + 1) as f64) as i32 as usize).min(last);
    // The border at or after the beginning of the gap gets its own share, and even steps follow to the gap's end.
    let before_gap = columns_to(reach.gap_from);
    let rest = usize::from(reach.gap_from > (first + 1 + before_gap) as f64);
    let even_from = (before_gap + rest + 1).min(last);
    let even_to = columns_to(reach.gap_to + 1.0).max(even_from);
    let border = |index: usize| (first + 1 + index) as f64;
    let mut before = start;
    for (index, share) in ends[..even_from].iter_mut().enumerate() {
        before = least(end, most(before, share_up_to(border(index))));
        *share = before;
    }
    let mut steps = 0.0;
    for share in &mut ends[even_from..even_to] {
        steps += 1.0;
        *share = least(end, before + steps * full);
    }
    before = least(end, before + steps * full);
    for (index, share) in ends[..last].iter_mut().enumerate().skip(even_to) {
        before = least(end, most(before, share_up_to(border(index))));
        *share = before;
    }
    ends[last] = end;
}
