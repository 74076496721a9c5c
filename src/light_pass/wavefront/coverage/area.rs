//! Triangles that have area: their part in each texel of a row, from the signed areas beside their borders.

use glam::DVec2;

use super::row::RowShares;
use super::shape::{cells, tent};

/// Sides less high than this [texels] are level: they bound no area.
const LEVEL_TEXELS: f64 = 1e-30;

/// A triangle that has area, in coordinates relative to the map's first column that it reaches, where they are more
/// precise.
#[derive(Clone, Copy, Debug)]
pub struct Area {
    /// Column that x = 0 stands for.
    origin: usize,
    /// Columns from there to the map's right border.
    width: usize,
    height: usize,
    top: f64,
    middle: f64,
    bottom: f64,
    /// From the top to the bottom corner.
    long: Side,
    /// From the top to the middle corner.
    upper: Side,
    /// From the middle to the bottom corner.
    lower: Side,
    /// What an area to the right of the long side, less that to the right of the others, is of the whole.
    share_per_area: f64,
}

/// A side of the triangle: x as a function of y.
#[derive(Clone, Copy, Debug)]
struct Side {
    start: DVec2,
    slope: f64,
    low: f64,
    high: f64,
}

/// Part of a side within a row.
#[derive(Clone, Copy)]
struct Piece {
    /// x at either end.
    x: (f64, f64),
    /// Height, negative for the sides opposite to the long one.
    height: f64,
}

impl Side {
    fn new(start: DVec2, end: DVec2) -> Self {
        let way = end - start;
        Self {
            start,
            slope: if way.y > LEVEL_TEXELS { way.x / way.y } else { 0.0 },
            low: start.x.min(end.x),
            high: start.x.max(end.x),
        }
    }

    fn x_at(&self, y: f64) -> f64 {
        (self.start.x + (y - self.start.y) * self.slope).clamp(self.low, self.high)
    }

    fn piece(&self, from: f64, to: f64, sign: f64) -> Piece {
        let (a, b) = (self.x_at(from), self.x_at(to));
        Piece {
            x: (a.min(b), a.max(b)),
            height: sign * (to - from),
        }
    }
}

impl Piece {
    /// Area to its right, up to the border `x`.
    fn area_up_to(&self, x: f64) -> f64 {
        let (low, high) = self.x;
        if x >= high {
            self.height * (x - 0.5 * (low + high))
        } else if x <= low {
            0.0
        } else {
            0.5 * self.height * (x - low) * ((x - low) / (high - low))
        }
    }

    /// The part with x from 0 to `width`; what lies further left moves to 0.
    fn clipped(&self, width: f64, changes: &mut [f64]) -> Option<Self> {
        let (low, high) = self.x;
        if low >= 0.0 && high <= width {
            return Some(*self);
        }
        if high <= 0.0 {
            changes[0] += self.height;
            return None;
        }
        if low >= width {
            return None;
        }
        let per_x = self.height / (high - low);
        if low < 0.0 {
            changes[0] -= low * per_x;
        }
        let (low, high) = (low.max(0.0), high.min(width));
        Some(Self {
            x: (low, high),
            height: (high - low) * per_x,
        })
    }

    /// Adds, for each column, by how much more of it lies to the right of the piece than of the column before; x
    /// counts from the first column.
    fn add_changes(&self, changes: &mut [f64]) {
        let (low, high) = self.x;
        let (first, last) = (low as usize, high as usize);
        if first == last {
            let covered = self.height * ((first + 1) as f64 - 0.5 * (low + high));
            changes[first] += covered;
            changes[first + 1] += self.height - covered;
            return;
        }
        let per_square = 0.5 * self.height / (high - low);
        let (mut area, mut covered) = (0.0, 0.0);
        for (column, change) in changes[first..last].iter_mut().enumerate() {
            let reach = (first + column + 1) as f64 - low;
            let area_here = per_square * reach * reach;
            let covered_here = area_here - area;
            *change += covered_here - covered;
            (area, covered) = (area_here, covered_here);
        }
        let covered_last = self.height * ((last + 1) as f64 - 0.5 * (low + high)) - area;
        changes[last] += covered_last - covered;
        changes[last + 1] += self.height - covered_last;
    }
}

