//! Exact irradiance from a flat polygon of uniform radiance.

use glam::DVec3;

use crate::geometry::polygon::clipped;

/// A flat polygon that emits uniformly.
#[derive(Clone, Debug)]
pub struct Polygon {
    /// In order, either way round [m].
    corners: Vec<DVec3>,
    /// Unit vector.
    normal: DVec3,
    both_sides: bool,
    /// Points closer to the polygon's plane count as lying in it [m].
    least_height_m: f64,
}

/// Rounding error of heights relative to the largest coordinate, with a margin.
const FLAT: f64 = 1e-13;

impl Polygon {
    /// Of at least three corners, not all collinear. It emits to the side of its normal, or to both.
    pub fn new(corners: Vec<DVec3>, normal: DVec3, both_sides: bool) -> Self {
        let largest = corners
            .iter()
            .fold(0.0, |largest, corner| corner.abs().max_element().max(largest));
        Self {
            corners,
            normal,
            both_sides,
            least_height_m: FLAT * largest,
        }
    }

    /// E/L [sr] at a point: ∫ cos θ dω over the part of the polygon in front of both normals of the receiving surface.
    /// `geometric` and `shading` are unit vectors on the lit side.
    pub fn projected_solid_angle_sr(&self, point: DVec3, geometric: DVec3, shading: DVec3) -> f64 {
        let height = self.normal.dot(point - self.corners[0]);
        let seen = if self.both_sides { height.abs() } else { height };
        if seen <= self.least_height_m {
            return 0.0;
        }
        let mut above: Vec<DVec3> = self.corners.iter().map(|corner| *corner - point).collect();
        for normal in [geometric, shading] {
            if above.iter().any(|corner| normal.dot(*corner) < 0.0) {
                above = clipped(&above, |corner| normal.dot(corner));
            }
        }
        cosine_integral(&above, shading)
    }
}

/// ∫ cos θ dω over a polygon above the horizon of `normal`, seen from the origin: half the sum over its edges of the
/// angle they span times the cosine to the normal of the plane through them (Lambert, Photometria, 1760; Baum,
/// Rushmeier and Winget, SIGGRAPH 1989).
fn cosine_integral(corners: &[DVec3], normal: DVec3) -> f64 {
    let edges = (0..corners.len()).map(|index| (corners[index], corners[(index + 1) % corners.len()]));
    let sum: f64 = edges
        .filter_map(|(here, next)| {
            let across = here.cross(next);
            let angle = across.length().atan2(here.dot(next));
            Some(angle * normal.dot(across.try_normalize()?))
        })
        .sum();
    0.5 * sum.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(height: f64) -> Polygon {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corners = corners.map(|(x, z)| DVec3::new(x, height, z)).to_vec();
        Polygon::new(corners, DVec3::NEG_Y, false)
    }

    fn seen(polygon: &Polygon, point: DVec3, normal: DVec3) -> f64 {
        polygon.projected_solid_angle_sr(point, normal, normal)
    }

    /// Four times the configuration factor from a plane element to a parallel rectangle over its corner: Siegel and
    /// Howell, Thermal Radiation Heat Transfer.
    #[test]
    fn a_square_over_a_parallel_plane_follows_its_closed_form() {
        for height in [1e-3, 0.5, 1.0, 7.0] {
            let side = 1.0 / height;
            let root = 1.0 + side * side;
            let root = f64::sqrt(root);
            let expected = 4.0 * (side / root) * (side / root).atan();
            let found = seen(&square(height), DVec3::ZERO, DVec3::Y);
            assert!(
                (found / expected - 1.0).abs() < 1e-9,
                "{height}: {found} for {expected}"
            );
        }
    }

    #[test]
    fn halves_below_the_horizon_are_not_seen() {
        // Close below a ceiling, a wall receives half of what the floor does.
        let whole = seen(&square(1e-6), DVec3::ZERO, DVec3::Y);
        assert!(
            (whole - std::f64::consts::PI).abs() < 1e-5,
            "all of the sky: {whole}"
        );
        let half = seen(&square(1e-6), DVec3::ZERO, DVec3::X);
        assert!((half - 0.5 * std::f64::consts::PI).abs() < 1e-5, "{half}");
        assert_eq!(seen(&square(1.0), DVec3::ZERO, DVec3::NEG_Y), 0.0);
    }

    #[test]
    fn its_back_and_its_own_plane_are_dark() {
        assert_eq!(seen(&square(-1.0), DVec3::ZERO, DVec3::NEG_Y), 0.0);
        assert_eq!(seen(&square(0.0), DVec3::new(0.2, 0.0, 0.3), DVec3::Y), 0.0);
        let mut both = square(-1.0);
        both.both_sides = true;
        assert!(seen(&both, DVec3::ZERO, DVec3::NEG_Y) > 0.0);
    }
}
