//! Divides the squares of a light until photons cost no more than finer squares would.

use std::collections::{BTreeSet, HashSet};
use std::sync::Arc;

use glam::DVec2;
use rayon::prelude::*;

use super::bundle::{Bundle, MEAN_WEIGHTS, NEAREST_WEIGHTS, Node, Shape, biquadratic};
use super::domain::{DomainPoint, LAST_LEVEL, LitCells, PointHash, SquarePlace};
use super::image::Image;
use super::paths::{PathEnd, PathFinder, PointPaths, Route};
use super::squares::{Found, Guide, Plan, Points, Residual, Square, Squares};
use super::subcell_features::SubcellFeatures;
use crate::progress::Control;

/// The finest level of squares around small casters and openings, and how many squares there are at most until these
/// are found.
const FINEST_SOUGHT: u32 = 20;
const MAX_SOUGHT: usize = 1 << 16;

/// Approximate limit on the squares of a light, each of some kilobytes.
const MAX_SQUARES: usize = 1 << 18;

/// Rounds of division.
const MAX_ROUNDS: usize = 12;

/// A square is divided if its photons take more segments than this many points do; a division takes 12 to 16.
const DIVISION_COST: f64 = 40.0;

/// Division of a square reduces the displacement of its predictions by up to 8. That of a child is its parent's
/// deviation from the child's new points over this; audits by photons show 0.1 to 3 times as much.
const GAIN_OF_DIVISION: f64 = 6.0;

/// Maximum number of photons of the first level, and the least and most of a later one relative to the level before.
const FIRST_PHOTONS: f64 = 1e5;
const GROWTH: (f64, f64) = (1.25, 8.0);

/// A division replaces what photons found by the plan, unless they found a variance so much larger.
const SURPRISE: f64 = 4.0;

/// Part of a path's photons that a cut square leaves to them: of a square with the side 1, and at least.
const LEFT_BY_CUT: (f64, f64) = (0.3, 0.004);

/// The same of a square that is not cut.
const LEFT_UNCUT: f64 = 0.4;

/// The same of a square with so many edges that cuts miss some of them.
const LEFT_BY_MANY_CUTS: (usize, f64) = (8, 0.5);

/// Paths that photons compare themselves with, and that lead them.
const MAX_BUNDLES: usize = 48;
const MAX_GUIDES: usize = 64;

/// Expected squared change of a map for a photon of unit flux whose prediction is displaced: by tents over two texels,
/// per squared texel of displacement along an axis, averaged over places.
const TENT_SQUARE: f64 = 4.0 / 3.0;

/// Probability that two places lie in different texels, per texel between them, averaged over directions: 4/π.
const CROSSINGS: f64 = 1.27;

/// Builds squares.
pub(super) struct Surveyor<'a> {
    finder: PathFinder<'a>,
    control: &'a Control,
    lit: LitCells,
    /// What the first squares might miss.
    sought: Option<&'a SubcellFeatures>,
}

impl<'a> Surveyor<'a> {
    pub(super) fn new(
        finder: PathFinder<'a>,
        control: &'a Control,
        sought: Option<&'a SubcellFeatures>,
    ) -> Self {
        Self {
            lit: LitCells::of(finder.launch),
            finder,
            control,
            sought,
        }
    }

