//! Triangles that have area: their part in each texel of a row, from the areas beside their sides.

use glam::DVec2;

use super::row::{RowShares, Span};
use super::shape::{cells, least, most};

/// Sides less high than this [texels] are level: they bound no area.
const LEVEL_TEXELS: f64 = 1e-30;

/// Rows of up to this many texels are quicker border by border than piece by piece.
const NARROW: usize = 4;

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
    /// Columns from there to the map's right border.
    width: usize,
    height: usize,
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

/// Part of a side within a row.
#[derive(Clone, Copy)]
struct Piece {
    low: f64,
    high: f64,
    height: f64,
}

impl Side {
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

    fn x_at(&self, y: f64) -> f64 {
        let x = self.start.x + (y - self.start.y) * self.slope;
        most(self.low, least(self.high, x))
    }
}

impl Piece {
    fn new(a: f64, b: f64, height: f64) -> Self {
        Self {
            low: least(a, b),
            high: most(a, b),
            height,
        }
    }

    /// Area to its right up to each of the borders after `first`.
    fn add_areas(&self, first: f64, sign: f64, areas: &mut [f64]) {
        let run = self.high - self.low;
        // No area where there is no run; anything finite will do as a factor.
        let per_square = 0.5 * self.height / most(run, f64::MIN_POSITIVE);
        let (per_square, height) = (sign * per_square, sign * self.height);
        for (column, area) in areas.iter_mut().enumerate() {
            let x = first + column as f64 - self.low;
            let within = most(0.0, least(run, x));
            *area += per_square * within * within + height * most(0.0, x - run);
        }
    }

    /// The part with x from 0 to `width`; what lies further left moves to 0.
    fn clipped(&self, width: f64, changes: &mut [f64]) -> Option<Self> {
        let Self { low, high, height } = *self;
        if low >= 0.0 && high <= width {
            return Some(*self);
        }
        if high <= 0.0 {
            changes[0] += height;
            return None;
        }
        if low >= width {
            return None;
        }
        let per_x = height / (high - low);
        if low < 0.0 {
            changes[0] -= low * per_x;
        }
        let (low, high) = (most(low, 0.0), least(high, width));
        Some(Self {
            low,
            high,
            height: (high - low) * per_x,
        })
    }

    /// Adds, for each column, by how much more of it lies to the right of the piece than of the column before; x
    /// counts from the first column.
    fn add_changes(&self, changes: &mut [f64]) {
        let Self { low, high, height } = *self;
        let (first, last) = (low as i32 as usize, high as i32 as usize);
        if first == last {
            let covered = height * ((first + 1) as f64 - 0.5 * (low + high));
            changes[first] += covered;
            changes[first + 1] += height - covered;
            return;
        }
        let per_square = 0.5 * height / (high - low);
        let (mut area, mut covered) = (0.0, 0.0);
        for (column, change) in changes[first..last].iter_mut().enumerate() {
            let reach = (first + column + 1) as f64 - low;
            let area_here = per_square * reach * reach;
            let covered_here = area_here - area;
            *change += covered_here - covered;
            (area, covered) = (area_here, covered_here);
        }
        let covered_last = height * ((last + 1) as f64 - 0.5 * (low + high)) - area;
        changes[last] += covered_last - covered;
        changes[last + 1] += height - covered_last;
    }
}

