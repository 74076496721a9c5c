//! The shape of a triangle in texel space: with area, a line, or a point.

use std::ops::Range;

use glam::DVec2;

use super::area::Area;
use super::line::Line;
use super::row::{RowShares, Sink, Span};

/// Triangles with a smaller height over their longest side [texels] are lines: the rounding of their borders would
/// reach 10⁻⁹ of their flux, and no texel is that fine.
const LINE_HEIGHT_TEXELS: f64 = 1e-6;

/// Triangles that extend farther [texels] leave less than 10⁻¹⁴ of their flux on any map.
const FARTHEST_TEXELS: f64 = 1e18;

/// A triangle, prepared for one map.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A corner is not finite.
    NonFinite,
    /// No part of it is on the map.
    Outside,
    /// Entirely within one texel: column, row.
    Texel(usize, usize),
    /// A triangle with area, and its rows on the map.
    Area(Area, Range<usize>),
    /// A degenerate triangle, and its rows on the map.
    Line(Line, Range<usize>),
}

/// Bounding box of a triangle [texels].
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: DVec2,
    high: DVec2,
}

impl Bounds {
    #[inline(always)]
    fn new([a, b, c]: [DVec2; 3]) -> Self {
        let low = |a, b, c| least(least(a, b), c);
        let high = |a, b, c| most(most(a, b), c);
        Self {
            low: DVec2::new(low(a.x, b.x, c.x), low(a.y, b.y, c.y)),
            high: DVec2::new(high(a.x, b.x, c.x), high(a.y, b.y, c.y)),
        }
    }

    fn misses(&self, (width, height): (usize, usize)) -> bool {
        self.high.x < 0.0 || self.high.y < 0.0 || self.low.x > width as f64 || self.low.y > height as f64
    }

    /// The only texel that it reaches; `None` if there are several.
    fn texel(&self, (width, height): (usize, usize)) -> Option<(usize, usize)> {
        let (column, row) = (self.low.x as i32, self.low.y as i32);
        let (left, top) = (f64::from(column), f64::from(row));
        let (column, row) = (column as usize, row as usize);
        let inside = self.low.x >= most(left, 0.0)
            && self.low.y >= most(top, 0.0)
            && self.high.x <= left + 1.0
            && self.high.y <= top + 1.0
            && column < width
            && row < height;
        inside.then_some((column, row))
    }
}

impl Shape {
    /// Prepares a triangle for a map of `size` texels across and down.
    #[inline(always)]
    pub fn new(corners: &[DVec2; 3], size: (usize, usize)) -> Self {
        if !is_finite(corners) {
            return Self::NonFinite;
        }
        let bounds = Bounds::new(*corners);
        if bounds.misses(size) || size.0 == 0 || size.1 == 0 {
            return Self::Outside;
        }
        if let Some((column, row)) = bounds.texel(size) {
            return Self::Texel(column, row);
        }
        if bounds.low.min_element() < -FARTHEST_TEXELS || bounds.high.max_element() > FARTHEST_TEXELS {
            return Self::Outside;
        }
        let twice_area = (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
        let extent = bounds.high - bounds.low;
        if twice_area * twice_area <= LINE_HEIGHT_TEXELS * LINE_HEIGHT_TEXELS * extent.length_squared() {
            return Self::Line(
                Line::new(*corners, size.0),
                cells(bounds.low.y, bounds.high.y, size.1),
            );
        }
        let columns = cells(bounds.low.x, bounds.high.x, size.0);
        let crosses_border = bounds.low.x < 0.0 || bounds.high.x > size.0 as f64;
        let rows = cells(bounds.low.y, bounds.high.y, size.1);
        Self::Area(Area::new(corners, columns, crosses_border), rows)
    }

    /// Rows of the map that it reaches.
    pub fn rows(&self) -> Range<usize> {
        match self {
            Self::NonFinite | Self::Outside => 0..0,
            Self::Texel(_, row) => *row..*row + 1,
            Self::Area(_, rows) | Self::Line(_, rows) => rows.clone(),
        }
    }

    /// Passes the shares of some rows, all within [`Shape::rows`], to a sink.
    #[inline(always)]
    pub fn for_each_row(&self, rows: Range<usize>, shares: &mut RowShares, sink: &mut impl Sink) {
        match self {
            Self::NonFinite | Self::Outside => {}
            Self::Texel(column, _) => {
                let whole = Span {
                    first: *column,
                    start: 0.0,
                    ends: &[1.0],
                };
                rows.for_each(|row| sink.add(row, whole));
            }
            Self::Area(area, _) => area.for_each_row(rows, shares, sink),
            Self::Line(line, _) => {
                for row in rows {
                    if let Some(span) = line.span(row, shares) {
                        sink.add(row, span);
                    }
                }
            }
        }
    }
}

/// Whether all corners are finite.
#[inline(always)]
pub fn is_finite([a, b, c]: &[DVec2; 3]) -> bool {
    // Zero times a non-finite number is NaN, and so is any sum with it.
    let sum = *a * 0.0 + *b * 0.0 + *c * 0.0;
    sum.x + sum.y == 0.0
}

/// Rows and columns that a triangle may reach on a map: at least [`Shape::rows`].
#[inline(always)]
pub fn rows_and_columns(corners: &[DVec2; 3], size: (usize, usize)) -> (Range<usize>, Range<usize>) {
    let bounds = Bounds::new(*corners);
    if bounds.misses(size) || size.0 == 0 || size.1 == 0 {
        return (0..0, 0..0);
    }
    (
        cells(bounds.low.y, bounds.high.y, size.1),
        cells(bounds.low.x, bounds.high.x, size.0),
    )
}

/// The smaller number; the second one if they do not compare.
#[inline(always)]
pub fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger number; the second one if they do not compare.
#[inline(always)]
pub fn most(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Rows (or columns) of a map of `count` that the interval `low..=high` reaches; that of `low` for a point.
#[inline(always)]
pub fn cells(low: f64, high: f64, count: usize) -> Range<usize> {
    // Casts from doubles saturate below 2³¹; what lies on the last border belongs to the last cell.
    let count = i32::try_from(count).unwrap_or(i32::MAX);
    let first = (most(0.0, low) as i32).min(count - 1);
    let last = most(0.0, high) as i32;
    let end = if high > f64::from(last) {
        last.saturating_add(1)
    } else {
        last
    };
    first as usize..end.min(count).max(first + 1) as usize
}

/// Fraction of a triangle's flux below a fraction `t` of its extent along a direction, with the middle corner at the
/// fraction `middle`: the integral of a tent. Increases with `t`.
pub fn tent(t: f64, middle: f64) -> f64 {
    if t <= 0.0 {
        0.0
    } else if t >= 1.0 {
        1.0
    } else if t < middle {
        (t * t / middle).min(middle)
    } else {
        (1.0 - (1.0 - t) * (1.0 - t) / (1.0 - middle)).max(middle)
    }
}