    /// Divides squares for a goal, the relative root mean square error of all maps together.
    pub(super) fn refine(&self, squares: &mut Squares, goal: f64) {
        // Later levels refine the squares of earlier ones; the first starts from an even division, finer around small
        // casters.
        if squares.squares.is_empty() {
            let places = self.with_small_casters(self.lit.first());
            let nodes = places
                .iter()
                .flat_map(|place| (0..9).map(|node| place.node(node)));
            self.trace_points(nodes, &mut squares.points);
            let points = &squares.points;
            let square = |&place| self.square(place, points, None);
            squares.squares = places.par_iter().map(square).collect();
        }
        for round in 0..=MAX_ROUNDS {
            // Each round plans anew, since finer squares leave less to photons. Where no bundle carries light, finer
            // squares would save nothing.
            mark_beside_edges(&mut squares.squares);
            squares.plan = self.plan(squares, goal);
            let plan = squares.plan;
            let is_last = round == MAX_ROUNDS || squares.squares.len() > MAX_SQUARES;
            if is_last || plan.per_root.is_infinite() || self.control.is_cancelled() {
                break;
            }
            let divided: Vec<bool> = squares
                .squares
                .iter()
                .map(|square| is_worth_dividing(square, &plan))
                .collect();
            if !divided.contains(&true) {
                break;
            }
            self.divide(squares, &divided);
        }

        // Emitted flux of the squares that are looked at closely. Audits take at least a small part of it to arrive: of
        // a receiver seen edge-on, hardly any does.
        let close = squares
            .squares
            .iter()
            .filter(|square| square.is_looked_at_closely());
        squares.plan.close_start_w = close.map(|square| square.start_w).sum();
    }

    /// Replaces squares by their quarters.
    fn divide(&self, squares: &mut Squares, divided: &[bool]) {
        // A division adds the points of a grid of five by five that are not among the nine.
        let new_points = squares
            .squares
            .iter()
            .zip(divided)
            .filter(|(_, divided)| **divided)
            .flat_map(|(square, _)| {
                let place = square.place;
                (0..25)
                    .filter(|n| n % 5 % 2 == 1 || n / 5 % 2 == 1)
                    .map(move |n| place.point(n % 5, n / 5, 4))
            });
        self.trace_points(new_points, &mut squares.points);

        // Quarters take their parent's place, so that neighbours stay together; those without light are dropped.
        let points = &squares.points;
        let quarters_of = |square: &Square| -> Vec<Square> {
            let quarters = square.place.quarters().into_iter();
            let lit = quarters.filter(|place| self.lit.has(*place));
            lit.map(|place| self.square(place, points, Some(square)))
                .collect()
        };
        let before = std::mem::take(&mut squares.squares);
        let after = before
            .into_par_iter()
            .zip(divided)
            .flat_map_iter(|(square, is_divided)| {
                if *is_divided {
                    quarters_of(&square)
                } else {
                    vec![square]
                }
            });
        squares.squares = after.collect();
    }

    /// Divides the first squares until small casters and openings are as large as the squares around them.
    fn with_small_casters(&self, mut places: Vec<SquarePlace>) -> Vec<SquarePlace> {
        let (Some(sought), Some(launch)) = (self.sought, self.finder.launch.of_faces()) else {
            return places;
        };
        let Some(first) = places.first().map(|place| place.level) else {
            return places;
        };
        for level in first..FINEST_SOUGHT {
            let is_divided = |place: &SquarePlace| {
                let square = (place.at(DVec2::ZERO), place.at(DVec2::ONE));
                let root = place.corner.root as usize;
                place.level == level && sought.ask_for_finer(launch, root, square, level - first)
            };
            let before = places.len();
            let of_place = |place: SquarePlace| -> Vec<SquarePlace> {
                if !is_divided(&place) {
                    return vec![place];
                }
                let quarters = place.quarters().into_iter();
                quarters.filter(|quarter| self.lit.has(*quarter)).collect()
            };
            places = places.into_par_iter().flat_map_iter(of_place).collect();
            if places.len() == before || places.len() > MAX_SOUGHT {
                break;
            }
        }
        places
    }

    /// Traces the points that are not known yet, neighbours one after the other.
    fn trace_points(&self, wanted: impl Iterator<Item = DomainPoint>, points: &mut Points) {
        let new: HashSet<DomainPoint, PointHash> =
            wanted.filter(|point| !points.contains_key(point)).collect();
        let mut new: Vec<DomainPoint> = new.into_iter().collect();
        new.sort_unstable_by_key(|point| (point.root, point.y >> 14, point.x >> 14, point.y, point.x));
        let traced: Vec<(DomainPoint, Arc<PointPaths>)> = new
            .into_par_iter()
            .with_min_len(16)
            .map(|point| {
                // Whoever cancels drops the squares.
                let paths = match self.control.is_cancelled() {
                    true => PointPaths::default(),
                    false => self.finder.paths(point.root as usize, point.square()),
                };
                (point, Arc::new(paths))
            })
            .collect();
        points.extend(traced);
    }

