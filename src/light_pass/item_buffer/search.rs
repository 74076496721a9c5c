//! Searches the scene's hierarchy for specular triangles in the cells of one face.

use std::cell::Cell;

use glam::{DMat3, DVec2, DVec3};

use super::bits::CellBits;
use super::grid::{CellRange, Grid};
use super::hidden::Facet;
use super::polygon::{Polygon, WIDENED};
use crate::geometry::sampling::GOLDEN_64;
use crate::light_pass::launch::Launch;
use crate::scene::InScene;
use crate::transport::SceneNode;

/// A box, as minimum and maximum corner [m].
pub(super) type Bounds = (DVec3, DVec3);

/// A search for the triangles of wanted objects on one face.
pub(super) struct Search<'a> {
    launch: &'a Launch,
    face: usize,
    grid: &'static Grid,
    /// Boxes of the wanted objects: nodes that overlap none are skipped.
    boxes: &'a [Bounds],
    /// Boxes of all other objects: a node that overlaps none has wanted triangles only.
    others: &'a [Bounds],
    /// Whether an object is wanted.
    wanted: &'a (dyn Fn(usize) -> bool + Sync),
    /// Absolute linear part of the transform from the scene to the face, for the half extents of boxes.
    reach: DMat3,
    /// Nodes and triangles tested so far.
    tests: Cell<u64>,
}

/// Projection of a node's box onto a face.
enum Projection {
    /// Outside of the face.
    Outside,
    /// Not entirely in front of the light: the projection has no bounds.
    Unbounded,
    /// Within these cells; `inside` if no part of it leaves the face.
    Cells { cells: CellRange, inside: bool },
}

impl<'a> Search<'a> {
    pub(super) fn new(
        launch: &'a Launch,
        face: usize,
        boxes: &'a [Bounds],
        others: &'a [Bounds],
        wanted: &'a (dyn Fn(usize) -> bool + Sync),
    ) -> Self {
        let to_face = |point: DVec3| launch.to_face(face, point);
        let along = |axis: DVec3| (to_face(axis) - to_face(DVec3::ZERO)).abs();
        Self {
            launch,
            face,
            grid: Grid::of(launch.mapping()),
            boxes,
            others,
            wanted,
            reach: DMat3::from_cols(along(DVec3::X), along(DVec3::Y), along(DVec3::Z)),
            tests: Cell::new(0),
        }
    }

    pub(super) fn tests(&self) -> u64 {
        self.tests.get()
    }

    fn count(&self) {
        self.tests.set(self.tests.get() + 1);
    }

    /// Whether a box may touch any cell of a set.
    pub(super) fn may_touch(&self, bounds: Bounds, cells: &CellBits) -> bool {
        match self.project(bounds) {
            Projection::Outside => false,
            Projection::Cells { cells: within, .. } => cells.any_in(&within),
            Projection::Unbounded => true,
        }
    }

    /// Whether a box may lie in front of a wanted triangle in any of the marked cells.
    pub(super) fn may_hide(&self, bounds: Bounds, marked: &CellBits, roots: Vec<SceneNode>) -> bool {
        let range = match self.project(bounds) {
            Projection::Outside => return false,
            Projection::Cells { cells, .. } => cells,
            Projection::Unbounded => return true,
        };
        let mut cells = CellBits::filled(false);
        for (column, row) in marked.list(&range) {
            cells.set(column, row);
        }
        let nearness = self.nearest(bounds);
        self.visit(roots, &cells, |_, corners| {
            let facet = Facet::new(self.launch, self.face, corners);
            let behind = |&(column, row): &(usize, usize)| {
                let farthest = facet.farthest_in(self.grid.cell(column, row));
                farthest.is_none_or(|farthest| farthest < nearness)
            };
            self.touched(corners, &cells).iter().any(behind)
        })
    }

