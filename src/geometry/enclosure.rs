//! Closed surfaces, and which points they contain.

use std::collections::HashMap;

use glam::DVec3;

use super::polygon::clipped;
use super::{bits, numbered};

/// Minimum and maximum corner of a box [m].
pub type Bounds = (DVec3, DVec3);

/// Whether a mesh is watertight: every edge belongs to two triangles that traverse it in opposite directions.
pub fn is_closed(positions: &[DVec3], triangles: &[[u32; 3]]) -> bool {
    let mut traversals = edge_traversals(positions, triangles).peekable();
    traversals.peek().is_some() && traversals.all(|times| times == (1, 1))
}

/// How often triangles traverse each edge of a mesh, forwards and backwards. Vertices at equal positions count as one;
/// triangles with a repeated vertex are ignored.
pub fn edge_traversals(positions: &[DVec3], triangles: &[[u32; 3]]) -> impl Iterator<Item = (u32, u32)> {
    let ids = numbered(positions.iter().copied().map(bits));
    // From the lower to the higher vertex.
    let mut edges: HashMap<(u32, u32), (u32, u32)> = HashMap::with_capacity(2 * triangles.len());
    for triangle in triangles {
        let [a, b, c] = triangle.map(|vertex| ids[vertex as usize]);
        if a == b || b == c || c == a {
            continue;
        }
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (forwards, backwards) = edges.entry((from.min(to), from.max(to))).or_default();
            *(if from < to { forwards } else { backwards }) += 1;
        }
    }
    edges.into_values()
}

/// Winding number of a closed surface around a point: the solid angles of its triangles over 4π (van Oosterom and
/// Strackee 1983). ±1 inside, 0 outside, close to neither on the surface itself.
pub fn winding_number(triangles: impl Iterator<Item = [DVec3; 3]>, point: DVec3) -> f64 {
    let solid_angle_sr = |corners: [DVec3; 3]| {
        let [a, b, c] = corners.map(|corner| corner - point);
        let [la, lb, lc] = [a, b, c].map(DVec3::length);
        let volume = a.dot(b.cross(c));
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * volume.atan2(below)
    };
    triangles.map(solid_angle_sr).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// Whether a triangle and a box intersect; touching counts.
pub fn triangle_meets_box(corners: [DVec3; 3], (low, high): Bounds) -> bool {
    let [a, b, c] = corners;
    if a.min(b).min(c).cmpgt(high).any() || a.max(b).max(c).cmplt(low).any() {
        return false;
    }
    let mut polygon = corners.to_vec();
    for axis in 0..3 {
        for (limit, sign) in [(low[axis], 1.0), (high[axis], -1.0)] {
            polygon = clipped(&polygon, |point| sign * (point[axis] - limit));
        }
    }
    !polygon.is_empty()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cube [-1, 1]³, counter-clockwise as seen from outside.
    fn cube() -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let positions = (0..8)
            .map(|corner| {
                let side = |bit: i32| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
                DVec3::new(side(0), side(1), side(2))
            })
            .collect();
        let quads = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
        (positions, quads.into_iter().flat_map(halves).collect())
    }

    #[test]
    fn a_cube_is_closed_until_a_triangle_is_missing_or_turned() {
        let (positions, mut triangles) = cube();
        assert!(is_closed(&positions, &triangles));
        triangles[3].swap(0, 1);
        assert!(!is_closed(&positions, &triangles));
        triangles.remove(3);
        assert!(!is_closed(&positions, &triangles));
        assert!(!is_closed(&positions, &[]));
    }

    #[test]
    fn winding_tells_inside_from_outside() {
        let (positions, triangles) = cube();
        let around = |point| {
            let corners = triangles
                .iter()
                .map(|triangle| triangle.map(|vertex| positions[vertex as usize]));
            winding_number(corners, point).abs()
        };
        for inside in [DVec3::ZERO, DVec3::splat(0.999), DVec3::new(-0.9, 0.2, 0.99)] {
            assert!((around(inside) - 1.0).abs() < 1e-9, "{inside}");
        }
        for outside in [DVec3::splat(1.001), DVec3::X * 1.5, DVec3::new(0.0, 90.0, 0.0)] {
            assert!(around(outside) < 1e-9, "{outside}");
        }
    }

    #[test]
    fn a_triangle_meets_a_box_without_a_corner_in_it() {
        let whole = (DVec3::NEG_ONE, DVec3::ONE);
        let through = [
            DVec3::new(-9.0, 0.0, 0.0),
            DVec3::new(9.0, 0.1, 0.0),
            DVec3::new(0.0, 0.0, 9.0),
        ];
        assert!(triangle_meets_box(through, whole));
        let beyond = through.map(|corner| corner + DVec3::Y * 1.2);
        assert!(!triangle_meets_box(beyond, whole));
        // Passes a corner of the box, which lies within the triangle's own bounds.
        let past = [
            DVec3::new(3.5, 0.0, 0.0),
            DVec3::new(0.0, 3.5, 0.0),
            DVec3::new(0.0, 0.0, 3.5),
        ];
        assert!(!triangle_meets_box(past, whole));
    }
}
