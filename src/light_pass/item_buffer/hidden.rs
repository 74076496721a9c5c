//! Cells whose casters are occluded by opaque faces.
//!
//! A cell is dropped only if its whole frustum is covered by opaque faces that are nearer to the light than every
//! caster in it: each ray that could start there hits an opaque face first. Mirrors are opaque too and hide what is
//! behind them, but not themselves. Faces are subtracted from the cell's rectangle one by one. Two faces that share an
//! edge have bitwise the same plane there, so that no gap opens between them; remainders thinner than [`SLIVER`] are
//! rounding.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec2, DVec3};

use super::CELLS_PER_SIDE;
use super::bits::CellBits;
use super::grid::Grid;
use super::polygon::Polygon;
use crate::geometry::polygon::clipped;
use crate::light_pass::launch::Launch;

/// Widths below this are rounding error [half sides of a face].
const SLIVER: f64 = 1e-11;

/// Relative distance by which a face has to be nearer than a caster.
const NEARER: f64 = 1e-7;

/// Volume between a triangle's corners and the light, relative to the product of their distances, below which rounding
/// may tilt the triangle's plane.
const MIN_VOLUME: f64 = 1e-6;

/// Maximum number of faces that are subtracted from a cell; later ones are ignored.
const MAX_FACES: usize = 64;

/// A cell that falls into more pieces counts as visible.
const MAX_PIECES: usize = 256;

/// A triangle in the homogeneous coordinates of a face, with its nearness to the light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// Planes through the light and each edge: positive for directions inside the triangle.
    edges: [DVec3; 3],
    /// `nearness·(x, y, 1)` is the nearness of the triangle's plane in the direction of a point of the face: 1/z or,
    /// for a sun, the negative distance from the launch plane. `None` if the triangle is too small or seen edge-on.
    nearness: Option<DVec3>,
    /// Largest and smallest nearness of the corners; `None` unless all of them lie in front of the light.
    range: Option<(f64, f64)>,
}

impl Facet {
    pub(super) fn new(launch: &Launch, face: usize, triangle: &[DVec3; 3]) -> Self {
        let corners = triangle.map(|corner| launch.to_face(face, corner));
        let values = triangle.map(|corner| launch.nearness(corner));
        let [a, b, c] = corners;
        let mut edges = [b.cross(c), c.cross(a), a.cross(b)];
        let volume = a.dot(edges[0]);
        let weighted = edges[0] * values[0] + edges[1] * values[1] + edges[2] * values[2];
        let whole = a.length() * b.length() * c.length();
        let is_sound = volume.abs() > MIN_VOLUME * whole;
        if volume < 0.0 {
            edges = edges.map(|edge| -edge);
        }
        let at_corners = [0, 1, 2].map(|corner| values[corner] / corners[corner].z);
        let all_before = corners.iter().all(|corner| corner.z > 0.0);
        let [u, v, w] = at_corners;
        Self {
            edges,
            nearness: is_sound.then_some(weighted / volume),
            range: all_before.then_some((u.max(v).max(w), u.min(v).min(w))),
        }
    }

    /// Upper bound on the nearness of the triangle in a rectangle of the face.
    fn nearest_in(&self, cell: (DVec2, DVec2)) -> f64 {
        let by_plane = self
            .nearness
            .map_or(f64::INFINITY, |plane| extremes(plane, cell).1);
        let by_corners = self.range.map_or(f64::INFINITY, |(nearest, _)| nearest);
        by_plane.min(by_corners)
    }

    /// Lower bound on the nearness of the triangle in a rectangle of the face; `None` if unknown.
    pub(super) fn farthest_in(&self, cell: (DVec2, DVec2)) -> Option<f64> {
        let by_plane = self.nearness.map(|plane| extremes(plane, cell).0);
        let by_corners = self.range.map(|(_, farthest)| farthest);
        match (by_plane, by_corners) {
            (Some(plane), Some(corners)) => Some(plane.max(corners)),
            (one, other) => one.or(other),
        }
    }
}

/// Least and largest value of a linear function over a rectangle of the plane z = 1.
fn extremes(plane: DVec3, (low, high): (DVec2, DVec2)) -> (f64, f64) {
    let middle = (low + high) * 0.5;
    let half = (high - low) * 0.5;
    let value = plane.dot(middle.extend(1.0));
    let reach = plane.x.abs() * half.x + plane.y.abs() * half.y;
    (value - reach, value + reach)
}

/// Opaque faces and casters in the marked cells of one face.
pub(super) struct HiddenCells<'a> {
    launch: &'a Launch,
    face: usize,
    grid: &'static Grid,
    /// By cell: opaque faces that may hide a caster, with their objects.
    faces: Vec<Vec<(usize, Facet)>>,
    /// Cells with such faces.
    doubtful: CellBits,
    /// Largest nearness of an object in a doubtful cell (column, row).
    casters: BTreeMap<((usize, usize), usize), f64>,
}

/// Hidden cells and visible casters among the doubtful cells of one face.
#[derive(Debug)]
pub(super) struct Hidden {
    /// Cells in which every caster is hidden.
    pub(super) cells: CellBits,
    /// Casters that are visible in some doubtful cell.
    pub(super) seen: BTreeSet<usize>,
}

