//! Rays, and robust origins that do not hit the surface they leave.

use glam::DVec3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// [m].
    pub origin: DVec3,
    /// Unit.
    pub direction: DVec3,
}

impl Ray {
    /// The point at a distance [m] along the ray.
    pub fn at(&self, distance_m: f64) -> DVec3 {
        self.origin + self.direction * distance_m
    }
}

/// Bound γ(n) = nε/(1 − nε) on the relative error of n rounded operations (Higham 2002, 3.1).
pub fn gamma(operations: f64) -> f64 {
    let unit_roundoff = 0.5 * f64::EPSILON;
    operations * unit_roundoff / (1.0 - operations * unit_roundoff)
}

/// A point of a triangle from barycentric coordinates, with a bound on its rounding error per axis [m] (Pharr, Jakob
/// and Humphreys, Physically Based Rendering, 6.8.5).
pub fn point_with_error(corners: &[DVec3; 3], barycentric: [f64; 3]) -> (DVec3, DVec3) {
    let terms = [
        corners[0] * barycentric[0],
        corners[1] * barycentric[1],
        corners[2] * barycentric[2],
    ];
    let magnitude = terms[0].abs() + terms[1].abs() + terms[2].abs();
    (terms[0] + terms[1] + terms[2], magnitude * gamma(7.0))
}

/// Origin of a ray that leaves a surface at `point` in `direction`: offset along the geometric normal just beyond the
/// point's rounding error, to the side of the direction. No fixed epsilon: in double precision the offset is some 1e-15
/// of the coordinates.
#[inline(always)]
pub fn offset_origin(point: DVec3, error: DVec3, geometric_normal: DVec3, direction: DVec3) -> DVec3 {
    let step = geometric_normal.abs().dot(error);
    let side = if direction.dot(geometric_normal) < 0.0 {
        -step
    } else {
        step
    };
    let offset = geometric_normal * side;
    let moved = point + offset;
    let away = |moved: f64, offset: f64| {
        // The next number in the offset's direction, without unpredictable branches. Adding zero turns −0 into +0.
        let sign = 1.0_f64.copysign(offset);
        let up = moved * sign + 0.0;
        let step = (up.to_bits() as i64 >> 63) | 1;
        let next = f64::from_bits(up.to_bits().wrapping_add_signed(step)) * sign;
        if offset.abs() > 0.0 { next } else { moved }
    };
    DVec3::new(
        away(moved.x, offset.x),
        away(moved.y, offset.y),
        away(moved.z, offset.z),
    )
}
