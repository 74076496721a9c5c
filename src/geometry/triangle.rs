//! Watertight ray-triangle intersection in double precision, after Woop, Benthin and Wald, "Watertight Ray/Triangle
//! Intersection", JCGT 2(1), 2013.

use glam::DVec3;

use super::Ray;

/// What all triangles need of a ray: the axis order and the shear that make it the z axis.
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay {
    origin: DVec3,
    axes: [usize; 3],
    shear: DVec3,
}

impl ShearedRay {
    /// Prepares a ray with a finite, non-zero direction.
    pub fn new(ray: &Ray) -> Self {
        let d = ray.direction;
        let magnitude = d.abs();
        let z = if magnitude.x > magnitude.y {
            if magnitude.x > magnitude.z { 0 } else { 2 }
        } else if magnitude.y > magnitude.z {
            1
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

    /// Distance in units of the ray's direction and barycentric coordinates of the hit in front of the origin; both
    /// sides count. Two triangles that share an edge or a vertex leave no gap between them.
    pub fn intersect(&self, corners: &[DVec3; 3]) -> Option<(f64, [f64; 3])> {
        let [a, b, c] = corners.map(|corner| corner - self.origin);
        let [kx, ky, kz] = self.axes;
        let (sx, sy) = (self.shear.x, self.shear.y);
        let (ax, ay) = (a[kx] - sx * a[kz], a[ky] - sy * a[kz]);
        let (bx, by) = (b[kx] - sx * b[kz], b[ky] - sy * b[kz]);
        let (cx, cy) = (c[kx] - sx * c[kz], c[ky] - sy * c[kz]);
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None;
        }
        let distance = self.shear.z * (u * a[kz] + v * b[kz] + w * c[kz]) / determinant;
        // Also refuses NaN.
        if distance > 0.0 && distance.is_finite() {
            Some((distance, [u / determinant, v / determinant, w / determinant]))
        } else {
            None
        }
    }
}