impl<'a> HiddenCells<'a> {
    pub(super) fn new(launch: &'a Launch, face: usize) -> Self {
        Self {
            launch,
            face,
            grid: Grid::of(launch.mapping()),
            faces: vec![Vec::new(); CELLS_PER_SIDE * CELLS_PER_SIDE],
            doubtful: CellBits::filled(false),
            casters: BTreeMap::new(),
        }
    }

    /// Adds an opaque triangle of an object that may lie in front of a caster in some of the `marked` cells, which
    /// become doubtful. `None` for a triangle of a caster, from which light goes on: alone it drops no cell, so that it
    /// is added only to cells that are doubtful already. Returns the number of tests.
    pub(super) fn add_opaque(
        &mut self,
        object: usize,
        corners: &[DVec3; 3],
        marked: Option<&CellBits>,
    ) -> u64 {
        let cells = self.touched(corners, marked.unwrap_or(&self.doubtful));
        let mut facet = None;
        for &(column, row) in &cells {
            let faces = &mut self.faces[row * CELLS_PER_SIDE + column];
            if faces.len() < MAX_FACES {
                let facet = facet.get_or_insert_with(|| Facet::new(self.launch, self.face, corners));
                faces.push((object, *facet));
            }
            self.doubtful.set(column, row);
        }
        1 + cells.len() as u64
    }

    /// Cells of a set that a triangle touches.
    fn touched(&self, corners: &[DVec3; 3], set: &CellBits) -> Vec<(usize, usize)> {
        let seen = corners.map(|corner| self.launch.to_face(self.face, corner));
        Polygon::seen(&seen).map_or(Vec::new(), |polygon| polygon.touched(self.grid, set))
    }

    /// Cells that opaque faces may cover.
    pub(super) fn doubtful(&self) -> &CellBits {
        &self.doubtful
    }

    /// Adds a triangle of a caster. Returns the number of tests.
    pub(super) fn add_caster(&mut self, object: usize, corners: &[DVec3; 3]) -> u64 {
        let cells = self.touched(corners, &self.doubtful);
        if cells.is_empty() {
            return 1;
        }
        let facet = Facet::new(self.launch, self.face, corners);
        for &cell in &cells {
            let nearest = self.casters.entry((cell, object)).or_insert(f64::NEG_INFINITY);
            *nearest = nearest.max(facet.nearest_in(self.grid.cell(cell.0, cell.1)));
        }
        1 + cells.len() as u64
    }

    /// Tests every caster in every doubtful cell.
    pub(super) fn find(&self) -> Hidden {
        let mut hidden = Hidden {
            cells: CellBits::filled(false),
            seen: BTreeSet::new(),
        };
        for &((column, row), _) in self.casters.keys() {
            hidden.cells.set(column, row);
        }
        for (&((column, row), object), &nearness) in &self.casters {
            if !self.is_covered((column, row), object, nearness) {
                hidden.cells.clear(column, row);
                hidden.seen.insert(object);
            }
        }
        hidden
    }

    /// Whether faces of other objects cover a whole cell in front of an object of this nearness.
    fn is_covered(&self, (column, row): (usize, usize), object: usize, nearness: f64) -> bool {
        let faces = &self.faces[row * CELLS_PER_SIDE + column];
        let cell = self.grid.cell(column, row);
        let margin = NEARER * nearness.abs();
        let is_before = |facet: &Facet| {
            let farthest = facet.farthest_in(cell);
            farthest.is_some_and(|farthest| farthest > nearness + margin)
        };
        let (low, high) = cell;
        let corner = |x: f64, y: f64| DVec3::new(x, y, 1.0);
        let mut left = vec![vec![
            corner(low.x, low.y),
            corner(high.x, low.y),
            corner(high.x, high.y),
            corner(low.x, high.y),
        ]];
        for (_, facet) in faces
            .iter()
            .filter(|(owner, facet)| *owner != object && is_before(facet))
        {
            left = left.into_iter().flat_map(|piece| without(piece, facet)).collect();
            if left.is_empty() {
                return true;
            }
            if left.len() > MAX_PIECES {
                return false;
            }
        }
        false
    }
}

/// The part of a convex polygon in the plane z = 1 outside of a triangle, as convex pieces.
fn without(piece: Vec<DVec3>, facet: &Facet) -> Vec<Vec<DVec3>> {
    let mut left = Vec::new();
    let mut inside = piece.clone();
    for edge in facet.edges {
        let heights: Vec<f64> = inside.iter().map(|corner| corner.dot(edge)).collect();
        // Heights divided by this are distances in the plane.
        let scale = edge.truncate().length();
        let sliver = SLIVER * scale;
        let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let highest = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // Also for NaN: then nothing is subtracted.
        if highest <= sliver || highest.is_nan() {
            return vec![piece];
        }
        if lowest >= -sliver {
            continue;
        }
        left.push(clipped(&inside, |corner| -corner.dot(edge)));
        inside = clipped(&inside, |corner| corner.dot(edge));
    }
    left
}
