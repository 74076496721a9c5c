//! Triangles that have area: their part in each texel of a row, from the areas beside their sides.

use std::ops::Range;

use glam::DVec2;

use super::piece::Piece;
use super::row::{RowShares, Sink, Span};
use super::shape::{cells, least, most};

/// Sides less high than this [texels] are level: they bound no area.
const LEVEL_TEXELS: f64 = 1e-30;

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
    top: f64,
    middle: DVec2,
    bottom: f64,
    /// From the top to the bottom corner.
    long: Side,
    /// From the top to the middle corner.
    upper: Side,
    /// From the middle to the bottom corner.
    lower: Side,
    /// Part of the area above the middle corner.
    share_to_middle: f64,
    /// Share of an area to the right of the long side that is not to the right of the others.
    share_per_area: f64,
}

/// A side of the triangle: x as a function of y.
#[derive(Clone, Copy, Debug)]
struct Side {
    start: DVec2,
    slope: f64,
    low: f64,
    high: f64,
    /// Part of the triangle's area per squared distance from the side's end at the top or bottom corner.
    share_per_square: f64,
}

/// The triangle cut at one height.
#[derive(Clone, Copy)]
struct Cut {
    y: f64,
    /// x on the long side.
    long: f64,
    /// x on the two others.
    short: f64,
    /// Share above.
    above: f64,
}

impl Side {
    #[inline(always)]
    fn new(start: DVec2, end: DVec2, per_height: f64) -> Self {
        let way = end - start;
        let inverse = if way.y > LEVEL_TEXELS { 1.0 / way.y } else { 0.0 };
        Self {
            start,
            slope: way.x * inverse,
            low: least(start.x, end.x),
            high: most(start.x, end.x),
            share_per_square: inverse * per_height,
        }
    }

    #[inline(always)]
    fn x_at(&self, y: f64) -> f64 {
        let x = self.start.x + (y - self.start.y) * self.slope;
        most(self.low, least(self.high, x))
    }
}

impl Area {
    /// `columns` are those of the map's `width` that the triangle reaches.
    #[inline(always)]
    pub fn new(corners: &[DVec2; 3], columns: Range<usize>, crosses_border: bool) -> Self {
        let [a, b, c] = corners.map(|corner| corner.y);
        let order = ORDERS[usize::from(a > b) | usize::from(b > c) << 1 | usize::from(a > c) << 2];
        let origin = DVec2::new(columns.start as f64, 0.0);
        let [a, b, c] = order.map(|corner| corners[corner] - origin);
        let per_height = 1.0 / (c.y - a.y);
        Self {
            origin: columns.start,
            columns: columns.len(),
            crosses_border,
            top: a.y,
            middle: b,
            bottom: c.y,
            long: Side::new(a, c, per_height),
            upper: Side::new(a, b, per_height),
            lower: Side::new(b, c, per_height),
            share_to_middle: (b.y - a.y) * per_height,
            share_per_area: 2.0 / (b - a).perp_dot(c - a),
        }
    }

    #[inline(always)]
    fn cut(&self, y: f64) -> Cut {
        let y = most(self.top, least(self.bottom, y));
        let upper = y < self.middle.y;
        let (side, distance) = if upper {
            (&self.upper, y - self.top)
        } else {
            (&self.lower, self.bottom - y)
        };
        let share = distance * distance * side.share_per_square;
        let above = if upper {
            least(share, self.share_to_middle)
        } else {
            most(1.0 - share, self.share_to_middle)
        };
        Cut {
            y,
            long: self.long.x_at(y),
            short: side.x_at(y),
            // Exactly nothing is above the top, whatever rounding says.
            above: if y > self.top { above } else { 0.0 },
        }
    }

    /// The sides between two cuts: the long one, and the others as far as the middle corner and from there on.
    #[inline(always)]
    fn pieces(&self, from: &Cut, to: &Cut) -> [Piece; 3] {
        let turns = from.y < self.middle.y && self.middle.y < to.y;
        let turn_x = if turns { self.middle.x } else { to.short };
        let turn_y = if turns { self.middle.y } else { to.y };
        [
            Piece::new(from.long, to.long, to.y - from.y),
            Piece::new(from.short, turn_x, from.y - turn_y),
            Piece::new(turn_x, to.short, turn_y - to.y),
        ]
    }

