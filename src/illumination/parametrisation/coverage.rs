//! The part of a triangle under each texel: exact, by clipping.

use glam::DVec2;

/// A triangle clipped by the four sides of a texel has at most 3 + 4 corners.
const MAX_CORNERS: usize = 7;

/// A convex polygon in texel coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Polygon {
    corners: [DVec2; MAX_CORNERS],
    len: usize,
}

/// The side of a line that clipping keeps.
#[derive(Clone, Copy)]
enum Keep {
    Above,
    Below,
}

impl Polygon {
    /// A triangle of either winding.
    pub fn triangle(corners: [DVec2; 3]) -> Self {
        let mut polygon = Self {
            corners: [DVec2::ZERO; MAX_CORNERS],
            len: 3,
        };
        polygon.corners[..3].copy_from_slice(&corners);
        polygon
    }

    pub fn corners(&self) -> &[DVec2] {
        &self.corners[..self.len]
    }

    /// Area [texel²], not negative.
    pub fn area(&self) -> f64 {
        convex_area(self.corners())
    }

    /// Centroid; the mean of the corners if the area is zero.
    pub fn centroid(&self) -> DVec2 {
        let corners = self.corners();
        let first = corners.first().copied().unwrap_or_default();
        let (mut sum, mut twice) = (DVec2::ZERO, 0.0);
        for pair in corners.windows(2) {
            let part = (pair[0] - first).perp_dot(pair[1] - first);
            sum += (pair[0] + pair[1] + first) * (part / 3.0);
            twice += part;
        }
        if twice == 0.0 {
            corners.iter().sum::<DVec2>() / corners.len().max(1) as f64
        } else {
            sum / twice
        }
    }

    /// Whether a point lies inside or on the border.
    pub fn contains(&self, point: DVec2) -> bool {
        let corners = self.corners();
        let (mut left, mut right) = (false, false);
        for (index, &corner) in corners.iter().enumerate() {
            let next = corners[(index + 1) % corners.len()];
            let side = (next - corner).perp_dot(point - corner);
            left |= side > 0.0;
            right |= side < 0.0;
        }
        !(left && right)
    }

    /// The part with `low` ≤ coordinate ≤ `high` on an axis (0: x, 1: y).
    #[must_use]
    pub fn clipped(&self, axis: usize, low: f64, high: f64) -> Self {
        self.halved(axis, low, Keep::Above)
            .halved(axis, high, Keep::Below)
    }

    /// One step of Sutherland and Hodgman's clipping. New corners lie exactly on the line, so that neighbouring cells
    /// share them.
    fn halved(&self, axis: usize, line: f64, keep: Keep) -> Self {
        let distance = |corner: DVec2| match keep {
            Keep::Above => corner[axis] - line,
            Keep::Below => line - corner[axis],
        };
        let mut kept = Self {
            corners: [DVec2::ZERO; MAX_CORNERS],
            len: 0,
        };
        let corners = self.corners();
        for (index, &corner) in corners.iter().enumerate() {
            let next = corners[(index + 1) % corners.len()];
            let (here, there) = (distance(corner), distance(next));
            if here >= 0.0 {
                kept.push(corner);
            }
            if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
                let mut cut = corner + (next - corner) * (here / (here - there));
                cut[axis] = line;
                kept.push(cut);
            }
        }
        kept
    }

    fn push(&mut self, corner: DVec2) {
        // A convex polygon gains at most one corner per line; rounding may repeat a corner, which adds no area.
        if self.len < MAX_CORNERS {
            self.corners[self.len] = corner;
            self.len += 1;
        }
    }

    /// Range of coordinates on an axis.
    pub(super) fn range(&self, axis: usize) -> (f64, f64) {
        self.corners()
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), corner| {
                (low.min(corner[axis]), high.max(corner[axis]))
            })
    }
}

/// Area of a convex polygon, not negative.
pub fn convex_area(corners: &[DVec2]) -> f64 {
    let Some(&first) = corners.first() else { return 0.0 };
    let twice: f64 = corners
        .windows(2)
        .map(|pair| (pair[0] - first).perp_dot(pair[1] - first))
        .sum();
    0.5 * twice.abs()
}

/// Unit cells, out of `count` in a row, that an interval within 0..=count overlaps.
pub fn cells(low: f64, high: f64, count: usize) -> std::ops::Range<usize> {
    if high.is_nan() || low.is_nan() || high < low {
        return 0..0;
    }
    let first = (low.floor().max(0.0) as usize).min(count);
    let end = (high.ceil().max(0.0) as usize).min(count);
    first..end.max((first + 1).min(count))
}

/// Rows that a triangle overlaps.
pub fn rows(corners: [DVec2; 3], height: usize) -> std::ops::Range<usize> {
    let (low, high) = Polygon::triangle(corners).range(1);
    cells(low, high, height)
}

/// Visits the texels of a row that a triangle covers: column, and covered part of the texel.
pub fn for_each_texel_in_row(
    corners: [DVec2; 3],
    row: usize,
    width: usize,
    mut visit: impl FnMut(usize, &Polygon),
) {
    let (top, bottom) = (row as f64, row as f64 + 1.0);
    let strip = Polygon::triangle(corners).clipped(1, top, bottom);
    if strip.len < 3 {
        return;
    }
    let whole = whole_columns(&strip, top, bottom);
    let (left, right) = strip.range(0);
    for column in cells(left, right, width) {
        let x = column as f64;
        let part = if whole.0 <= x && x + 1.0 <= whole.1 {
            unit_square(x, top)
        } else {
            strip.clipped(0, x, x + 1.0)
        };
        if part.area() > 0.0 {
            visit(column, &part);
        }
    }
}

/// Interval of x in which a convex strip spans from `top` to `bottom`, or an empty one. By convexity, what lies within
/// the strip at both ends lies within it in between.
fn whole_columns(strip: &Polygon, top: f64, bottom: f64) -> (f64, f64) {
    let mut whole = (f64::NEG_INFINITY, f64::INFINITY);
    for line in [top, bottom] {
        let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
        for corner in strip.corners().iter().filter(|corner| corner.y == line) {
            left = left.min(corner.x);
            right = right.max(corner.x);
        }
        whole = (whole.0.max(left), whole.1.min(right));
    }
    whole
}

fn unit_square(x: f64, y: f64) -> Polygon {
    let mut square = Polygon {
        corners: [DVec2::ZERO; MAX_CORNERS],
        len: 4,
    };
    square.corners[..4].copy_from_slice(&[
        DVec2::new(x, y),
        DVec2::new(x + 1.0, y),
        DVec2::new(x + 1.0, y + 1.0),
        DVec2::new(x, y + 1.0),
    ]);
    square
}

/// Twice the signed area of a triangle.
pub fn twice_signed_area([a, b, c]: [DVec2; 3]) -> f64 {
    (b - a).perp_dot(c - a)
}
