//! Whether triangles in the plane lie on top of each other.

use glam::DVec2;

use super::coverage::{cells, rows, twice_signed_area};

/// Distance from an edge, in units of the map's side, up to which a point counts as on the border: neighbours share
/// borders, and files store coordinates in single precision.
const BORDER: f64 = 1e-6;

/// Share of the covered samples that may be covered twice before a set counts as overlapping.
const ALLOWED_SHARE: f64 = 1e-4;

/// Whether triangles within the unit square overlap beyond their borders.
///
/// One sample in each cell of a raster that is finer than the mean triangle; `least_side` bounds the raster's side
/// from below. Overlaps far smaller than a cell go unseen: no map can show them either.
pub fn overlaps(triangles: &[[DVec2; 3]], least_side: usize) -> bool {
    let side = (8.0 * (triangles.len() as f64).sqrt()) as usize;
    let side = side.clamp(least_side, least_side.max(2048));
    let mut hits = vec![0u8; side * side];
    for &triangle in triangles {
        mark(triangle, side, &mut hits);
    }
    let covered = hits.iter().filter(|&&count| count > 0).count();
    let twice = hits.iter().filter(|&&count| count > 1).count();
    twice as f64 > ALLOWED_SHARE * covered as f64
}

fn mark(triangle: [DVec2; 3], side: usize, hits: &mut [u8]) {
    let scale = side as f64;
    let winding = twice_signed_area(triangle).signum();
    // Inside is where all three signed distances from the edges are above the border's width.
    let edges = [0, 1, 2].map(|i| {
        let (from, to) = (triangle[i], triangle[(i + 1) % 3]);
        let along = (to - from).normalize_or_zero() * winding;
        (from, along)
    });
    let scaled = triangle.map(|corner| corner * scale);
    for row in rows(scaled, side) {
        let (left, right) = span(&scaled, row as f64, row as f64 + 1.0);
        for column in cells(left, right, side) {
            let sample = (DVec2::new(column as f64, row as f64) + jitter(column, row)) / scale;
            if edges
                .iter()
                .all(|(from, along)| along.perp_dot(sample - *from) > BORDER)
            {
                let hit = &mut hits[row * side + column];
                *hit = hit.saturating_add(1);
            }
        }
    }
}

/// Columns that a triangle can reach between two horizontal lines.
fn span(triangle: &[DVec2; 3], top: f64, bottom: f64) -> (f64, f64) {
    let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut reach = |x: f64| {
        left = left.min(x);
        right = right.max(x);
    };
    for i in 0..3 {
        let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
        if (top..=bottom).contains(&a.y) {
            reach(a.x);
        }
        for line in [top, bottom] {
            if (a.y < line) != (b.y < line) {
                reach(a.x + (b.x - a.x) * ((line - a.y) / (b.y - a.y)));
            }
        }
    }
    (left, right)
}

/// Place of a cell's sample within it: the R2 sequence's two irrational steps, so that samples fall on no line of a
/// regular unwrapping.
fn jitter(column: usize, row: usize) -> DVec2 {
    let (x, y) = (column as f64, row as f64);
    DVec2::new(
        (0.5 + 0.754_877_666_246_693 * x + 0.569_840_290_998_053 * y).fract(),
        (0.5 + 0.569_840_290_998_053 * x + 0.754_877_666_246_693 * y).fract(),
    )
}
