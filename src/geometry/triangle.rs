//! Watertight ray-triangle intersection in double precision, after Woop, Benthin and Wald, "Watertight Ray/Triangle
//! Intersection", JCGT 2(1), 2013.

use glam::DVec3;

use super::Ray;
use super::ray::gamma;

/// Ray data that all triangle tests share: the axis order and the shear that make the ray the z axis.
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay {
    origin: DVec3,
    axes: [usize; 3],
    shear: DVec3,
}

impl ShearedRay {
    /// Expects a finite, non-zero direction.
    pub fn new(ray: &Ray) -> Self {
        let d = ray.direction.to_array();
        let magnitude = d.map(f64::abs);
        let larger = usize::from(magnitude[1] >= magnitude[0]);
        let z = if magnitude[larger] > magnitude[2] {
            larger
        } else {
            2
        };
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if d[z] < 0.0 {
            std::mem::swap(&mut x, &mut y);
        }
        Self {
            origin: ray.origin,
            axes: [x, y, z],
            shear: DVec3::new(d[x] / d[z], d[y] / d[z], 1.0 / d[z]),
        }
    }

    /// Distance in units of the ray's direction and barycentric coordinates of the hit in front of the origin;
    /// triangles are two-sided. Triangles that share an edge or a vertex leave no gap.
    #[inline(always)]
    pub fn intersect(&self, corners: &[DVec3; 3]) -> Option<(f64, [f64; 3])> {
        let [a, b, c] = corners.map(|corner| (corner - self.origin).to_array());
        let [kx, ky, kz] = self.axes;
        let (sx, sy) = (self.shear.x, self.shear.y);
        let (ax, ay) = (a[kx] - sx * a[kz], a[ky] - sy * a[kz]);
        let (bx, by) = (b[kx] - sx * b[kz], b[ky] - sy * b[kz]);
        let (cx, cy) = (c[kx] - sx * c[kz], c[ky] - sy * c[kz]);
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        // Unpredictable branches would cost more than all comparisons.
        let is_outside = ((u < 0.0) | (v < 0.0) | (w < 0.0)) & ((u > 0.0) | (v > 0.0) | (w > 0.0));
        let determinant = u + v + w;
        if is_outside | (determinant == 0.0) {
            return None;
        }
        let distance = self.shear.z * (u * a[kz] + v * b[kz] + w * c[kz]) / determinant;
        let z = [a[kz], b[kz], c[kz]].map(|z| (self.shear.z * z).abs());
        let bound =
            distance_error(max([ax, bx, cx]), max([ay, by, cy]), max(z), max([u, v, w])) / determinant.abs();
        // Rejects NaN too.
        if distance > bound && distance.is_finite() {
            Some((distance, [u / determinant, v / determinant, w / determinant]))
        } else {
            None
        }
    }
}

/// The largest magnitude. A NaN may or may not be passed on: with one, no hit's distance is finite.
fn max(values: [f64; 3]) -> f64 {
    let larger = |a: f64, b: f64| if a > b { a } else { b };
    let [a, b, c] = values.map(f64::abs);
    larger(larger(a, b), c)
}

/// Bound on the rounding error of a hit's distance, times the determinant. A distance below it may be zero, as when a
/// ray leaves this very surface or a coplanar neighbour (Pharr, Jakob and Humphreys, Physically Based Rendering,
/// 6.8.7). `x`, `y`, `z`: largest sheared coordinates, `edge`: largest edge function, all absolute.
fn distance_error(x: f64, y: f64, z: f64, edge: f64) -> f64 {
    let error_z = gamma(3.0) * z;
    let error_x = gamma(5.0) * (x + z);
    let error_y = gamma(5.0) * (y + z);
    let error_edge = 2.0 * (gamma(2.0) * x * y + error_y * x + error_x * y);
    3.0 * (gamma(3.0) * edge * z + error_edge * z + error_z * edge)
}
