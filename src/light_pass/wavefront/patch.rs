//! Pieces of the wavefront between traced rays: cubic in the ray's origin and direction, bilinear in its flux.

use glam::{DVec2, DVec3};

use super::lattice_ray::PathSegment;
use crate::geometry::Ray;

/// A ray, or a derivative of one along the patch's own coordinates.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    origin: DVec3,
    direction: DVec3,
}

impl Node {
    fn of(segment: &PathSegment) -> Self {
        Self {
            origin: segment.ray.origin,
            direction: segment.ray.direction,
        }
    }

    /// Derivative along a step in the unit square.
    fn slope(segment: &PathSegment, step: DVec2) -> Self {
        let d = &segment.differential;
        Self {
            origin: d.across.origin * step.x + d.down.origin * step.y,
            direction: d.across.direction * step.x + d.down.direction * step.y,
        }
    }

    fn times(self, factor: f64) -> Self {
        Self {
            origin: self.origin * factor,
            direction: self.direction * factor,
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            origin: self.origin + other.origin,
            direction: self.direction + other.direction,
        }
    }

    fn ray(self) -> Ray {
        Ray {
            origin: self.origin,
            direction: self.direction,
        }
    }
}

/// Interpolation of rays between the traced ones. Directions are not normalised: the hit on a plane or surface does not
/// depend on their length.
#[derive(Clone, Debug)]
pub enum PatchShape {
    /// Over a rectangle: the linearly blended Coons patch of four cubic Hermite edges, which is the rectangle of Adini,
    /// Clough and Melosh (12 degrees of freedom per coordinate), exact for cubics.
    Coons(Box<CoonsPatch>),
    /// Over a rectangle, from its corner rays without derivatives.
    Bilinear(Box<[Ray; 4]>),
    /// Over a triangle: cubic Bézier with Hermite edges, exact for quadratics.
    Bezier(Box<BezierTriangle>),
    /// Over a triangle, from its corner rays without derivatives.
    Linear(Box<[Ray; 3]>),
}

/// Corner order: (0,0), (1,0), (1,1), (0,1).
#[derive(Clone, Debug)]
pub struct CoonsPatch {
    corners: [Node; 4],
    across: [Node; 4],
    down: [Node; 4],
}

/// Control points in the order 300, 030, 003, 210, 120, 021, 012, 102, 201, 111.
#[derive(Clone, Debug)]
pub struct BezierTriangle {
    control: [Node; 10],
}

impl PatchShape {
    /// Over the rectangle of size `step` between four segments.
    pub fn coons(segments: [&PathSegment; 4], step: DVec2) -> Self {
        Self::Coons(Box::new(CoonsPatch {
            corners: segments.map(Node::of),
            across: segments.map(|segment| Node::slope(segment, DVec2::new(step.x, 0.0))),
            down: segments.map(|segment| Node::slope(segment, DVec2::new(0.0, step.y))),
        }))
    }

    /// Without derivatives.
    pub fn bilinear(segments: [&PathSegment; 4]) -> Self {
        Self::Bilinear(Box::new(segments.map(|segment| segment.ray)))
    }

    /// Over a triangle of the unit square.
    pub fn bezier(segments: [&PathSegment; 3], squares: [DVec2; 3]) -> Self {
        let corners = segments.map(Node::of);
        // Control point a third of the way from corner i to corner j.
        let towards = |i: usize, j: usize| {
            corners[i].plus(Node::slope(segments[i], squares[j] - squares[i]).times(1.0 / 3.0))
        };
        let edges = [
            towards(0, 1),
            towards(1, 0),
            towards(1, 2),
            towards(2, 1),
            towards(2, 0),
            towards(0, 2),
        ];
        let sum = |nodes: &[Node]| nodes.iter().fold(Node::default(), |sum, node| sum.plus(*node));
        let centre = sum(&edges).times(0.25).plus(sum(&corners).times(-1.0 / 6.0));
        let [a, b, c] = corners;
        let [ab, ba, bc, cb, ca, ac] = edges;
        Self::Bezier(Box::new(BezierTriangle {
            control: [a, b, c, ab, ba, bc, cb, ca, ac, centre],
        }))
    }

    /// Without derivatives.
    pub fn linear(segments: [&PathSegment; 3]) -> Self {
        Self::Linear(Box::new(segments.map(|segment| segment.ray)))
    }

    /// Over the rectangle of size `step` around one segment, from its derivatives alone; `low` is the rectangle's
    /// corner relative to the segment.
    pub fn around(segment: &PathSegment, low: DVec2, step: DVec2) -> Self {
        let at = |offset: DVec2| Node::of(segment).plus(Node::slope(segment, offset)).ray();
        Self::Bilinear(Box::new([
            at(low),
            at(low + DVec2::new(step.x, 0.0)),
            at(low + step),
            at(low + DVec2::new(0.0, step.y)),
        ]))
    }

    /// Whether the patch's coordinates cover the unit square instead of the triangle below its diagonal.
    pub fn is_rectangle(&self) -> bool {
        matches!(self, Self::Coons(_) | Self::Bilinear(_))
    }

