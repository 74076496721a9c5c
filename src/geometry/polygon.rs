//! Clipping of convex polygons.

use std::ops::{Add, Mul, Sub};

/// The part of a convex polygon where a linear function is not negative (Sutherland and Hodgman, "Reentrant Polygon
/// Clipping", CACM 1974).
pub fn clipped<P>(polygon: &[P], height: impl Fn(P) -> f64) -> Vec<P>
where
    P: Copy + Add<Output = P> + Sub<Output = P> + Mul<f64, Output = P>,
{
    let mut part = Vec::with_capacity(polygon.len() + 1);
    for (index, &a) in polygon.iter().enumerate() {
        let b = polygon[(index + 1) % polygon.len()];
        let (height_a, height_b) = (height(a), height(b));
        if height_a >= 0.0 {
            part.push(a);
        }
        if (height_a < 0.0) != (height_b < 0.0) {
            part.push(a + (b - a) * (height_a / (height_a - height_b)));
        }
    }
    part
}