    /// How many photons each square needs, as its bundles and the photons so far tell.
    fn plan(&self, squares: &Squares, goal: f64) -> Plan {
        let mut plan = Plan {
            // Cuts, and roots of variance with them, depend on the plan before; at first all cuts are worth it.
            per_root: match squares.plan.per_root {
                0.0 => f64::INFINITY,
                known => known,
            },
            surprise: squares.surprise,
            ..Plan::default()
        };

        // Light that bundles carry, as it is and weighted by its receivers, and light that none of them follows.
        let mut receivers = BTreeSet::new();
        let (mut weighted_w, mut bundled_w, mut lost_w) = (0.0, 0.0, 0.0);
        for square in &squares.squares {
            plan.start_w += square.start_w;
            bundled_w += square.arriving_w;
            lost_w += square.residual.lost_w;
            for bundle in &square.bundles {
                receivers.insert(bundle.receiver());
                weighted_w += bundle.flux_w * self.finder.receivers.weight(bundle.receiver());
            }
        }

        // Without bundled light, what photons found in the last level tells whether any light arrives.
        plan.goal = goal;
        let by_photons_w = if bundled_w > 0.0 {
            0.0
        } else {
            squares.arrived_w.unwrap_or(0.0)
        };
        let not_bundled_w = lost_w + by_photons_w;
        plan.bundled_part = if not_bundled_w > 0.0 {
            bundled_w / (bundled_w + not_bundled_w)
        } else {
            1.0
        };
        plan.arriving_w = squares.arrived_w.unwrap_or(bundled_w + lost_w);
        if bundled_w <= 0.0 || plan.arriving_w <= 0.0 {
            return plan;
        }

        // Errors are relative to the mean irradiance of all receivers together: the arriving flux over their area.
        plan.lost_weight = weighted_w / bundled_w;
        let mut area_m2 = 0.0;
        for receiver in receivers {
            if let Some(chart) = self.finder.receivers.get(receiver) {
                area_m2 += chart.area_m2;
                plan.texels += chart.chart.texel_count() as f64;
            }
        }
        plan.relative = area_m2 / (plan.arriving_w * plan.arriving_w);

        // The goal is reached with the fewest segments if photons are in proportion to the root of variance over that
        // of the segments that one takes (Neyman's allocation).
        let sum = |of: &dyn Fn(&Square) -> f64| squares.squares.iter().map(of).sum::<f64>();
        let roots = sum(&|square| square.root(&plan) * square.segments.sqrt());
        plan.per_root = roots * plan.relative / (goal * goal);

        // A level that would take very many photons stops half-way: the next one knows more.
        // One that would take hardly more than the last one tells no more than that.
        let photons = sum(&|square| plan.photons_for(square.root(&plan), square));
        let least = GROWTH.0 * squares.photons;
        let most = (GROWTH.1 * squares.photons).max(FIRST_PHOTONS);
        let allowed = photons.clamp(least, most);
        if photons > 0.0 && allowed != photons {
            plan.per_root *= allowed / photons;
            plan.goal *= (photons / allowed).sqrt();
        }
        plan
    }

