//! How a triangle meets the map.

use glam::DVec2;

use super::area::Area;
use super::line::Line;
use super::row::RowShares;

/// Triangles less high than this over their longest side [texels] are lines: the rounding of their borders would be as
/// much as 10⁻⁹ of their flux, and no texel is that fine.
const LINE_HEIGHT_TEXELS: f64 = 1e-6;

/// Triangles that reach further than this [texels] leave less than 10⁻¹⁴ of their flux on any map.
const FARTHEST_TEXELS: f64 = 1e18;

/// A triangle, made ready for one map.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// A corner is not finite.
    NonFinite,
    /// No part of it on the map.
    Outside,
    /// Wholly within one texel: column, row.
    Texel(usize, usize),
    /// A triangle that has area.
    Area(Area),
    /// A triangle without.
    Line(Line),
}

/// Borders of a triangle, and those rows of the map that it reaches.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: DVec2,
    high: DVec2,
}

impl Bounds {
    fn new([a, b, c]: [DVec2; 3]) -> Self {
        Self {
            low: a.min(b).min(c),
            high: a.max(b).max(c),
        }
    }

    fn misses(&self, (width, height): (usize, usize)) -> bool {
        self.high.x < 0.0 || self.high.y < 0.0 || self.low.x > width as f64 || self.low.y > height as f64
    }

    /// The only texel, if there is but one.
    fn texel(&self, (width, height): (usize, usize)) -> Option<(usize, usize)> {
        // Negative coordinates become 0 here, and fail the test below.
        let (column, row) = (self.low.x as usize, self.low.y as usize);
        let (left, top) = (column as f64, row as f64);
        let inside = self.low.x >= left
            && self.low.y >= top
            && self.high.x <= left + 1.0
            && self.high.y <= top + 1.0
            && column < width
            && row < height;
        inside.then_some((column, row))
    }
}

impl Shape {
    /// Prepares a triangle for a map of `size` texels across and down.
    pub fn new(corners: [DVec2; 3], size: (usize, usize)) -> Self {
        if corners.iter().any(|corner| !corner.is_finite()) {
            return Self::NonFinite;
        }
        let bounds = Bounds::new(corners);
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
            return Self::Line(Line::new(corners, size));
        }
        Self::Area(Area::new(corners, twice_area, bounds.low.x, size))
    }

    /// Rows of the map that it reaches.
    pub fn rows(&self) -> std::ops::Range<usize> {
        match self {
            Self::NonFinite | Self::Outside => 0..0,
            Self::Texel(_, row) => *row..*row + 1,
            Self::Area(area) => area.rows(),
            Self::Line(line) => line.rows(),
        }
    }

    /// The shares of the texels of a row within [`Shape::rows`].
    pub fn fill_row(&self, row: usize, shares: &mut RowShares) {
        shares.ends.clear();
        shares.first = 0;
        match self {
            Self::NonFinite | Self::Outside => {}
            Self::Texel(column, _) => {
                shares.first = *column;
                shares.start = 0.0;
                shares.ends.push(1.0);
            }
            Self::Area(area) => area.fill_row(row, shares),
            Self::Line(line) => line.fill_row(row, shares),
        }
    }
}

/// Rows (columns) of a map of `count` that the interval `low..=high` reaches; that of `low` where it is a point.
pub fn cells(low: f64, high: f64, count: usize) -> std::ops::Range<usize> {
    // Casts cut to 0..; what lies on the last border belongs to the last cell.
    let first = (low as usize).min(count.saturating_sub(1));
    let last = (high as usize).min(count);
    let end = if high > last as f64 { last + 1 } else { last };
    first..end.min(count).max(first + 1)
}

/// The part of a triangle's flux below a fraction `t` of its extent along a direction, where the middle corner is at
/// the fraction `middle`: half a tent each side of it. Rises with `t`.
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
