//! Whether a file's texture coordinates can serve as map coordinates.

use glam::{DVec2, DVec3};

use super::coverage::{Polygon, cells, rows, twice_signed_area};
use super::plane::Frame;
use crate::scene::Mesh;

/// Tolerance outside the unit square, for rounding in the exporter; such coordinates are clamped to its border.
const OUTSIDE: f64 = 1e-5;

/// Minimum share of the map that a set must cover; below, most texels would be wasted.
const MIN_COVERAGE: f64 = 0.05;

/// Minimum map area of a triangle, relative to its share of the surface.
const MIN_DENSITY: f64 = 1e-6;

/// Tolerances for an affine set, and for one that covers the unit square.
const AFFINE_TOLERANCE: f64 = 1e-4;
const COVERING_TOLERANCE: f64 = 1e-3;

/// Side of the raster on which a mesh is tested for overlaps.
const RASTER_SIDE: usize = 256;

/// Why a coordinate set cannot serve as map coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// A coordinate is not finite or outside 0..1.
    #[error("coordinates lie outside 0..1")]
    Outside,
    /// Less than a twentieth of the map would be used.
    #[error("it uses less than a twentieth of the map")]
    Sparse,
    /// A triangle has area on the surface, but none in the map.
    #[error("some triangles have no area in it")]
    Collapsed,
    /// A point of the map belongs to several points of the surface.
    #[error("it overlaps itself")]
    Overlapping,
}

/// Coordinates per corner of a set that maps the surface injectively into the unit square.
///
/// # Errors
/// Why it does not.
pub fn light_map_set(mesh: &Mesh, uvs: &[DVec2]) -> Result<Vec<[DVec2; 3]>, Refusal> {
    let corners = corner_coordinates(mesh, uvs).ok_or(Refusal::Outside)?;
    let covered = covered_share(&corners);
    if covered < MIN_COVERAGE {
        return Err(Refusal::Sparse);
    }
    let surface_m2 = mesh.area_m2();
    let dense = |triangle: usize| {
        let share_of_surface = mesh.triangle_area_m2(triangle) / surface_m2;
        let share_of_map = 0.5 * twice_signed_area(corners[triangle]).abs() / covered;
        share_of_surface == 0.0 || share_of_map > MIN_DENSITY * share_of_surface
    };
    if !(0..corners.len()).all(dense) {
        return Err(Refusal::Collapsed);
    }
    if covered >= 1.0 + COVERING_TOLERANCE || overlaps(&corners, RASTER_SIDE) {
        return Err(Refusal::Overlapping);
    }
    Ok(corners)
}

/// Whether a valid set of a planar mesh is a single affine image of the plane that covers the whole unit square.
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

/// Share of the unit square that triangles cover, if they do not overlap.
pub fn covered_share(corners: &[[DVec2; 3]]) -> f64 {
    corners
        .iter()
        .map(|triangle| 0.5 * twice_signed_area(*triangle).abs())
        .sum()
}

/// Coordinates by corner, clamped to the unit square; `None` if any is not finite or lies outside.
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

/// Distance from an edge, in units of the map's side, within which a point counts as on the border: neighbours share
/// borders, and files store coordinates in single precision.
const BORDER: f64 = 1e-6;

/// Share of the covered samples that may be covered twice before a set counts as overlapping.
const ALLOWED_SHARE: f64 = 1e-4;

/// Whether triangles in the unit square overlap beyond their borders.
///
/// Tests one sample per cell of a raster that is finer than the mean triangle and has at least `least_side` cells per
/// side. Misses overlaps far smaller than a cell, which no map can show, either.
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
    // A point is inside if its signed distance from each edge exceeds the border's width.
    let edges = [0, 1, 2].map(|i| {
        let (from, to) = (triangle[i], triangle[(i + 1) % 3]);
        let along = (to - from).normalize_or_zero() * winding;
        (from, along)
    });
    let scaled = triangle.map(|corner| corner * scale);
    for row in rows(scaled, side) {
        let strip = Polygon::triangle(scaled).clipped(1, row as f64, row as f64 + 1.0);
        let (left, right) = strip.range(0);
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

/// Position of a sample within its cell: the irrational steps of the R2 sequence keep samples off the lines of a
/// regular unwrapping.
fn jitter(column: usize, row: usize) -> DVec2 {
    let (x, y) = (column as f64, row as f64);
    DVec2::new(
        (0.5 + 0.754_877_666_246_693 * x + 0.569_840_290_998_053 * y).fract(),
        (0.5 + 0.569_840_290_998_053 * x + 0.754_877_666_246_693 * y).fract(),
    )
}