    /// The interpolated ray at a point of the patch.
    pub fn ray(&self, place: DVec2) -> Ray {
        let (s, t) = (place.x, place.y);
        match self {
            Self::Coons(patch) => patch.node(s, t).ray(),
            Self::Bilinear(rays) => mix(&rays[..], &bilinear_weights(s, t)),
            Self::Bezier(patch) => patch.node(s, t).ray(),
            Self::Linear(rays) => mix(&rays[..], &[1.0 - s - t, s, t]),
        }
    }

    /// Weights of the corners' flux at a point of the patch.
    pub fn weights(&self, place: DVec2) -> [f64; 4] {
        let (s, t) = (place.x, place.y);
        if self.is_rectangle() {
            bilinear_weights(s, t)
        } else {
            [1.0 - s - t, s, t, 0.0]
        }
    }
}

fn bilinear_weights(s: f64, t: f64) -> [f64; 4] {
    [(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t]
}

fn mix(rays: &[Ray], weights: &[f64]) -> Ray {
    let mut sum = Node::default();
    for (ray, weight) in rays.iter().zip(weights) {
        sum.origin += ray.origin * *weight;
        sum.direction += ray.direction * *weight;
    }
    sum.ray()
}

impl CoonsPatch {
    fn node(&self, s: f64, t: f64) -> Node {
        let value = |s: f64, t: f64| (1.0 - s) * (1.0 - t) * (1.0 + s + t - 2.0 * (s * s + t * t));
        let slope = |s: f64, t: f64| s * (1.0 - s) * (1.0 - s) * (1.0 - t);
        let (u, v) = (1.0 - s, 1.0 - t);
        let values = [value(s, t), value(u, t), value(u, v), value(s, v)];
        let across = [slope(s, t), -slope(u, t), -slope(u, v), slope(s, v)];
        let down = [slope(t, s), slope(t, u), -slope(v, u), -slope(v, s)];
        let mut sum = Node::default();
        for corner in 0..4 {
            for (node, weight) in [
                (&self.corners[corner], values[corner]),
                (&self.across[corner], across[corner]),
                (&self.down[corner], down[corner]),
            ] {
                sum.origin += node.origin * weight;
                sum.direction += node.direction * weight;
            }
        }
        sum
    }
}

impl CoonsPatch {
    /// Evaluates a grid of rays with the given numbers of steps, row by row; the curves along rows are computed once.
    pub fn for_each_row(&self, (across, down): (usize, usize), mut take: impl FnMut(usize, &[Ray])) {
        let share = |index: usize, steps: usize| index as f64 / steps as f64;
        let [a, b, c, d] = self.corners;
        let along: Vec<(f64, Node, Node)> = (0..=across)
            .map(|i| {
                let s = share(i, across);
                let bottom = hermite(a, self.across[0], b, self.across[1], s);
                let top = hermite(d, self.across[3], c, self.across[2], s);
                (s, bottom, top)
            })
            .collect();
        let mut row = Vec::with_capacity(across + 1);
        for j in 0..=down {
            let t = share(j, down);
            // The side curves, without the part that the rows' curves contain already.
            let left = hermite(a, self.down[0], d, self.down[3], t)
                .plus(a.times(t - 1.0))
                .plus(d.times(-t));
            let right = hermite(b, self.down[1], c, self.down[2], t)
                .plus(b.times(t - 1.0))
                .plus(c.times(-t));
            row.clear();
            row.extend(along.iter().map(|&(s, bottom, top)| Ray {
                origin: bottom.origin * (1.0 - t)
                    + top.origin * t
                    + left.origin * (1.0 - s)
                    + right.origin * s,
                direction: bottom.direction * (1.0 - t)
                    + top.direction * t
                    + left.direction * (1.0 - s)
                    + right.direction * s,
            }));
            take(j, &row);
        }
    }
}

/// The cubic between two nodes with given slopes.
fn hermite(from: Node, from_slope: Node, to: Node, to_slope: Node, s: f64) -> Node {
    let u = 1.0 - s;
    from.times(u * u * (1.0 + 2.0 * s))
        .plus(to.times(s * s * (1.0 + 2.0 * u)))
        .plus(from_slope.times(s * u * u))
        .plus(to_slope.times(-s * s * u))
}

impl BezierTriangle {
    fn node(&self, s: f64, t: f64) -> Node {
        let (a, b, c) = (1.0 - s - t, s, t);
        let weights = [
            a * a * a,
            b * b * b,
            c * c * c,
            3.0 * a * a * b,
            3.0 * a * b * b,
            3.0 * b * b * c,
            3.0 * b * c * c,
            3.0 * c * c * a,
            3.0 * c * a * a,
            6.0 * a * b * c,
        ];
        let mut sum = Node::default();
        for (node, weight) in self.control.iter().zip(weights) {
            sum.origin += node.origin * weight;
            sum.direction += node.direction * weight;
        }
        sum
    }
}
