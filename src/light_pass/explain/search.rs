//! Finds the part of a light's domain that lights one texel: cells of the domain are halved until what they light is
//! smaller than the texel, or nothing.

use std::collections::HashMap;

use glam::DVec2;
use rayon::prelude::*;

use super::clip::{is_in_square, share_in_square};
use super::walk::{Arrival, LightPathWalker};
use crate::light_pass::item_buffer::{CELLS_PER_SIDE, ItemBuffer};
use crate::light_pass::path::PathSignature;
use crate::optics::LinearSrgb;
use crate::progress::Control;

/// Subdivisions of the domain's side to the steps in which corners are counted.
const FINEST: u32 = 30;
/// Subdivisions to the item buffer's cells.
const BUFFER: u32 = CELLS_PER_SIDE.trailing_zeros();
/// Maximum number of cells at the start of the search.
const FIRST_CELLS: u64 = 60_000;
/// Maximum number of subdivisions of the domain's side for these.
const MAX_FIRST: u32 = 16;
/// A path that fills a cell is resolved if it lights no more than `FINE_TEXELS` across, and the arrival from the cell's
/// centre lies within `STRAIGHT_TEXELS` of the mean of those from its corners.
const FINE_TEXELS: f64 = 0.25;
const STRAIGHT_TEXELS: f64 = 0.002;
/// Where the extent of a path is unknown: part of the map by which it may exceed its known arrivals, in cells of the
/// first size. Glass spreads light of many internal reflections widely.
const BEYOND: f64 = 1.0;

/// Inset of rays from the border of the domain, which may coincide with the border of a surface.
const MARGIN: f64 = 1e-9;

/// A cell that lights part of the texel.
#[derive(Clone, Debug)]
pub(super) struct LitCell {
    pub(super) way: PathSignature,
    pub(super) face: usize,
    /// Corners of the cell, in steps of 2⁻³⁰.
    pub(super) corners: [[u64; 2]; 4],
    /// A ray of it, in the unit square, and where that lands [texels]; one that lands on the texel if any is known.
    pub(super) ray: DVec2,
    pub(super) place: DVec2,
    /// Flux on the texel [W].
    pub(super) flux_w: LinearSrgb,
}

impl LitCell {
    /// Side of the cell in the unit square.
    pub(super) fn side(&self) -> f64 {
        square(self.corners[3]).x - square(self.corners[0]).x
    }
}

/// All cells that light the texel.
#[derive(Clone, Debug, Default)]
pub(super) struct SearchResult {
    pub(super) pieces: Vec<LitCell>,
    pub(super) rays: u64,
    /// False if cancelled, or if more rays were needed than allowed.
    pub(super) is_complete: bool,
}

type Point = (usize, [u64; 2]);

#[derive(Clone, Debug)]
struct Cell {
    face: usize,
    level: u32,
    at: [u64; 2],
    /// Paths that need no further search.
    done: Vec<PathSignature>,
}

impl Cell {
    fn side(&self) -> u64 {
        1 << (FINEST - self.level)
    }

    /// The four corners and the centre.
    fn points(&self) -> [[u64; 2]; 5] {
        let (side, [x, y]) = (self.side(), self.at);
        let middle = side / 2;
        [
            [x, y],
            [x + side, y],
            [x, y + side],
            [x + side, y + side],
            [x + middle, y + middle],
        ]
    }

    fn halves(&self, done: &[PathSignature]) -> [Self; 4] {
        let half = self.side() / 2;
        [[0, 0], [half, 0], [0, half], [half, half]].map(|[x, y]| Self {
            face: self.face,
            level: self.level + 1,
            at: [self.at[0] + x, self.at[1] + y],
            done: done.to_vec(),
        })
    }
}

fn square(point: [u64; 2]) -> DVec2 {
    let side = (1_u64 << FINEST) as f64;
    let at = DVec2::new(point[0] as f64, point[1] as f64) / side;
    at.clamp(DVec2::splat(MARGIN), DVec2::splat(1.0 - MARGIN))
}

