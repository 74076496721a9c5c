//! The area of a triangle within the unit square.

use glam::DVec2;

use crate::geometry::polygon::clipped;

/// Triangles of less area count by the position of their centroid [unit squares].
const MIN_AREA: f64 = 1e-12;

/// Share of a triangle's area in the unit square, [0, 1].
pub(super) fn share_in_square(triangle: [DVec2; 3]) -> f64 {
    let whole = area(&triangle).abs();
    if whole < MIN_AREA {
        let middle = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
        return f64::from(u8::from(is_in_square(middle)));
    }
    let sides = [
        (DVec2::X, 0.0),
        (DVec2::NEG_X, -1.0),
        (DVec2::Y, 0.0),
        (DVec2::NEG_Y, -1.0),
    ];
    let mut polygon = triangle.to_vec();
    for (inwards, least) in sides {
        polygon = clipped(&polygon, |point| point.dot(inwards) - least);
    }
    (area(&polygon).abs() / whole).min(1.0)
}

pub(super) fn is_in_square(place: DVec2) -> bool {
    place.cmpge(DVec2::ZERO).all() && place.cmplt(DVec2::ONE).all()
}

fn area(polygon: &[DVec2]) -> f64 {
    let next = |index: usize| polygon[(index + 1) % polygon.len()];
    let corners = polygon.iter().enumerate();
    0.5 * corners
        .map(|(index, corner)| corner.perp_dot(next(index)))
        .sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_those_of_the_area() {
        let triangle = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| [a, b, c].map(DVec2::from);
        for (corners, share) in [
            (triangle([0.1, 0.1], [0.9, 0.1], [0.1, 0.9]), 1.0),
            (triangle([-1.0, 0.0], [1.0, 0.0], [1.0, 1.0]), 0.75),
            (triangle([2.0, 2.0], [3.0, 2.0], [2.0, 3.0]), 0.0),
            // The triangle contains the whole square: 1 of 8.
            (triangle([-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]), 0.125),
            (triangle([0.5, 0.5], [0.5, 0.5], [0.5, 0.5]), 1.0),
            (triangle([1.5, 0.5], [1.5, 0.5], [1.5, 0.5]), 0.0),
        ] {
            assert!((share_in_square(corners) - share).abs() < 1e-12, "{corners:?}");
            let [a, b, c] = corners;
            assert!(
                (share_in_square([a, c, b]) - share).abs() < 1e-12,
                "either way round"
            );
        }
    }
}
