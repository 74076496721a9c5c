//! Cuts the squares that only a part of has a path, along the edge of that part.
//!
//! A square is a fan of eight triangles around its centre. Where some corners of a triangle have the path, its sides
//! are bisected between those that do and those that do not, and the triangle is cut there. What a straight cut between
//! two brackets leaves of a curved edge is left to photons.

use std::sync::Arc;

use glam::{DVec2, Vec2};
use rayon::prelude::*;

use super::bundle::{Node, OriginShift, Piece, Shape};
use super::domain::DomainPoint;
use super::paths::{PathFinder, PointPaths};
use super::squares::{Plan, Points, Square, Squares};
use crate::light_pass::pass_report::PassReport;
use crate::light_pass::path::PathSignature;
use crate::progress::Control;

/// Bisections of a side. Fewer leave a visible error on a mirror's rim; each further one halves what is left.
const BISECTIONS: u32 = 7;

/// The nodes around the centre of a square, in order.
const AROUND: [usize; 8] = [0, 1, 2, 5, 8, 7, 6, 3];
const CENTRE: usize = 4;

/// Squares that share the points of their bisections.
const SQUARES_AT_ONCE: usize = 32;

/// Cuts squares, and finds how their bundles move with lamp and wavelength.
pub(super) fn finish(finder: &PathFinder, squares: &mut Squares, control: &Control, report: &mut PassReport) {
    let Squares {
        squares,
        points,
        plan,
        ..
    } = squares;

    // Neighbouring squares bisect the same sides: within a chunk, each point is traced once.
    let chunks = squares.par_chunks_mut(SQUARES_AT_ONCE);
    let traced: Vec<(u64, u64)> = chunks
        .map(|squares| {
            let mut cutter = Cutter {
                finder,
                shared: points,
                own: Points::default(),
            };

            // Counts the rays from other points of the lamp and at other wavelengths, and those of the bisections.
            let mut more = (0, 0);
            for square in squares {
                if control.is_cancelled() {
                    break;
                }
                let (rays, segments) = cutter.finish(square, plan);
                more = (more.0 + rays, more.1 + segments);
            }
            for paths in cutter.own.values() {
                more = (more.0 + 1, more.1 + u64::from(paths.traced));
            }
            more
        })
        .collect();
    for (rays, segments) in traced {
        report.rays += rays;
        report.segments += segments;
    }
}

struct Cutter<'a, 'f> {
    finder: &'a PathFinder<'f>,
    shared: &'a Points,
    /// Points of bisections.
    own: Points,
}

impl Cutter<'_, '_> {
    /// Finishes a square. Returns rays and segments traced for lamp and wavelengths.
    fn finish(&mut self, square: &mut Square, plan: &Plan) -> (u64, u64) {
        let is_cut = square.is_cut || plan.is_worth_a_cut(square);
        if square.is_finished && is_cut == square.is_cut {
            return (0, 0);
        }
        for bundle in 0..square.bundles.len() {
            let signature = square.bundles[bundle].route.signature;
            if square.points.iter().any(|point| point.end(signature).is_none()) {
                let pieces = self.pieces(square, signature, is_cut);
                square.bundles[bundle].shape = if pieces.is_empty() {
                    Shape::Nothing
                } else {
                    Shape::Cut(pieces)
                };
            }
        }
        square.is_cut = is_cut;
        if std::mem::replace(&mut square.is_finished, true) {
            return (0, 0);
        }
        self.measure_shifts(square)
    }

    /// Finds how bundles move with lamp and wavelength; those of which that is not known are left to photons.
    fn measure_shifts(&self, square: &mut Square) -> (u64, u64) {
        let mut traced = (0, 0);
        let mut left: Vec<usize> = (0..square.bundles.len()).collect();
        // At the centre or, of a path that only a part of the square has, where else it is.
        for node in [CENTRE].into_iter().chain(AROUND) {
            let point = Arc::clone(&square.points[node]);
            let is_sought = |bundle: &usize| {
                let signature = square.bundles[*bundle].route.signature;
                let is_missing = |point: &Arc<PointPaths>| point.end(signature).is_none();
                node == CENTRE || (!is_missing(&point) && square.points.iter().any(is_missing))
            };
            if !left.iter().any(is_sought) {
                continue;
            }
            let place = square.place.node(node);
            let lamp_sides = self.finder.at_lamp_sides(place.root as usize, place.square());
            let spectrum_ends = self.finder.at_spectrum_ends(place.root as usize, place.square());
            if lamp_sides.is_none() && spectrum_ends.is_none() {
                return traced;
            }
            for paths in lamp_sides.iter().chain(&spectrum_ends).flatten() {
                traced = (traced.0 + 1, traced.1 + u64::from(paths.traced));
            }
            left.retain(|&bundle| {
                let bundle = &mut square.bundles[bundle];
                let shift = point
                    .end(bundle.route.signature)
                    .and_then(|end| OriginShift::measured(end, lamp_sides.as_ref(), spectrum_ends.as_ref()));
                if let Some(shift) = shift {
                    bundle.shift = shift;
                    bundle.is_smooth |= shift.is_smooth();
                }
                shift.is_none()
            });
        }
        left.into_iter().for_each(|bundle| square.give_up(bundle));
        traced
    }

