//! Finds the part of a light's domain that lights one texel: squares of the domain are divided until what they light is
//! smaller than the texel, or nothing.

use std::collections::{HashMap, HashSet};

use glam::DVec2;
use rayon::prelude::*;

use super::clip::{is_in_square, share_in_square};
use super::walk::LightPathWalker;
use crate::light_pass::path::PathSignature;
use crate::light_pass::photon::domain::{DomainPoint, LitCells, POINT_BITS, PointHash, SquarePlace};
use crate::optics::LinearSrgb;
use crate::progress::Control;

/// The finest level of squares.
const FINEST: u32 = POINT_BITS - 2;
/// Maximum number of squares at the start of the search.
const FIRST_SQUARES: usize = 60_000;
/// A path that fills a square is resolved if it lights no more than `FINE_TEXELS` across, and the arrival from the
/// square's centre lies within `STRAIGHT_TEXELS` of the mean of those from its corners.
const FINE_TEXELS: f64 = 0.25;
const STRAIGHT_TEXELS: f64 = 0.002;
/// Where the extent of a path is unknown: part of the map by which it may exceed its known arrivals, in squares of the
/// first size. Glass spreads light of many internal reflections widely.
const BEYOND: f64 = 1.0;

/// Light that reaches the receiver over at least one specular surface.
#[derive(Clone, Copy, Debug)]
struct Landing {
    way: PathSignature,
    /// Relative to the texel's corner [texels].
    place: DVec2,
    /// Flux per unit square of the light's domain [W].
    flux_w: LinearSrgb,
}

/// A square that lights part of the texel.
#[derive(Clone, Debug)]
pub(super) struct LitSquare {
    pub(super) way: PathSignature,
    pub(super) square: SquarePlace,
    /// A point of it, whose ray lands on the texel if any is known to do, and where that is [texels].
    pub(super) point: DomainPoint,
    pub(super) place: DVec2,
    /// Flux on the texel [W].
    pub(super) flux_w: LinearSrgb,
}

/// All squares that light the texel.
#[derive(Clone, Debug, Default)]
pub(super) struct SearchResult {
    pub(super) pieces: Vec<LitSquare>,
    pub(super) rays: u64,
    /// False if cancelled, or if more rays were needed than allowed.
    pub(super) is_complete: bool,
}

/// What is known of points.
type Known = HashMap<DomainPoint, Vec<Landing>, PointHash>;

/// A square, and the paths that need no further search in it.
#[derive(Clone, Debug)]
struct OpenSquare {
    square: SquarePlace,
    done: Vec<PathSignature>,
}

/// The four corners in order around a square, and its centre.
fn points(square: SquarePlace) -> [DomainPoint; 5] {
    let [a, b, c, d] = square.corners();
    [a, b, c, d, square.node(4)]
}

/// Verdict on one path in a square.
enum Verdict {
    /// It lights no part of the texel.
    Away,
    /// It is resolved; `None` if it brings no light.
    Done(Option<LitSquare>),
    /// The square has to be divided.
    Divide,
}

/// A search for the light of one point of a lamp.
pub(super) struct TexelSearch<'a> {
    pub(super) walker: LightPathWalker<'a>,
    /// Flux on the texel that may be neglected [W].
    pub(super) negligible_w: f64,
    pub(super) control: &'a Control,
}

