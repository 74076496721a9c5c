//! Triangles with area: their coverage of each texel of a row, from the areas beside their sides.

use std::ops::Range;

use glam::DVec2;

use super::row::{RowShares, Sink, Span};
use super::shape::{cells, least, most};
use super::sides::{SideCut, Sides};

/// Order of the corners from top to bottom, indexed by which of a > b, b > c, a > c hold for their y (bits 1, 2, 4).
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

/// A triangle with area; x is relative to the first column of the map that it reaches, where precision is higher.
#[derive(Clone, Copy, Debug)]
pub struct Area {
    /// Column of x = 0.
    origin: usize,
    /// Number of columns that it reaches, and whether it crosses the map's left or right border.
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

    /// Passes the shares of some rows that the triangle reaches to a sink.
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

    /// For triangles of `N` columns. Has no branch that depends on the triangle's shape: mispredictions would cost more
    /// than texels that get nothing.
    #[inline(always)]
    fn for_each_narrow_row<const N: usize>(&self, rows: Range<usize>, sink: &mut impl Sink) {
        let mut y = rows.start as f64;
        let mut from = self.sides.cut(y);
        for row in rows {
            y += 1.0;
            let to = self.sides.cut(y);
            let pieces = self.sides.between(&from, &to);
            let mut ends = [to.above; N];
            for (border, end) in ends.iter_mut().take(N - 1).enumerate() {
                let here = pieces.share_up_to((border + 1) as f64);
                *end = least(to.above, from.above + here);
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
        let mut y = rows.start as f64;
        let mut from = self.sides.cut(y);
        for row in rows {
            y += 1.0;
            let to = self.sides.cut(y);
            if let Some(span) = self.wide_span(&from, &to, shares) {
                sink.add(row, span);
            }
            from = to;
        }
    }

    /// The row between two cuts, restricted to the texels that it reaches.
    #[inline(always)]
    fn wide_span<'a>(&self, from: &SideCut, to: &SideCut, shares: &'a mut RowShares) -> Option<Span<'a>> {
        // A row of the triangle may lie beside the map while others reach it.
        let pieces = self.sides.between(from, to);
        let (left, right) = pieces.extent();
        let width = self.columns as f64;
        if right <= 0.0 || left >= width {
            return None;
        }

        // Where the triangle crosses the borders of the map, only the shares between them fall on texels.
        let columns = cells(left, right, self.columns);
        let share_up_to = |x: f64| most(from.above, least(to.above, from.above + pieces.share_up_to(x)));
        let start = if left >= 0.0 { from.above } else { share_up_to(0.0) };
        let end = if right <= width {
            to.above
        } else {
            share_up_to(width)
        };

        // Most rows cross the long side and one short one, and need no third piece. Four borders are done at once.
        let borders = (columns.start + 1) as f64;
        let (fours, _) = shares.ends[..columns.len().next_multiple_of(4)].as_chunks_mut();
        match pieces.only_short() {
            Some(short) => {
                let (long, short) = (pieces.piece(0), pieces.piece(short));
                fill(fours, borders, |x| {
                    least(end, from.above + (long.share_up_to(x) + short.share_up_to(x)))
                });
            }
            None => fill(fours, borders, |x| least(end, from.above + pieces.share_up_to(x))),
        }

        // The last border has the exact share, so that no flux is lost between rows.
        let ends = &mut shares.ends[..columns.len()];
        *ends.last_mut()? = end;
        Some(Span {
            first: self.origin + columns.start,
            start,
            ends,
        })
    }
}

/// Shares up to borders from `x` on, four at a time.
#[inline(always)]
fn fill(fours: &mut [[f64; 4]], x: f64, share_up_to: impl Fn(f64) -> f64) {
    let mut x = [x, x + 1.0, x + 2.0, x + 3.0];
    for shares in fours {
        for (share, x) in shares.iter_mut().zip(&mut x) {
            *share = share_up_to(*x);
            *x += 4.0;
        }
    }
}