impl Area {
    pub fn new(corners: [DVec2; 3], twice_area: f64, left: f64, size: (usize, usize)) -> Self {
        let origin = (left as usize).min(size.0);
        let [mut a, mut b, mut c] = corners.map(|corner| DVec2::new(corner.x - origin as f64, corner.y));
        let mut twice_area = twice_area;
        for (first, second) in [(0, 1), (1, 2), (0, 1)] {
            let sorted = [&mut a, &mut b, &mut c];
            if sorted[second].y < sorted[first].y {
                let [a, b, c] = sorted;
                if (first, second) == (0, 1) {
                    std::mem::swap(a, b);
                } else {
                    std::mem::swap(b, c);
                }
                twice_area = -twice_area;
            }
        }
        Self {
            origin,
            width: size.0 - origin,
            height: size.1,
            top: a.y,
            middle: b.y,
            bottom: c.y,
            long: Side::new(a, c),
            upper: Side::new(a, b),
            lower: Side::new(b, c),
            share_per_area: 2.0 / twice_area,
        }
    }

    pub fn rows(&self) -> std::ops::Range<usize> {
        cells(self.top, self.bottom, self.height)
    }

    /// The part of the triangle above a height.
    fn share_above(&self, y: f64) -> f64 {
        let whole = self.bottom - self.top;
        tent((y - self.top) / whole, (self.middle - self.top) / whole)
    }

    /// The pieces of its sides within a row: of the long side, the upper and the lower one.
    fn pieces(&self, row: usize) -> ([Piece; 3], usize) {
        let from = self.top.max(row as f64);
        let to = self.bottom.min((row + 1) as f64);
        let mut pieces = [self.long.piece(from, to, 1.0); 3];
        let mut count = 1;
        if from < self.middle {
            pieces[count] = self.upper.piece(from, to.min(self.middle), -1.0);
            count += 1;
        }
        if to > self.middle {
            pieces[count] = self.lower.piece(from.max(self.middle), to, -1.0);
            count += 1;
        }
        (pieces, count)
    }

    pub fn fill_row(&self, row: usize, shares: &mut RowShares) {
        let above = self.share_above(row as f64);
        let below = self.share_above((row + 1) as f64);
        let (pieces, count) = self.pieces(row);
        let pieces = &pieces[..count];
        let left = pieces.iter().map(|piece| piece.x.0).fold(f64::INFINITY, f64::min);
        let right = pieces
            .iter()
            .map(|piece| piece.x.1)
            .fold(f64::NEG_INFINITY, f64::max);
        if right <= 0.0 || left >= self.width as f64 {
            return;
        }
        let columns = cells(left, right, self.width);
        let (first, count) = (columns.start, columns.len());
        shares.first = self.origin + first;
        // The border before the first column, from which the pieces count now.
        let border = first as f64;
        let share_up_to = |x: f64| {
            let area: f64 = pieces.iter().map(|piece| piece.area_up_to(x)).sum();
            (above + area * self.share_per_area).clamp(above, below)
        };
        shares.start = if left >= border {
            above
        } else {
            share_up_to(border)
        };
        let ends_here = right <= columns.end as f64;
        let end = if ends_here {
            below
        } else {
            share_up_to(columns.end as f64)
        };
        if count > 1 {
            self.fill_columns(pieces, border, count, shares, end);
        } else {
            shares.ends.push(end);
        }
    }

    /// Cumulative shares of several columns from `border` on, the last of which ends with the share `end`.
    fn fill_columns(&self, pieces: &[Piece], border: f64, count: usize, shares: &mut RowShares, end: f64) {
        // A piece that ends on the last border leaves its change behind it.
        shares.changes.clear();
        shares.changes.resize(count + 2, 0.0);
        for piece in pieces {
            let moved = Piece {
                x: (piece.x.0 - border, piece.x.1 - border),
                ..*piece
            };
            if let Some(moved) = moved.clipped(count as f64, &mut shares.changes) {
                moved.add_changes(&mut shares.changes);
            }
        }
        let (mut covered, mut share) = (0.0, shares.start);
        for change in &shares.changes[..count - 1] {
            covered += change;
            share = (share + (covered * self.share_per_area).max(0.0)).min(end);
            shares.ends.push(share);
        }
        shares.ends.push(end);
    }
}