    /// Largest nearness of a box that lies in front of the light.
    fn nearest(&self, (low, high): Bounds) -> f64 {
        let corners = (0..8).map(|corner| {
            let side = |axis: usize| {
                if corner >> axis & 1 == 1 {
                    high[axis]
                } else {
                    low[axis]
                }
            };
            let point = DVec3::new(side(0), side(1), side(2));
            self.launch.nearness(point) / self.launch.to_face(self.face, point).z
        });
        corners.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Passes the wanted triangles, with their objects, of nodes that may touch a cell of the set to `take`, until that is
    /// true; returns whether it was.
    pub(super) fn visit(
        &self,
        mut waiting: Vec<SceneNode>,
        cells: &CellBits,
        mut take: impl FnMut(usize, &[DVec3; 3]) -> bool,
    ) -> bool {
        while let Some(node) = waiting.pop() {
            let bounds = node.bounds();
            if !self.may_touch(bounds, cells) || !overlaps(bounds, self.boxes) {
                continue;
            }
            waiting.extend(node.children().into_iter().flatten());
            if self
                .wanted_of(&node)
                .any(|(object, corners)| take(object, &corners))
            {
                return true;
            }
        }
        false
    }

    /// Clears the bits of all cells in `open` that a wanted triangle touches.
    ///
    /// Nodes whose cells are all closed are skipped. In a node within a single cell, any wanted triangle is enough.
    pub(super) fn close(&self, mut waiting: Vec<SceneNode>, open: &mut CellBits) {
        while let Some(node) = waiting.pop() {
            let bounds = node.bounds();
            if !overlaps(bounds, self.boxes) {
                continue;
            }
            match self.project(bounds) {
                Projection::Outside => continue,
                Projection::Cells { cells, .. } if !open.any_in(&cells) => continue,
                Projection::Cells { cells, inside: true } if cells.is_single() => {
                    if self.holds_wanted(node) {
                        open.clear(cells.columns.0, cells.rows.0);
                    }
                    continue;
                }
                Projection::Cells { .. } | Projection::Unbounded => {}
            }
            match node.children() {
                Some(children) => waiting.extend(children),
                None => {
                    for (_, corners) in self.wanted_of(&node) {
                        for (column, row) in self.touched(&corners, open) {
                            open.clear(column, row);
                        }
                    }
                }
            }
        }
    }

    /// Clears the bits of cells in `open` that contain sampled vertices of a large mesh, for as long as that closes
    /// cells faster than the search does.
    pub(super) fn close_some(&self, mesh: InScene, open: &mut CellBits) {
        const BATCH: u64 = 1024;
        const MIN_CLOSED: u64 = BATCH / 12;
        let count = mesh.triangle_count() as u64;
        for batch in 0..count / BATCH {
            let before = open.count();
            for sample in batch * BATCH..(batch + 1) * BATCH {
                // Multiples of the golden ratio fill an interval evenly.
                let share = sample.wrapping_mul(GOLDEN_64);
                let triangle = (u128::from(share) * u128::from(count)) >> 64;
                let vertex = mesh.triangle(triangle as usize)[0];
                self.close_at(mesh.position(vertex as usize), open);
            }
            if before - open.count() < MIN_CLOSED {
                return;
            }
        }
    }

    /// Clears the bits of the cells that contain a point.
    fn close_at(&self, point: DVec3, open: &mut CellBits) {
        let point = self.launch.to_face(self.face, point);
        if !(point.z > 0.0 && point.truncate().abs().max_element() <= point.z) {
            return;
        }
        let point = point.truncate() / point.z;
        let cells = self.grid.cells(point, point);
        for row in cells.rows.0..=cells.rows.1 {
            (cells.columns.0..=cells.columns.1).for_each(|column| open.clear(column, row));
        }
    }

    /// Whether any wanted triangle touches a cell of `lit`.
    pub(super) fn finds(&self, roots: Vec<SceneNode>, lit: &CellBits) -> bool {
        self.visit(roots, lit, |_, corners| self.touches(corners, lit))
    }

    /// Wanted triangles of a leaf, with their object.
    fn wanted_of(&self, node: &SceneNode<'a>) -> impl Iterator<Item = (usize, [DVec3; 3])> {
        node.triangles().filter(|(object, _)| (self.wanted)(*object))
    }

    /// Whether a triangle touches a cell of the set.
    pub(super) fn touches(&self, corners: &[DVec3; 3], cells: &CellBits) -> bool {
        !self.touched(corners, cells).is_empty()
    }

    /// Cells of a set that a triangle touches; all of them if it reaches the light.
    fn touched(&self, corners: &[DVec3; 3], set: &CellBits) -> Vec<(usize, usize)> {
        self.count();
        let projected = corners.map(|corner| self.launch.to_face(self.face, corner));
        let Some(polygon) = Polygon::seen(&projected) else {
            return Vec::new();
        };
        polygon.touched(self.grid, set)
    }

    /// Whether a node has a wanted triangle.
    fn holds_wanted(&self, node: SceneNode) -> bool {
        if !node.may_be_stale() && !overlaps(node.bounds(), self.others) {
            return true;
        }
        let mut waiting = vec![node];
        while let Some(node) = waiting.pop() {
            if !overlaps(node.bounds(), self.boxes) {
                continue;
            }
            if self.wanted_of(&node).next().is_some() {
                return true;
            }
            waiting.extend(node.children().into_iter().flatten());
        }
        false
    }

    /// Cells that a box may touch; `None` if it touches none.
    pub(super) fn cells_of(&self, bounds: Bounds) -> Option<CellRange> {
        match self.project(bounds) {
            Projection::Outside => None,
            Projection::Unbounded => Some(CellRange::ALL),
            Projection::Cells { cells, .. } => Some(cells),
        }
    }

    fn project(&self, (from, to): Bounds) -> Projection {
        self.count();
        let half = (to - from) * 0.5;
        let middle = self.launch.to_face(self.face, from + half);
        let reach = self.reach * half;
        let (low, high) = (middle - reach, middle + reach);
        let beyond = |sides: (f64, f64)| sides.0 > WIDENED * high.z || sides.1 < -WIDENED * high.z;
        if beyond((low.x, high.x)) || beyond((low.y, high.y)) {
            return Projection::Outside;
        }
        // Also for NaN.
        if !(low.z > 0.0 && high.is_finite()) {
            return Projection::Unbounded;
        }
        let (nearest, farthest) = (1.0 / low.z, 1.0 / high.z);
        let least = |x: f64| x * if x < 0.0 { nearest } else { farthest };
        let most = |x: f64| x * if x > 0.0 { nearest } else { farthest };
        let low = DVec2::new(least(low.x), least(low.y));
        let high = DVec2::new(most(high.x), most(high.y));
        let face = |point: DVec2| point.clamp(DVec2::NEG_ONE, DVec2::ONE);
        Projection::Cells {
            cells: self.grid.cells(face(low), face(high)),
            inside: low.min_element() >= -1.0 && high.max_element() <= 1.0,
        }
    }
}

/// Whether a box overlaps any of several.
fn overlaps((low, high): Bounds, boxes: &[Bounds]) -> bool {
    boxes
        .iter()
        .any(|(from, to)| low.cmple(*to).all() && high.cmpge(*from).all())
}
