//! Splits a triangle of rays over the facets of a mesh: each facet gets the part that lies on it, in its own map
//! coordinates. Charts may end, turn and stretch between facets.

use glam::{DVec2, DVec3};

use super::receivers::ReceiverSurface;
use crate::geometry::Ray;
use crate::illumination::Chart;
use crate::illumination::parametrisation::coverage::convex_area;
use crate::scene::{Adjacency, Mesh};

/// Most facets that a triangle of rays may reach before it has to be cut.
const MAX_FACETS: usize = 1024;

/// Smaller parts of the triangle's area are left to its neighbours.
const MIN_SHARE: f64 = 1e-9;

/// How far a ray may land from the place expected on the next facet while both facets count as one: relative to the
/// distance between the hits [1], plus an absolute part [texels].
const EVEN_SHARE: f64 = 0.1;
const EVEN_TEXELS: f64 = 0.25;

/// Largest deviation from 1 of the sum of the facets' shares.
const MAX_AMISS: f64 = 0.05;

/// Corners of a triangle clipped by the three sides of another.
const MAX_CORNERS: usize = 6;

/// The part of a triangle of rays on one facet.
#[derive(Clone, Copy, Debug)]
pub struct FacetPiece {
    corners: [DVec2; MAX_CORNERS],
    len: usize,
    /// Island of the chart that holds the facet.
    pub island: u32,
    /// Fraction of the triangle's flux.
    pub share: f64,
}

impl FacetPiece {
    /// Fan of triangles [texels] with their fractions of the piece.
    pub fn triangles(&self) -> impl Iterator<Item = ([DVec2; 3], f64)> + Clone {
        let corners = &self.corners[..self.len];
        let whole = convex_area(corners);
        corners[1..].windows(2).map(move |pair| {
            let triangle = [corners[0], pair[0], pair[1]];
            (triangle, convex_area(&triangle) / whole)
        })
    }
}

/// Where a ray hits a facet.
#[derive(Clone, Copy, Debug)]
pub struct FacetPlace {
    /// Index into the mesh's triangles.
    pub triangle: u32,
    pub texel: DVec2,
}

#[derive(Clone, Copy, Debug)]
pub struct Facets<'a> {
    pub surface: &'a ReceiverSurface,
    pub mesh: &'a Mesh,
    pub adjacency: &'a Adjacency,
}

impl Facets<'_> {
    /// Whether the surface between two hits is flat and evenly mapped enough to interpolate between them.
    pub fn is_even(&self, a: (FacetPlace, DVec3), b: (FacetPlace, DVec3)) -> bool {
        if a.0.triangle == b.0.triangle {
            return true;
        }
        if self.surface.island(a.0.triangle) != self.surface.island(b.0.triangle) {
            return false;
        }
        let triangle = a.0.triangle as usize;
        let Some(rows) = self
            .chart()
            .texel_from_world(triangle, self.mesh.corners(triangle))
        else {
            return false;
        };
        let step = b.1 - a.1;
        let expected = DVec2::new(rows[0].dot(step), rows[1].dot(step));
        let met = b.0.texel - a.0.texel;
        (met - expected).length() <= EVEN_TEXELS + EVEN_SHARE * met.length()
    }

    /// Parts of a triangle of rays on the facets that its rays hit and on their neighbours, with shares that sum to 1;
    /// and whether they cover the triangle exactly once. They do not where part of it misses the facets or falls on
    /// surfaces behind each other.
    pub fn pieces(&self, rays: [Ray; 3], triangles: [u32; 3]) -> (Vec<FacetPiece>, bool) {
        let mut found: Vec<FacetPiece> = Vec::new();
        let mut seen: Vec<u32> = triangles.to_vec();
        seen.sort_unstable();
        seen.dedup();
        let seeds = seen.len();
        let mut next = 0;
        while next < seen.len() {
            let triangle = seen[next] as usize;
            next += 1;
            match self.piece(&rays, triangle) {
                Some(piece) => found.push(piece),
                // A ray may just touch its facet.
                None if next <= seeds => {}
                None => continue,
            }
            for neighbour in self.adjacency.around(triangle) {
                if !seen.contains(&(neighbour as u32)) {
                    seen.push(neighbour as u32);
                }
            }
            if found.len() > MAX_FACETS {
                break;
            }
        }
        let whole: f64 = found.iter().map(|piece| piece.share).sum();
        // Rays that land on a line cover no area to take shares of.
        if !whole.is_finite() {
            return (Vec::new(), false);
        }
        found.iter_mut().for_each(|piece| piece.share /= whole);
        // Between facets with an angle, a second-order part of the light is counted twice or not at all.
        (found, (whole - 1.0).abs() <= MAX_AMISS)
    }

    fn chart(&self) -> &Chart {
        &self.surface.chart
    }

    /// The part on one facet; `None` if there is none.
    fn piece(&self, rays: &[Ray; 3], triangle: usize) -> Option<FacetPiece> {
        let chart = self.chart();
        let corners = self.mesh.corners(triangle);
        let normal = self.mesh.face_normal(triangle) * chart.receiver.side().sign();
        let rows = chart.texel_from_world(triangle, corners)?;
        let size = DVec2::new(chart.width as f64, chart.height as f64);
        let facet = chart.corner_uvs[triangle].map(|uv| uv * size);
        let mut places = [DVec2::ZERO; 3];
        for (place, ray) in places.iter_mut().zip(rays) {
            let slope = ray.direction.dot(normal);
            let distance = (corners[0] - ray.origin).dot(normal) / slope;
            // Catches NaN too.
            if !(slope < 0.0 && distance > 0.0) {
                return None;
            }
            let step = ray.origin + ray.direction * distance - corners[0];
            *place = facet[0] + DVec2::new(rows[0].dot(step), rows[1].dot(step));
        }
        let whole = convex_area(&places);
        let mut piece = FacetPiece {
            corners: [DVec2::ZERO; MAX_CORNERS],
            len: 3,
            island: self.surface.island(triangle as u32),
            share: 0.0,
        };
        piece.corners[..3].copy_from_slice(&places);
        let winding = (facet[1] - facet[0]).perp_dot(facet[2] - facet[0]).signum();
        for side in 0..3 {
            piece.cut(facet[side], facet[(side + 1) % 3], winding);
        }
        piece.share = convex_area(&piece.corners[..piece.len]) / whole;
        (piece.share > MIN_SHARE).then_some(piece)
    }
}

impl FacetPiece {
    /// Clips to one side of a line (Sutherland and Hodgman).
    fn cut(&mut self, from: DVec2, to: DVec2, winding: f64) {
        let distance = |corner: DVec2| (to - from).perp_dot(corner - from) * winding;
        let before = self.corners;
        let count = self.len;
        self.len = 0;
        for index in 0..count {
            let (corner, next) = (before[index], before[(index + 1) % count]);
            let (here, there) = (distance(corner), distance(next));
            if here >= 0.0 {
                self.push(corner);
            }
            if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
                self.push(corner + (next - corner) * (here / (here - there)));
            }
        }
    }

    fn push(&mut self, corner: DVec2) {
        // A convex polygon gains at most one corner per line. Rounding may repeat a corner, which adds no area.
        if self.len < MAX_CORNERS {
            self.corners[self.len] = corner;
            self.len += 1;
        }
    }
}
