//! A triangle projected onto a face of the launch domain and clipped to it.

use glam::{DVec2, DVec3};

use super::bits::CellBits;
use super::grid::{CellRange, Grid, MARGIN};

/// A convex polygon in homogeneous face coordinates, at most a triangle clipped by four planes.
pub(super) struct Polygon {
    corners: [DVec3; 8],
    count: usize,
}

/// A face sees |x| ≤ z and |y| ≤ z, enlarged by this factor.
pub(super) const WIDENED: f64 = 1.0 + MARGIN;

/// Planes around the frustum of a face; normals point inwards.
const SIDES: [DVec3; 4] = [
    DVec3::new(1.0, 0.0, WIDENED),
    DVec3::new(-1.0, 0.0, WIDENED),
    DVec3::new(0.0, 1.0, WIDENED),
    DVec3::new(0.0, -1.0, WIDENED),
];

impl Polygon {
    /// The part of a triangle that the face sees; `None` if it sees nothing.
    pub(super) fn seen(triangle: &[DVec3; 3]) -> Option<Self> {
        let mut corners = [DVec3::ZERO; 8];
        corners[..3].copy_from_slice(triangle);
        let mut polygon = Self { corners, count: 3 };
        for plane in SIDES {
            let outside = polygon
                .corners()
                .iter()
                .filter(|corner| corner.dot(plane) < 0.0)
                .count();
            if outside == polygon.count {
                return None;
            }
            if outside > 0 {
                polygon.clip(plane);
            }
        }
        (polygon.count > 0).then_some(polygon)
    }

    fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    fn clip(&mut self, plane: DVec3) {
        let old = self.corners;
        let count = self.count;
        self.count = 0;
        for index in 0..count {
            let (a, b) = (old[index], old[(index + 1) % count]);
            let (da, db) = (a.dot(plane), b.dot(plane));
            if da >= 0.0 {
                self.push(a);
            }
            if (da < 0.0) != (db < 0.0) {
                self.push(a + (b - a) * (da / (da - db)));
            }
        }
    }

    fn push(&mut self, corner: DVec3) {
        self.corners[self.count] = corner;
        self.count += 1;
    }

    /// Bounds on the plane z = 1, clamped to the face; `None` if the polygon reaches the light itself.
    pub(super) fn plane_bounds(&self) -> Option<(DVec2, DVec2)> {
        let mut low = DVec2::INFINITY;
        let mut high = DVec2::NEG_INFINITY;
        for corner in self.corners() {
            let point = corner.truncate() / corner.z;
            if !point.is_finite() {
                return None;
            }
            (low, high) = (low.min(point), high.max(point));
        }
        Some((
            low.clamp(DVec2::NEG_ONE, DVec2::ONE),
            high.clamp(DVec2::NEG_ONE, DVec2::ONE),
        ))
    }

    /// Cells of `set` that the polygon touches; all of them if it reaches the light.
    pub(super) fn touched(&self, grid: &Grid, set: &CellBits) -> Vec<(usize, usize)> {
        let Some((low, high)) = self.plane_bounds() else {
            return set.list(&CellRange::ALL);
        };
        let cells = grid.cells(low, high);
        let mut list = set.list(&cells);
        if !cells.is_single() && !list.is_empty() {
            let edges = self.edges();
            list.retain(|&(column, row)| edges.touch(grid.cell(column, row)));
        }
        list
    }

    /// The planes through the light and each edge, for tests against many cells.
    pub(super) fn edges(&self) -> Edges {
        let mut edges = Edges {
            planes: [DVec3::ZERO; 8],
            count: 0,
        };
        let corners = self.corners();
        for (index, a) in corners.iter().enumerate() {
            // Homogeneous: no division loses precision at corners close to the light.
            let plane = a.cross(corners[(index + 1) % corners.len()]);
            let inside = corners
                .iter()
                .map(|corner| plane.dot(*corner))
                .fold(0.0, |m: f64, d| if d.abs() > m.abs() { d } else { m });
            if inside != 0.0 {
                edges.planes[edges.count] = plane * inside.signum();
                edges.count += 1;
            }
        }
        edges
    }
}

/// Planes with the polygon on their positive side.
pub(super) struct Edges {
    planes: [DVec3; 8],
    count: usize,
}

impl Edges {
    /// False only if a rectangle of the plane z = 1 lies entirely beyond one edge.
    pub(super) fn touch(&self, (low, high): (DVec2, DVec2)) -> bool {
        let beyond = |plane: &DVec3| {
            let x = if plane.x > 0.0 { high.x } else { low.x };
            let y = if plane.y > 0.0 { high.y } else { low.y };
            plane.x * x + plane.y * y + plane.z < 0.0
        };
        // A plane of NaN rejects nothing.
        !self.planes[..self.count].iter().any(beyond)
    }
}
