//! Searches the scene's hierarchy for specular triangles in the cells of one face.

use glam::{DVec2, DVec3};

use super::bits::CellBits;
use super::grid::{CellRange, Grid};
use super::polygon::{Polygon, SIDES};
use crate::geometry::bvh::Node;
use crate::light_pass::launch::Launch;

/// A box, as minimum and maximum corner [m].
pub(super) type Bounds = (DVec3, DVec3);

/// What is looked for, and from where.
pub(super) struct Search<'a> {
    pub(super) launch: &'a Launch,
    pub(super) face: usize,
    pub(super) grid: &'static Grid,
    /// Boxes of the objects looked for: nodes beyond all of them are passed over.
    pub(super) boxes: &'a [Bounds],
    /// Whether a triangle of the hierarchy is one of theirs.
    pub(super) wanted: &'a (dyn Fn(u32) -> bool + Sync),
}

/// Where a node's box lies on a face.
enum Projection {
    /// Nowhere.
    Outside,
    /// Around the light, or beside it.
    Unbounded,
    /// Within these cells; `inside` where no part of it leaves the face.
    Cells { cells: CellRange, inside: bool },
}

impl Search<'_> {
    /// Clears the bits of all cells in `open` that a wanted triangle touches.
    ///
    /// A node whose cells are all closed is passed over; in a node within a single cell, any wanted triangle will do.
    pub(super) fn close(&self, root: Node, open: &mut CellBits) {
        let mut waiting = vec![root];
        while let Some(node) = waiting.pop() {
            if !self.is_near(&node) {
                continue;
            }
            match self.project(&node) {
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
                    for (_, corners) in node.triangles().filter(|(triangle, _)| (self.wanted)(*triangle)) {
                        for (column, row) in self.touched(corners, open) {
                            open.clear(column, row);
                        }
                    }
                }
            }
        }
    }

    /// Whether any wanted triangle touches a cell that is set in `lit`.
    pub(super) fn finds(&self, root: Node, lit: &CellBits) -> bool {
        let mut waiting = vec![root];
        while let Some(node) = waiting.pop() {
            let beyond = match self.project(&node) {
                Projection::Outside => true,
                Projection::Cells { cells, .. } => !lit.any_in(&cells),
                Projection::Unbounded => false,
            };
            if beyond || !self.is_near(&node) {
                continue;
            }
            waiting.extend(node.children().into_iter().flatten());
            let mut wanted = node.triangles().filter(|(triangle, _)| (self.wanted)(*triangle));
            if wanted.any(|(_, corners)| self.touches(corners, lit)) {
                return true;
            }
        }
        false
    }

    /// Whether a triangle touches a cell that is set.
    pub(super) fn touches(&self, corners: &[DVec3; 3], cells: &CellBits) -> bool {
        !self.touched(corners, cells).is_empty()
    }

    /// Set cells that a triangle touches; all of them where it reaches the light.
    fn touched(&self, corners: &[DVec3; 3], set: &CellBits) -> Vec<(usize, usize)> {
        let projected = corners.map(|corner| self.launch.to_face(self.face, corner));
        let Some(polygon) = Polygon::seen(&projected) else {
            return Vec::new();
        };
        let Some((low, high)) = polygon.plane_bounds() else {
            return set.list(&CellRange::ALL);
        };
        let cells = self.grid.cells(low, high);
        let mut list = set.list(&cells);
        if !cells.is_single() && !list.is_empty() {
            let edges = polygon.edges();
            list.retain(|&(column, row)| edges.touch(self.grid.cell(column, row)));
        }
        list
    }

    fn is_near(&self, node: &Node) -> bool {
        let (low, high) = node.bounds();
        self.boxes
            .iter()
            .any(|(from, to)| low.cmple(*to).all() && high.cmpge(*from).all())
    }

    /// Whether any triangle below a node is wanted.
    fn holds_wanted(&self, node: Node) -> bool {
        let mut waiting = vec![node];
        while let Some(node) = waiting.pop() {
            if !self.is_near(&node) {
                continue;
            }
            if node.triangles().any(|(triangle, _)| (self.wanted)(triangle)) {
                return true;
            }
            waiting.extend(node.children().into_iter().flatten());
        }
        false
    }

    fn project(&self, node: &Node) -> Projection {
        let corners = self.project_box(node.bounds());
        let beyond = |side: &DVec3| corners.iter().all(|corner| corner.dot(*side) < 0.0);
        if SIDES.iter().any(beyond) {
            return Projection::Outside;
        }
        // Not where it is not a number, either.
        if !corners.iter().all(|corner| corner.z > 0.0) {
            return Projection::Unbounded;
        }
        let mut low = DVec2::INFINITY;
        let mut high = DVec2::NEG_INFINITY;
        for corner in corners {
            let point = corner.truncate() / corner.z;
            (low, high) = (low.min(point), high.max(point));
        }
        let face = |point: DVec2| point.clamp(DVec2::NEG_ONE, DVec2::ONE);
        Projection::Cells {
            cells: self.grid.cells(face(low), face(high)),
            inside: low.min_element() >= -1.0 && high.max_element() <= 1.0,
        }
    }

    /// Corners of a box in homogeneous face coordinates, which are linear in the point.
    fn project_box(&self, (low, high): Bounds) -> [DVec3; 8] {
        let to_face = |point: DVec3| self.launch.to_face(self.face, point);
        let origin = to_face(low);
        let sides = [
            to_face(DVec3::new(high.x, low.y, low.z)) - origin,
            to_face(DVec3::new(low.x, high.y, low.z)) - origin,
            to_face(DVec3::new(low.x, low.y, high.z)) - origin,
        ];
        std::array::from_fn(|corner| {
            let along = |axis: usize| sides[axis] * f64::from(u8::from(corner >> axis & 1 == 1));
            origin + along(0) + along(1) + along(2)
        })
    }
}