    /// The parts of a square that have a path.
    fn pieces(&mut self, square: &Square, signature: PathSignature, is_cut: bool) -> Vec<Piece> {
        // The square is a fan of triangles around its centre, in each of which place and flux are linear.
        let node = |node: usize| square.points[node].end(signature).map(Node::of);
        let within = |node: usize| square.place.within(square.place.node(node).square()).as_vec2();
        let mut pieces = Vec::new();
        for (number, &first) in AROUND.iter().enumerate() {
            let corners = [CENTRE, first, AROUND[(number + 1) % AROUND.len()]];
            let nodes = corners.map(node);
            let places = corners.map(within);

            // A triangle whose corners disagree has the edge of the path across it. Uncut, it is left to photons.
            match nodes {
                [Some(a), Some(b), Some(c)] => pieces.push(Piece {
                    corners: places,
                    nodes: [a, b, c],
                }),
                [None, None, None] => {}
                _ if !is_cut => {}
                _ => {
                    let has = nodes.map(|node| node.is_some());
                    let count = has.iter().filter(|has| **has).count();
                    // The corner that differs from both others, and these.
                    let odd = has
                        .iter()
                        .position(|has| *has == (count == 1))
                        .expect("one corner differs");
                    let (next, last) = ((odd + 1) % 3, (odd + 2) % 3);
                    let mut cut =
                        |from: usize, to: usize| self.cut(square, signature, [corners[from], corners[to]]);

                    // The part that has the path is a triangle at one corner, or a quadrilateral along two of them.
                    if count == 1 {
                        let (second, third) = (cut(odd, next), cut(odd, last));
                        pieces.push(Piece {
                            corners: [places[odd], second.0, third.0],
                            nodes: [nodes[odd].expect("it has the path"), second.1, third.1],
                        });
                    } else {
                        let (second, third) = (cut(next, odd), cut(last, odd));
                        let [a, b] = [next, last].map(|corner| nodes[corner].expect("it has the path"));
                        pieces.push(Piece {
                            corners: [places[next], places[last], second.0],
                            nodes: [a, b, second.1],
                        });
                        pieces.push(Piece {
                            corners: [places[last], third.0, second.0],
                            nodes: [b, third.1, second.1],
                        });
                    }
                }
            }
        }
        pieces
    }

    /// Where the path ends between a node that has it and one that does not, with the last light on it.
    fn cut(&mut self, square: &Square, signature: PathSignature, nodes: [usize; 2]) -> (Vec2, Node) {
        let [mut inside, mut outside] = nodes.map(|node| square.place.node(node));
        let mut light = square.points[nodes[0]]
            .end(signature)
            .map(Node::of)
            .expect("it has the path");
        for _ in 0..BISECTIONS {
            let Some(middle) = middle(inside, outside) else {
                break;
            };
            match self.paths(middle).end(signature) {
                Some(end) => {
                    light = Node::of(end);
                    inside = middle;
                }
                None => outside = middle,
            }
        }
        let edge: DVec2 = 0.5 * (inside.square() + outside.square());
        (square.place.within(edge).as_vec2(), light)
    }

    fn paths(&mut self, point: DomainPoint) -> &PointPaths {
        if let Some(known) = self.shared.get(&point) {
            return known;
        }
        let finder = self.finder;
        self.own
            .entry(point)
            .or_insert_with(|| Arc::new(finder.paths(point.root as usize, point.square())))
    }
}

/// The point half-way between two; `None` if they are too close.
fn middle(a: DomainPoint, b: DomainPoint) -> Option<DomainPoint> {
    let is_even = ((a.x ^ b.x) | (a.y ^ b.y)) & 1 == 0;
    is_even.then(|| DomainPoint {
        root: a.root,
        x: (a.x + b.x) / 2,
        y: (a.y + b.y) / 2,
    })
}