    /// The square of a place, whose points are known.
    fn square(&self, place: SquarePlace, points: &Points, parent: Option<&Square>) -> Square {
        // Emission and length of paths vary smoothly: Simpson's rule gives their means.
        let points: [Arc<PointPaths>; 9] = std::array::from_fn(|node| Arc::clone(&points[&place.node(node)]));
        let mean = |value: &dyn Fn(&PointPaths) -> f64| -> f64 {
            points
                .iter()
                .zip(MEAN_WEIGHTS)
                .map(|(point, weight)| weight * value(point))
                .sum()
        };
        let area = place.area();
        let mut square = Square {
            place,
            bundles: Vec::new(),
            guides: Vec::new(),
            start_w: mean(&|point| point.start_w) * area,
            arriving_w: 0.0,
            residual: Residual::default(),
            segments: mean(&|point| point.segments).max(1.0),
            traced: points.iter().map(|point| f64::from(point.traced)).sum::<f64>() / 9.0,
            is_cut: false,
            is_finished: false,
            is_beside_edge: false,
            found: parent.map_or_else(Found::default, inherited),
            points,
        };

        // Every path that any of its points has.
        let mut routes: Vec<Route> = Vec::new();
        for end in square.points.iter().flat_map(|point| &point.ends) {
            if routes.iter().all(|route| route.signature != end.route.signature) {
                routes.push(end.route);
            }
        }

        // Where many paths end in one square, cuts miss some of the edges.
        let is_partial = |route: &Route| {
            square
                .points
                .iter()
                .any(|point| point.end(route.signature).is_none())
        };
        let edges = routes.iter().filter(|route| is_partial(route)).count();
        for route in routes {
            self.add_bundle(&mut square, route, parent, edges);
        }

        // Photons follow a limited number of bundles; the faintest ones are left to them.
        square.bundles.sort_by(|a, b| b.flux_w.total_cmp(&a.flux_w));
        for bundle in square.bundles.drain(MAX_BUNDLES.min(square.bundles.len())..) {
            square.residual.lost_w += bundle.flux_w;
        }

        // Light that was not followed.
        let mut lost: Vec<Guide> = Vec::new();
        for (point, weight) in square.points.iter().zip(NEAREST_WEIGHTS) {
            for &(chain, flux_w) in &point.lost {
                let weight = flux_w * weight * area;
                square.residual.lost_w += weight;
                match lost.iter_mut().find(|guide| guide.chain == chain) {
                    Some(known) => known.weight += weight,
                    None => lost.push(Guide { chain, weight }),
                }
            }
        }
        square.guides.append(&mut lost);
        // Long ways need more photons than they are worth.
        for guide in &mut square.guides {
            guide.weight *= (4.0 / (4.0 + guide.chain.len() as f64)).sqrt();
        }
        square.guides.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        square.guides.truncate(MAX_GUIDES);
        square
    }

    /// Adds the bundle of a path, and what it leaves to photons. `edges`: paths that not all points have.
    fn add_bundle(&self, square: &mut Square, route: Route, parent: Option<&Square>, edges: usize) {
        // Light that only some points have ends abruptly: each of these stands for the area nearest to it.
        let ends: [Option<&PathEnd>; 9] =
            std::array::from_fn(|node| square.points[node].end(route.signature));
        let is_whole = ends.iter().all(Option::is_some);
        let weights = if is_whole { MEAN_WEIGHTS } else { NEAREST_WEIGHTS };
        let mut flux_w = 0.0;
        for (end, weight) in ends.iter().zip(weights) {
            flux_w += end.map_or(0.0, |end| end.flux_w.max_channel()) * weight * square.place.area();
        }
        square.arriving_w += flux_w;

        // What is left to photons is a variance relative to squared flux; its root is added up over paths.
        let mut bundle = Bundle::new(route, flux_w);
        let root = flux_w * self.finder.receivers.weight(route.receiver);
        let left: f64;
        if is_whole {
            // Whole bundles err by their curvature. That of a quarter is told by how well its parent predicted its new
            // points.
            let nodes: [Node; 9] = std::array::from_fn(|node| Node::of(ends[node].expect("all are there")));
            let image = Image::of(&nodes);
            bundle.displaced_texels = parent
                .and_then(|parent| deviation_texels(parent, route, square.place, &nodes))
                .map_or(0.5 * image.bend, |deviation| deviation / GAIN_OF_DIVISION);
            bundle.shape = Shape::Whole(Box::new(nodes));
            bundle.is_smooth = image.is_smooth();
            left = displaced_square(bundle.displaced_texels, bundle.is_smooth);
            square.residual.displaced += root * left.sqrt();
        } else {
            // A straight cut leaves a sliver of a curved edge, a part of the square in proportion to its side.
            let side = (-f64::from(square.place.level)).exp2();
            let of_cut = if edges > LEFT_BY_MANY_CUTS.0 {
                LEFT_BY_MANY_CUTS.1
            } else {
                (LEFT_BY_CUT.0 * side + LEFT_BY_CUT.1).min(0.25)
            };
            // A photon that contradicts its bundle changes two texels.
            square.residual.cut += root * (2.0 * of_cut).sqrt();
            square.residual.uncut += root * (2.0 * LEFT_UNCUT).sqrt();
            left = 2.0 * of_cut;
        }

        // Photons are led along ways on which light is left, and a little along those that seem exact.
        square.guides.push(Guide {
            chain: route.chain,
            weight: flux_w * (left + 0.002).sqrt(),
        });
        square.bundles.push(bundle);
    }
}

