//! Degenerate triangles: their flux lies along a line, as a tent.

use glam::DVec2;

use super::row::{RowShares, Span};
use super::shape::{cells, tent};

/// A degenerate triangle along its longest side.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Upper end.
    from: DVec2,
    /// Vector to the lower end.
    way: DVec2,
    /// Position of the middle corner, as a fraction of the side.
    middle: f64,
    /// Columns of the map.
    width: usize,
}

impl Line {
    pub fn new([a, b, c]: [DVec2; 3], width: usize) -> Self {
        let sides = [(a, b, c), (b, c, a), (c, a, b)];
        let [mut longest, rest @ ..] = sides;
        for side in rest {
            if side.0.distance_squared(side.1) > longest.0.distance_squared(longest.1) {
                longest = side;
            }
        }
        let (mut from, mut to, middle) = longest;
        if to.y < from.y {
            std::mem::swap(&mut from, &mut to);
        }
        let way = to - from;
        let middle = (middle - from).dot(way) / way.length_squared();
        Self {
            from,
            way,
            // NaN for a point, where it does not matter.
            middle: if middle.is_nan() {
                0.0
            } else {
                middle.clamp(0.0, 1.0)
            },
            width,
        }
    }

    /// Fractions of the side at which a row begins and ends.
    fn part_in_row(&self, row: usize) -> (f64, f64) {
        if self.way.y == 0.0 {
            return (0.0, 1.0);
        }
        let at = |y: f64| ((y - self.from.y) / self.way.y).clamp(0.0, 1.0);
        (at(row as f64), at((row + 1) as f64))
    }

    /// The shares of one of the line's rows; `None` where it misses the map.
    pub fn span<'a>(&self, row: usize, shares: &'a mut RowShares) -> Option<Span<'a>> {
        // The part of the line within the row, from its left to its right end.
        let width = self.width;
        let (from, to) = self.part_in_row(row);
        let x_at = |t: f64| self.from.x + t * self.way.x;
        let (left, right) = (x_at(from).min(x_at(to)), x_at(from).max(x_at(to)));
        if right < 0.0 || left > width as f64 {
            return None;
        }

        // The flux along the line is a tent with its peak at the middle corner: shares are its integral.
        let (before, after) = (tent(from, self.middle), tent(to, self.middle));
        let columns = cells(left, right, width);
        let up_to = |column: usize| {
            let t = ((column as f64 - self.from.x) / self.way.x).clamp(from, to);
            let along = tent(if t.is_nan() { to } else { t }, self.middle);
            // A line that runs to the left passes its borders in reverse order.
            let share = if self.way.x < 0.0 {
                before + (after - along)
            } else {
                along
            };
            share.clamp(before, after)
        };

        // Borders beyond the ends have the exact shares of these, so that no flux is lost between rows.
        let first = columns.start;
        let start = if left >= first as f64 {
            before
        } else {
            up_to(first)
        };
        let ends = &mut shares.ends[..columns.len()];
        for (column, end) in columns.zip(&mut *ends) {
            let whole = right <= (column + 1) as f64;
            *end = if whole { after } else { up_to(column + 1) };
        }
        Some(Span { first, start, ends })
    }
}
