//! Whether texture coordinates of the file can serve as map coordinates.

use glam::{DVec2, DVec3};

use super::coverage::twice_signed_area;
use super::overlap::overlaps;
use super::plane::Frame;
use crate::scene::Mesh;

/// Coordinates may leave the unit square by this much (rounding in the exporter); they are moved onto its border.
const OUTSIDE: f64 = 1e-5;

/// A set must use at least this share of the map, else most texels would be wasted on nothing.
const LEAST_COVERAGE: f64 = 0.05;

/// A triangle must get at least this share of the map area that its surface area calls for.
const LEAST_DENSITY: f64 = 1e-6;

/// How far an affine, covering set may be from affine and from covering.
const AFFINE_TOLERANCE: f64 = 1e-4;
const COVERING_TOLERANCE: f64 = 1e-3;

/// Side of the overlap raster for a whole mesh.
const RASTER_SIDE: usize = 256;

/// Corner coordinates of a set that gives every point of the surface its own place in the unit square, else `None`.
pub fn light_map_set(mesh: &Mesh, uvs: Option<&Vec<DVec2>>) -> Option<Vec<[DVec2; 3]>> {
    let corners = corner_coordinates(mesh, uvs?)?;
    let covered = covered_share(&corners);
    let surface_m2 = mesh.area_m2();
    let dense = |triangle: usize| {
        let [a, b, c] = mesh.corners(triangle);
        let share_of_surface = 0.5 * (b - a).cross(c - a).length() / surface_m2;
        let share_of_map = 0.5 * twice_signed_area(corners[triangle]).abs() / covered;
        share_of_surface == 0.0 || share_of_map > LEAST_DENSITY * share_of_surface
    };
    let valid = (LEAST_COVERAGE..1.0 + COVERING_TOLERANCE).contains(&covered)
        && (0..corners.len()).all(dense)
        && !overlaps(&corners, RASTER_SIDE);
    valid.then_some(corners)
}

/// Whether a valid set of a planar mesh is one affine image of the plane that covers the whole unit square.
pub fn is_affine_and_covering(mesh: &Mesh, corners: &[[DVec2; 3]], normal: DVec3) -> bool {
    (covered_share(corners) - 1.0).abs() <= COVERING_TOLERANCE && is_affine(mesh, corners, normal)
}

fn is_affine(mesh: &Mesh, corners: &[[DVec2; 3]], normal: DVec3) -> bool {
    let frame = Frame::new(normal.any_orthonormal_vector(), normal);
    let plane = |triangle: usize| mesh.corners(triangle).map(|corner| frame.project(corner));
    let area = |triangle: usize| twice_signed_area(plane(triangle)).abs();
    let Some(largest) = (0..corners.len()).max_by(|&a, &b| area(a).total_cmp(&area(b))) else {
        return false;
    };
    let ([a, b, c], [ua, ub, uc]) = (plane(largest), corners[largest]);
    let determinant = (b - a).perp_dot(c - a);
    corners.iter().enumerate().all(|(triangle, uvs)| {
        plane(triangle).iter().zip(uvs).all(|(point, uv)| {
            let offset = *point - a;
            let (s, t) = (
                offset.perp_dot(c - a) / determinant,
                (b - a).perp_dot(offset) / determinant,
            );
            (ua + (ub - ua) * s + (uc - ua) * t).distance(*uv) <= AFFINE_TOLERANCE
        })
    })
}

/// Share of the unit square that the triangles cover, as long as they do not overlap.
pub fn covered_share(corners: &[[DVec2; 3]]) -> f64 {
    corners
        .iter()
        .map(|triangle| 0.5 * twice_signed_area(*triangle).abs())
        .sum()
}

/// Coordinates by corner, brought onto the unit square; `None` where one is not finite or lies outside.
fn corner_coordinates(mesh: &Mesh, uvs: &[DVec2]) -> Option<Vec<[DVec2; 3]>> {
    let usable =
        |uv: DVec2| uv.is_finite() && uv.min_element() >= -OUTSIDE && uv.max_element() <= 1.0 + OUTSIDE;
    mesh.triangles
        .iter()
        .map(|triangle| {
            let corners = triangle.map(|vertex| uvs.get(vertex as usize).copied().unwrap_or(DVec2::NAN));
            corners
                .iter()
                .all(|uv| usable(*uv))
                .then(|| corners.map(|uv| uv.clamp(DVec2::ZERO, DVec2::ONE)))
        })
        .collect()
}