/// Verdict on one path in a cell.
enum CellVerdict {
    /// It lights no part of the texel.
    Away,
    /// It is resolved.
    Done(Vec<LitCell>),
    /// The cell has to be subdivided.
    Halve,
}

/// A search for one wavefront.
pub(super) struct TexelSearch<'a> {
    pub(super) walker: LightPathWalker<'a>,
    pub(super) item_buffer: &'a ItemBuffer,
    /// Flux on the texel that may be neglected [W].
    pub(super) negligible_w: f64,
    pub(super) most_rays: u64,
    pub(super) control: &'a Control,
}

impl TexelSearch<'_> {
    pub(super) fn search(&self) -> SearchResult {
        let mut found = SearchResult::default();
        let mut known: HashMap<Point, Vec<Arrival>> = HashMap::new();
        let mut cells = self.first_cells();
        let first = cells.first().map_or(0, |cell| cell.level);
        while !cells.is_empty() {
            if self.control.is_cancelled() || found.rays > self.most_rays {
                return found;
            }
            found.rays += self.look(&cells, &mut known);
            let judged: Vec<(Vec<LitCell>, Vec<Cell>)> = cells
                .par_iter()
                .map(|cell| self.judge(cell, first, &known))
                .collect();
            cells.clear();
            for (pieces, halves) in judged {
                found.pieces.extend(pieces);
                cells.extend(halves);
            }
        }
        found.is_complete = true;
        found
    }

    /// Marked cells, as small as [`FIRST_CELLS`] allows.
    fn first_cells(&self) -> Vec<Cell> {
        let mut marked = Vec::new();
        for face in 0..self.walker.launch.face_count() {
            for row in 0..CELLS_PER_SIDE {
                let columns =
                    (0..CELLS_PER_SIDE).filter(|column| self.item_buffer.is_marked(face, *column, row));
                marked.extend(columns.map(|column| Cell {
                    face,
                    level: BUFFER,
                    at: [column as u64, row as u64].map(|at| at << (FINEST - BUFFER)),
                    done: Vec::new(),
                }));
            }
        }
        while !marked.is_empty() && 4 * marked.len() as u64 <= FIRST_CELLS && marked[0].level < MAX_FIRST {
            marked = marked.iter().flat_map(|cell| cell.halves(&[])).collect();
        }
        marked
    }

    /// Traces the rays of all new points; returns their number.
    fn look(&self, cells: &[Cell], known: &mut HashMap<Point, Vec<Arrival>>) -> u64 {
        let points = cells
            .iter()
            .flat_map(|cell| cell.points().map(|point| (cell.face, point)));
        let mut new: Vec<Point> = points.filter(|point| !known.contains_key(point)).collect();
        new.par_sort_unstable();
        new.dedup();
        let traced: Vec<Vec<Arrival>> = new
            .par_iter()
            .map(|&(face, point)| self.walker.arrivals(face, square(point)))
            .collect();
        let rays = new.len() as u64;
        known.extend(new.into_iter().zip(traced));
        rays
    }

    fn judge(
        &self,
        cell: &Cell,
        first: u32,
        known: &HashMap<Point, Vec<Arrival>>,
    ) -> (Vec<LitCell>, Vec<Cell>) {
        let arrivals = cell.points().map(|point| &known[&(cell.face, point)][..]);
        let mut ways: Vec<PathSignature> = arrivals.iter().copied().flatten().map(|a| a.way).collect();
        ways.sort_unstable();
        ways.dedup();
        ways.retain(|way| !cell.done.contains(way));
        let (mut pieces, mut halves) = (Vec::new(), Vec::new());
        let mut done = cell.done.clone();
        let mut must_halve = false;
        for way in ways {
            let at = arrivals.map(|arrivals| arrivals.iter().find(|arrival| arrival.way == way));
            match self.judge_way(cell, first, way, at) {
                CellVerdict::Halve => must_halve = true,
                CellVerdict::Away => done.push(way),
                CellVerdict::Done(found) => {
                    pieces.extend(found);
                    done.push(way);
                }
            }
        }
        if must_halve {
            halves.extend(cell.halves(&done));
        }
        (pieces, halves)
    }

    fn judge_way(
        &self,
        cell: &Cell,
        first: u32,
        way: PathSignature,
        at: [Option<&Arrival>; 5],
    ) -> CellVerdict {
        let there: Vec<&Arrival> = at.into_iter().flatten().collect();
        let is_whole = there.len() == at.len();
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (low, high) = there.iter().fold(start, |(low, high), arrival| {
            (low.min(arrival.place), high.max(arrival.place))
        });
        let extent = (high - low).max_element();
        let bend = match at {
            [Some(a), Some(b), Some(c), Some(d), Some(middle)] => {
                ((a.place + b.place + c.place + d.place) * 0.25 - middle.place)
                    .abs()
                    .max_element()
            }
            // The extent is unknown, but smaller with each subdivision.
            _ => {
                let chart = &self.walker.target.chart;
                let map_texels = chart.width.max(chart.height) as f64 / self.walker.target.size as f64;
                (BEYOND * map_texels * (-f64::from(cell.level - first)).exp2()).max(extent)
            }
        };
        let margin = DVec2::splat(2.0 * bend + 0.25 * extent);
        let is_near = (low - margin).cmplt(DVec2::ONE).all() && (high + margin).cmpgt(DVec2::ZERO).all();
        if !(is_near || extent.is_nan()) {
            return CellVerdict::Away;
        }
        let side = cell.side() as f64 / (1_u64 << FINEST) as f64;
        let brightest = there
            .iter()
            .map(|arrival| arrival.flux_w.luminance())
            .fold(0.0, f64::max);
        let is_negligible = brightest * side * side <= self.negligible_w || cell.level + 2 > FINEST;
        let is_smooth = is_whole && extent <= FINE_TEXELS && bend <= STRAIGHT_TEXELS;
        if is_smooth {
            CellVerdict::Done(self.whole(cell, way, at, side))
        } else if is_negligible {
            CellVerdict::Done(self.parts(cell, way, at, side))
        } else {
            CellVerdict::Halve
        }
    }

    /// The light of a cell that one path fills: four triangles around its centre.
    fn whole(&self, cell: &Cell, way: PathSignature, at: [Option<&Arrival>; 5], side: f64) -> Vec<LitCell> {
        let [Some(a), Some(b), Some(c), Some(d), Some(middle)] = at else {
            return Vec::new();
        };
        let mut flux_w = LinearSrgb::BLACK;
        for (from, to) in [(a, b), (b, d), (d, c), (c, a)] {
            let share = share_in_square([from.place, to.place, middle.place]);
            let density = (from.flux_w + to.flux_w + middle.flux_w) * (1.0 / 3.0);
            flux_w += density * (0.25 * side * side * share);
        }
        self.piece(cell, way, (4, middle.place), flux_w)
    }

    /// The light of a cell that a path fills in part, estimated from its points.
    fn parts(&self, cell: &Cell, way: PathSignature, at: [Option<&Arrival>; 5], side: f64) -> Vec<LitCell> {
        let (mut flux_w, mut ray) = (LinearSrgb::BLACK, None);
        for (point, arrival) in at.into_iter().enumerate() {
            if let Some(arrival) = arrival.filter(|arrival| is_in_square(arrival.place)) {
                flux_w += arrival.flux_w * (0.2 * side * side);
                ray = Some((point, arrival.place));
            }
        }
        ray.map_or_else(Vec::new, |ray| self.piece(cell, way, ray, flux_w))
    }

    fn piece(
        &self,
        cell: &Cell,
        way: PathSignature,
        (point, place): (usize, DVec2),
        flux_w: LinearSrgb,
    ) -> Vec<LitCell> {
        let points = cell.points();
        let [a, b, c, d, _] = points;
        let piece = LitCell {
            way,
            face: cell.face,
            corners: [a, b, c, d],
            ray: square(points[point]),
            place,
            flux_w,
        };
        if flux_w.max_channel() > 0.0 {
            vec![piece]
        } else {
            Vec::new()
        }
    }
}