/// Whether the photons that finer squares would save are dearer than the points of these.
fn is_worth_dividing(square: &Square, plan: &Plan) -> bool {
    let beside_edges = if square.is_beside_edge {
        plan.audits(square)
    } else {
        0.0
    };
    let photons = plan.photons_for(square.dividable_root(plan), square) + beside_edges;
    let segments = photons * square.segments;
    square.place.level < LAST_LEVEL && segments > DIVISION_COST * square.traced
}

/// Mean squared change of the map, for unit flux, by a photon whose prediction is displaced.
fn displaced_square(texels: f64, is_smooth: bool) -> f64 {
    match texels {
        1.0.. => 2.0,
        _ if is_smooth => TENT_SQUARE * texels * texels,
        // Two texels change if a border lies between both places.
        _ => 2.0 * (CROSSINGS * texels).min(1.0),
    }
}

/// Marks squares beside one that has an edge, of which they may be a quarter as long: those that share one of its
/// points or of the points half-way between.
fn mark_beside_edges(squares: &mut [Square]) {
    let mut on_edges: HashSet<DomainPoint, PointHash> = HashSet::default();
    for square in squares.iter().filter(|square| square.residual.cut > 0.0) {
        on_edges.extend((0..25).map(|point| square.place.point(point % 5, point / 5, 4)));
    }
    for square in squares {
        let is_beside = || (0..9).any(|node| on_edges.contains(&square.place.node(node)));
        square.is_beside_edge = square.residual.cut == 0.0 && is_beside();
    }
}

/// What a quarter takes over of what its parent's photons found: nothing, unless that was a surprise.
fn inherited(parent: &Square) -> Found {
    let Residual { displaced, cut, .. } = parent.residual;
    let planned = displaced + cut;
    if parent.found.variance() > SURPRISE * planned * planned {
        parent.found.of_quarter()
    } else {
        Found::default()
    }
}

/// Largest deviation of the nodes that are new in a square from its parent's interpolation [texels]; `None` if the
/// parent does not have the whole path.
fn deviation_texels(parent: &Square, route: Route, place: SquarePlace, nodes: &[Node; 9]) -> Option<f64> {
    let bundle = parent
        .bundles
        .iter()
        .find(|bundle| bundle.route.signature == route.signature)?;
    let Shape::Whole(old) = &bundle.shape else {
        return None;
    };
    let mut worst = 0.0_f64;
    for node in [1, 3, 4, 5, 7] {
        let within = parent.place.within(place.node(node).square());
        let predicted = biquadratic(old, within).place;
        worst = worst.max((predicted - nodes[node].place.as_dvec2()).abs().max_element());
    }
    Some(worst)
}
