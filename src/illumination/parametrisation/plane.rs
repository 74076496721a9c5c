//! Planes, and the smallest rectangle around a set of points.

use glam::{DVec2, DVec3};

use crate::scene::Mesh;

/// Right-handed axes of a rectangle on a surface: u × v = −normal, so that a map with v downwards is not mirrored when
/// seen from outside.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Unit vector to the right.
    pub u: DVec3,
    /// Unit vector downwards.
    pub v: DVec3,
}

/// A rectangle around points in a plane [m].
#[derive(Clone, Copy, Debug)]
pub struct Rectangle {
    pub frame: Frame,
    /// Its corner of least u and v [m].
    pub low: DVec2,
    /// Side lengths [m].
    pub size: DVec2,
}

impl Frame {
    /// Axes with the given u, a unit vector perpendicular to the unit normal.
    pub fn new(u: DVec3, normal: DVec3) -> Self {
        Self {
            u,
            v: u.cross(normal),
        }
    }

    /// Coordinates of a point [m].
    pub fn project(&self, point: DVec3) -> DVec2 {
        DVec2::new(point.dot(self.u), point.dot(self.v))
    }
}

/// Unit normal of the plane that contains the whole mesh, with all triangles facing the same way; `None` if the mesh is
/// bent, folded or without area.
pub fn common_normal(mesh: &Mesh) -> Option<DVec3> {
    let area_vector = |triangle: usize| {
        let [a, b, c] = mesh.corners(triangle);
        (b - a).cross(c - a)
    };
    let normal = (0..mesh.triangles.len())
        .map(area_vector)
        .sum::<DVec3>()
        .try_normalize()?;
    let origin = mesh.corners(0)[0];
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let mut off_plane: f64 = 0.0;
    for corner in (0..mesh.triangles.len()).flat_map(|triangle| mesh.corners(triangle)) {
        low = low.min(corner);
        high = high.max(corner);
        off_plane = off_plane.max((corner - origin).dot(normal).abs());
    }
    // Files store positions in single precision, with errors of 2⁻²⁴ of the distance from the file's origin.
    let tolerance = 1e-6 * (high - low).length() + 2.5e-7 * low.abs().max(high.abs()).max_element();
    let same_way = (0..mesh.triangles.len()).all(|triangle| area_vector(triangle).dot(normal) >= 0.0);
    (off_plane <= tolerance && same_way).then_some(normal)
}

/// The rectangle of smallest area around points in a plane with the given unit normal; its u is along the longer side.
pub fn smallest_rectangle(points: &[DVec3], normal: DVec3) -> Rectangle {
    let base = Frame::new(normal.any_orthonormal_vector(), normal);
    let hull = convex_hull(points.iter().map(|point| base.project(*point)).collect());
    // A rectangle of smallest area has a side along an edge of the hull (Freeman and Shapira 1975). The edges of a
    // round hull are nearly equivalent, so a few hundred are enough.
    let stride = hull.len().div_ceil(512);
    let mut best: Option<(f64, DVec2)> = None;
    for index in (0..hull.len()).step_by(stride.max(1)) {
        let Some(along) = (hull[(index + 1) % hull.len()] - hull[index]).try_normalize() else {
            continue;
        };
        let (low, high) = extent(&hull, along);
        let size = high - low;
        // The improvement must exceed rounding, so that equal edges of a square do not compete.
        if best.is_none_or(|(area, _)| size.x * size.y < area * (1.0 - 1e-9)) {
            let longer = if size.x >= size.y { along } else { along.perp() };
            best = Some((size.x * size.y, longer));
        }
    }
    let along = best.map_or(DVec2::X, |(_, along)| along);
    let u = (base.u * along.x + base.v * along.y).normalize();
    Rectangle::around(points, Frame::new(u, normal))
}

impl Rectangle {
    /// The smallest rectangle along given axes.
    pub fn around(points: &[DVec3], frame: Frame) -> Self {
        let (low, high) = points
            .iter()
            .map(|point| frame.project(*point))
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), point| {
                (low.min(point), high.max(point))
            });
        Self {
            frame,
            low,
            size: high - low,
        }
    }

    /// Turns the rectangle by multiples of 90° to the orientation that users expect: u towards +x on a floor, v
    /// downwards on anything else.
    pub fn upright(self, points: &[DVec3], normal: DVec3) -> Self {
        let Frame { u, v } = self.frame;
        let goal = if normal.y.abs() > 0.9 {
            |frame: Frame| frame.u.x
        } else {
            |frame: Frame| -frame.v.y
        };
        let mut best = self.frame;
        for candidate in [v, -u, -v] {
            let frame = Frame::new(candidate, normal);
            if goal(frame) > goal(best) + 1e-9 {
                best = frame;
            }
        }
        Self::around(points, best)
    }
}

/// Bounds of points along a unit direction and perpendicular to it.
fn extent(points: &[DVec2], along: DVec2) -> (DVec2, DVec2) {
    let across = along.perp();
    points
        .iter()
        .map(|point| DVec2::new(point.dot(along), point.dot(across)))
        .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), point| {
            (low.min(point), high.max(point))
        })
}

/// Counter-clockwise convex hull (Andrew's monotone chain).
fn convex_hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut hull: Vec<DVec2> = Vec::new();
    let mut chain = |points: &mut dyn Iterator<Item = DVec2>| {
        let start = hull.len();
        for point in points {
            while hull.len() >= start + 2
                && (hull[hull.len() - 1] - hull[hull.len() - 2]).perp_dot(point - hull[hull.len() - 2]) <= 0.0
            {
                hull.pop();
            }
            hull.push(point);
        }
        hull.pop();
    };
    chain(&mut points.iter().copied());
    chain(&mut points.iter().rev().copied());
    hull
}