impl Area {
    pub fn new(corners: &[DVec2; 3], left: f64, size: (usize, usize)) -> Self {
        let origin = most(0.0, left) as i32;
        let [a, b, c] = corners.map(|corner| corner.y);
        let order = ORDERS[usize::from(a > b) | usize::from(b > c) << 1 | usize::from(a > c) << 2];
        let [a, b, c] = order.map(|corner| corners[corner] - DVec2::new(f64::from(origin), 0.0));
        let per_height = 1.0 / (c.y - a.y);
        Self {
            origin: origin as usize,
            width: size.0.saturating_sub(origin as usize),
            height: size.1,
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

    pub fn rows(&self) -> std::ops::Range<usize> {
        cells(self.top, self.bottom, self.height)
    }

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

    /// Gives the shares of each of some rows, all within [`Area::rows`].
    pub fn for_each_row(
        &self,
        rows: std::ops::Range<usize>,
        shares: &mut RowShares,
        mut visit: impl FnMut(usize, Span),
    ) {
        let mut from = self.cut(rows.start as f64);
        for row in rows {
            let to = self.cut((row + 1) as f64);
            if let Some(span) = self.span(&from, &to, shares) {
                visit(row, span);
            }
            from = to;
        }
    }

    /// The row between two cuts.
    fn span<'a>(&self, from: &Cut, to: &Cut, shares: &'a mut RowShares) -> Option<Span<'a>> {
        let turn = if from.y < self.middle.y && self.middle.y < to.y {
            self.middle
        } else {
            DVec2::new(to.short, to.y)
        };
        let pieces = [
            Piece::new(from.long, to.long, to.y - from.y),
            Piece::new(from.short, turn.x, turn.y - from.y),
            Piece::new(turn.x, to.short, to.y - turn.y),
        ];
        let left = least(least(pieces[0].low, pieces[1].low), pieces[2].low);
        let right = most(most(pieces[0].high, pieces[1].high), pieces[2].high);
        let width = self.width as f64;
        if right <= 0.0 || left >= width {
            return None;
        }
        let columns = cells(left, right, self.width);
        let (first, count) = (columns.start, columns.len());
        let border = first as f64;
        let share_up_to = |x: f64| {
            let mut area = [0.0];
            for (piece, sign) in pieces.iter().zip([1.0, -1.0, -1.0]) {
                piece.add_areas(x, sign, &mut area);
            }
            most(
                from.above,
                least(to.above, from.above + area[0] * self.share_per_area),
            )
        };
        let start = if left >= border {
            from.above
        } else {
            share_up_to(border)
        };
        let end = if right <= width {
            to.above
        } else {
            share_up_to(width)
        };
        let ends = &mut shares.ends[..count];
        if count > NARROW {
            self.fill_wide(
                &pieces,
                border,
                &mut shares.changes[..count + 2],
                ends,
                (start, end),
            );
        } else if count > 1 {
            self.fill_narrow(&pieces, border, ends, (from.above, start, end));
        }
        ends[count - 1] = end;
        Some(Span {
            first: self.origin + first,
            start,
            ends,
        })
    }

    /// Cumulative shares up to each border between a few columns.
    fn fill_narrow(
        &self,
        pieces: &[Piece; 3],
        border: f64,
        ends: &mut [f64],
        (above, start, end): (f64, f64, f64),
    ) {
        ends.fill(0.0);
        for (piece, sign) in pieces.iter().zip([1.0, -1.0, -1.0]) {
            piece.add_areas(border + 1.0, sign, ends);
        }
        let mut before = start;
        for share in ends {
            before = most(before, least(end, above + *share * self.share_per_area));
            *share = before;
        }
    }

    /// The same for many columns.
    fn fill_wide(
        &self,
        pieces: &[Piece; 3],
        border: f64,
        changes: &mut [f64],
        ends: &mut [f64],
        (start, end): (f64, f64),
    ) {
        // A piece that ends on the last border leaves its change behind it.
        changes.fill(0.0);
        for (piece, sign) in pieces.iter().zip([1.0, -1.0, -1.0]) {
            let moved = Piece {
                low: piece.low - border,
                high: piece.high - border,
                height: sign * piece.height,
            };
            if let Some(moved) = moved.clipped(ends.len() as f64, changes) {
                moved.add_changes(changes);
            }
        }
        let (mut covered, mut share) = (0.0, start);
        for (end_here, change) in ends.iter_mut().zip(changes) {
            covered += *change;
            share = least(end, share + most(0.0, covered * self.share_per_area));
            *end_here = share;
        }
    }
}