impl TexelSearch<'_> {
    pub(super) fn search(&self) -> SearchResult {
        let mut found = SearchResult::default();
        let mut known = Known::default();
        let first = LitCells::of(self.walker.launch).fine(FIRST_SQUARES);
        let level = first.first().map_or(0, |square| square.level);
        let open = |square: SquarePlace| OpenSquare {
            square,
            done: Vec::new(),
        };
        let mut squares: Vec<OpenSquare> = first.into_iter().map(open).collect();
        while !squares.is_empty() {
            if self.control.is_cancelled() || found.rays > self.walker.limits.most_rays {
                return found;
            }
            found.rays += self.examine(&squares, &mut known);
            let judged: Vec<(Vec<LitSquare>, Vec<OpenSquare>)> = squares
                .par_iter()
                .map(|square| self.judge(square, level, &known))
                .collect();
            squares.clear();
            for (pieces, quarters) in judged {
                found.pieces.extend(pieces);
                squares.extend(quarters);
            }
        }
        found.is_complete = true;
        found
    }

    /// Traces the rays of all new points; returns their number.
    fn examine(&self, squares: &[OpenSquare], known: &mut Known) -> u64 {
        let wanted = squares.iter().flat_map(|open| points(open.square));
        let new: HashSet<DomainPoint, PointHash> =
            wanted.filter(|point| !known.contains_key(point)).collect();
        let mut new: Vec<DomainPoint> = new.into_iter().collect();
        new.par_sort_unstable();
        let of_point = |&point: &DomainPoint| {
            let mut found = Vec::new();
            self.walker
                .walk(point.root as usize, point.off_border(), |arrival, place, _| {
                    found.push(Landing {
                        way: arrival.signature,
                        place,
                        flux_w: arrival.flux_w,
                    });
                });
            (point, found)
        };
        let traced: Vec<(DomainPoint, Vec<Landing>)> = new.par_iter().map(of_point).collect();
        known.extend(traced);
        new.len() as u64
    }

    fn judge(&self, open: &OpenSquare, first: u32, known: &Known) -> (Vec<LitSquare>, Vec<OpenSquare>) {
        let landings = points(open.square).map(|point| &known[&point][..]);
        let mut ways: Vec<PathSignature> = landings.iter().copied().flatten().map(|a| a.way).collect();
        ways.sort_unstable();
        ways.dedup();
        ways.retain(|way| !open.done.contains(way));
        let (mut pieces, mut quarters) = (Vec::new(), Vec::new());
        let mut done = open.done.clone();
        let mut is_divided = false;
        for way in ways {
            let at = landings.map(|landings| landings.iter().find(|landing| landing.way == way));
            match self.judge_way(open.square, first, way, at) {
                Verdict::Divide => is_divided = true,
                Verdict::Away => done.push(way),
                Verdict::Done(found) => {
                    pieces.extend(found);
                    done.push(way);
                }
            }
        }
        if is_divided {
            quarters.extend(open.square.quarters().map(|square| OpenSquare {
                square,
                done: done.clone(),
            }));
        }
        (pieces, quarters)
    }

    fn judge_way(
        &self,
        square: SquarePlace,
        first: u32,
        way: PathSignature,
        at: [Option<&Landing>; 5],
    ) -> Verdict {
        // Bounds of where the path is known to land, and its bend: how far it strays from them between the points.
        let there: Vec<&Landing> = at.into_iter().flatten().collect();
        let is_whole = there.len() == at.len();
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (low, high) = there.iter().fold(start, |(low, high), landing| {
            (low.min(landing.place), high.max(landing.place))
        });
        let extent = (high - low).max_element();
        let bend = match at {
            [Some(a), Some(b), Some(c), Some(d), Some(middle)] => {
                ((a.place + b.place + c.place + d.place) * 0.25 - middle.place)
                    .abs()
                    .max_element()
            }
            // The extent is unknown, but smaller with each division.
            _ => {
                let chart = &self.walker.target.chart;
                let map_texels = chart.width.max(chart.height) as f64 / self.walker.target.size as f64;
                (BEYOND * map_texels * (-f64::from(square.level - first)).exp2()).max(extent)
            }
        };

        // A path that stays clear of the texel needs no finer squares.
        let margin = DVec2::splat(2.0 * bend + 0.25 * extent);
        let is_near = (low - margin).cmplt(DVec2::ONE).all() && (high + margin).cmpgt(DVec2::ZERO).all();
        if !(is_near || extent.is_nan()) {
            return Verdict::Away;
        }

        // A straight and fine piece is integrated over triangles, a negligible one estimated from its points; any other
        // is divided.
        let brightest = there
            .iter()
            .map(|landing| landing.flux_w.luminance())
            .fold(0.0, f64::max);
        let is_negligible = brightest * square.area() <= self.negligible_w || square.level >= FINEST;
        let is_smooth = is_whole && extent <= FINE_TEXELS && bend <= STRAIGHT_TEXELS;
        let (flux_w, point) = match at {
            [Some(a), Some(b), Some(c), Some(d), Some(middle)] if is_smooth => {
                (whole([a, b, c, d], middle), 4)
            }
            _ if is_negligible => part(at),
            _ => return Verdict::Divide,
        };

        // The piece is drawn by a ray that lands near the texel, if any is known.
        let piece = at[point].map(|landing| LitSquare {
            way,
            square,
            point: points(square)[point],
            place: landing.place,
            flux_w: flux_w * square.area(),
        });
        Verdict::Done(piece.filter(|_| flux_w.max_channel() > 0.0))
    }
}

/// Flux on the texel per unit square, of a square that one path fills: four triangles around its centre.
fn whole(corners: [&Landing; 4], middle: &Landing) -> LinearSrgb {
    let mut flux_w = LinearSrgb::BLACK;
    for (number, from) in corners.into_iter().enumerate() {
        let to = corners[(number + 1) % 4];
        let share = share_in_square([from.place, to.place, middle.place]);
        flux_w += (from.flux_w + to.flux_w + middle.flux_w) * (share / 12.0);
    }
    flux_w
}

/// The same of a square that a path fills in part, estimated from its points, with the number of one that lands on the
/// texel.
fn part(at: [Option<&Landing>; 5]) -> (LinearSrgb, usize) {
    let (mut flux_w, mut point) = (LinearSrgb::BLACK, 0);
    for (number, landing) in at.into_iter().enumerate() {
        if let Some(landing) = landing.filter(|landing| is_in_square(landing.place)) {
            flux_w += landing.flux_w * 0.2;
            point = number;
        }
    }
    (flux_w, point)
}