    /// Gives the shares of each of some rows that the triangle reaches.
    #[inline(always)]
    pub fn for_each_row(&self, rows: Range<usize>, shares: &mut RowShares, sink: &mut impl Sink) {
        match self.columns {
            _ if self.crosses_border => self.for_each_wide_row(rows, shares, sink),
            0..=3 => self.for_each_narrow_row::<3, 2>(rows, sink),
            4..=5 => self.for_each_narrow_row::<5, 4>(rows, sink),
            6..=9 => self.for_each_narrow_row::<9, 8>(rows, sink),
            _ => self.for_each_wide_row(rows, shares, sink),
        }
    }

    /// For triangles of up to `N` columns = `BORDERS` + 1: without any decision that depends on the triangle's shape,
    /// as mistaken guesses of the processor would cost more than texels that get nothing.
    #[inline(always)]
    fn for_each_narrow_row<const N: usize, const BORDERS: usize>(
        &self,
        rows: Range<usize>,
        sink: &mut impl Sink,
    ) {
        let mut from = self.cut(rows.start as f64);
        for row in rows {
            let to = self.cut((row + 1) as f64);
            let mut areas = [0.0; BORDERS];
            for piece in self.pieces(&from, &to) {
                piece.add_areas(1.0, &mut areas);
            }
            let mut ends = [to.above; N];
            let mut before = from.above;
            for (end, area) in ends.iter_mut().zip(areas) {
                before = most(before, least(to.above, from.above + area * self.share_per_area));
                *end = before;
            }
            sink.add(
                row,
                Span {
                    first: self.origin,
                    start: from.above,
                    ends: &ends[..self.columns],
                },
            );
            from = to;
        }
    }

    fn for_each_wide_row(&self, rows: Range<usize>, shares: &mut RowShares, sink: &mut impl Sink) {
        let mut from = self.cut(rows.start as f64);
        for row in rows {
            let to = self.cut((row + 1) as f64);
            if let Some(span) = self.wide_span(&from, &to, shares) {
                sink.add(row, span);
            }
            from = to;
        }
    }

    /// The row between two cuts: texel by texel.
    fn wide_span<'a>(&self, from: &Cut, to: &Cut, shares: &'a mut RowShares) -> Option<Span<'a>> {
        let pieces = self.pieces(from, to);
        let left = least(least(pieces[0].low, pieces[1].low), pieces[2].low);
        let right = most(most(pieces[0].high, pieces[1].high), pieces[2].high);
        let width = self.columns as f64;
        if right <= 0.0 || left >= width {
            return None;
        }
        let columns = cells(left, right, self.columns);
        let (first, count) = (columns.start, columns.len());
        let share_up_to = |x: f64| {
            let mut area = [0.0];
            for piece in &pieces {
                piece.add_areas(x, &mut area);
            }
            most(
                from.above,
                least(to.above, from.above + area[0] * self.share_per_area),
            )
        };
        let start = if left >= 0.0 { from.above } else { share_up_to(0.0) };
        let end = if right <= width {
            to.above
        } else {
            share_up_to(width)
        };
        let ends = &mut shares.ends[..count];
        let changes = &mut shares.changes[..count + 2];
        changes.fill(0.0);
        let border = first as f64;
        for piece in &pieces {
            Piece {
                low: piece.low - border,
                high: piece.high - border,
                ..*piece
            }
            .add_changes(changes);
        }
        let (mut covered, mut share) = (0.0, start);
        for (end_here, change) in ends.iter_mut().zip(changes) {
            covered += *change;
            share = least(end, share + most(0.0, covered * self.share_per_area));
            *end_here = share;
        }
        ends[count - 1] = end;
        Some(Span {
            first: self.origin + first,
            start,
            ends,
        })
    }
}
