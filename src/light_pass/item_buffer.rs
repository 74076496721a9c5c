//! The item buffer of a light: the directions in which it sees a specular surface (section 3.1.2 of the paper; Weghorst
//! et al. 1984).
//!
//! Cells are marked by projecting the scene's hierarchy onto the faces of the launch domain and, where a box does not
//! decide, the triangles of specular objects below it. Triangles are tested exactly against the cells: one that is
//! smaller than a cell, edge-on or on a cube edge is never missed. Cells whose whole frustum is covered by opaque faces
//! in front of every caster are dropped (`hidden`); all other occlusion is left to the rays.

mod bits;
mod builder;
mod grid;
mod hidden;
mod lit;
mod polygon;
mod search;

use std::sync::atomic::AtomicU64;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use self::bits::CellBits;
use self::builder::Builder;
use self::search::{Bounds, Search};
use super::launch::Launch;
use crate::transport::Tracer;

/// Cells along each side of a face.
pub const CELLS_PER_SIDE: usize = 128;

/// Maximum number of boxes that each node is compared with; more objects share a single box.
const MAX_BOXES: usize = 16;

/// Marked cells of all faces of one light.
#[derive(Debug)]
pub struct ItemBuffer {
    faces: Vec<CellBits>,
    /// Specular objects that mark at least one cell, ascending.
    pub casters: Vec<usize>,
    /// Cells that were dropped because opaque faces cover them in front of every caster.
    pub hidden_cells: u64,
    /// Nodes, triangles and cells that were tested, as a measure of the work.
    pub tests: u64,
}

const EVERYWHERE: [Bounds; 1] = [(DVec3::NEG_INFINITY, DVec3::INFINITY)];

/// First and last column, first and last row of the cells of a face that a box may touch; `None` if it touches none.
pub fn cells_towards(
    launch: &Launch,
    face: usize,
    bounds: (DVec3, DVec3),
) -> Option<((usize, usize), (usize, usize))> {
    let cells = Search::new(launch, face, &[], &[], &|_| false).cells_of(bounds)?;
    Some((cells.columns, cells.rows))
}

/// What to do with cells whose casters lie behind opaque faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HiddenCellPolicy {
    /// Mark them like all others.
    Keep,
    /// Drop them.
    Drop,
}

impl ItemBuffer {
    /// Marks the cells that may see one of the `casters` (indices of specular objects).
    pub fn build(launch: &Launch, tracer: &Tracer, casters: &[usize], hiding: HiddenCellPolicy) -> Self {
        // Cells outside of a lamp's cone are never marked.
        let lit: Vec<CellBits> = (0..launch.face_count())
            .into_par_iter()
            .map(|face| lit::lit_cells(launch, face))
            .collect();

        // Boxes of the casters and of everything else let the search skip or accept whole nodes of the hierarchy.
        let objects = &tracer.scene().objects;
        let bounds: Vec<Option<Bounds>> = objects.par_iter().map(|object| object.bounds()).collect();
        let mut wanted = vec![false; objects.len()];
        casters.iter().for_each(|&object| wanted[object] = true);
        let boxes = |of_wanted: bool| {
            let chosen = (0..objects.len()).filter(|&object| wanted[object] == of_wanted);
            few(chosen.filter_map(|object| bounds[object]).collect())
        };
        let builder = Builder {
            launch,
            tracer,
            bounds: &bounds,
            boxes: boxes(true),
            wanted: &wanted,
            tests: AtomicU64::new(0),
        };
        let mut faces = builder.mark(&lit, &boxes(false));

        // Cells in which opaque faces hide every caster are dropped: no ray from there would reach one.
        let hidden = match hiding {
            HiddenCellPolicy::Keep => Vec::new(),
            HiddenCellPolicy::Drop => builder.hidden(&faces),
        };
        let mut hidden_cells = 0;
        // Cells in which nothing can be hidden; all lit cells under `HiddenCellPolicy::Keep`, or if no opaque face may
        // hide a caster.
        let mut clear = lit;
        for (face, (doubtful, found)) in hidden.iter().enumerate() {
            clear[face] = faces[face].without(doubtful);
            hidden_cells += found.cells.count();
            faces[face] = faces[face].without(&found.cells);
        }

        // A caster is seen if it is not covered in some doubtful cell, or touches a cell in which nothing can be
        // hidden.
        let seen_beside = |object: usize| hidden.iter().any(|(_, found)| found.seen.contains(&object));
        let is_any = faces.iter().any(|face| face.count() > 0);
        let seen: Vec<usize> = casters
            .par_iter()
            .copied()
            .filter(|_| is_any)
            .filter(|&object| {
                seen_beside(object)
                    || bounds[object].is_some_and(|bounds| builder.sees(object, bounds, &clear))
            })
            .collect();
        let tests = builder.tests.into_inner();
        Self {
            faces,
            casters: seen,
            hidden_cells,
            tests,
        }
    }

    /// Whether both mark the same cells.
    pub fn marks_as(&self, other: &Self) -> bool {
        self.faces == other.faces && self.casters == other.casters
    }

    pub fn is_marked(&self, face: usize, column: usize, row: usize) -> bool {
        self.faces[face].get(column, row)
    }

    /// Whether a box [m] may touch a marked cell.
    pub fn is_marked_towards(&self, launch: &Launch, bounds: (DVec3, DVec3)) -> bool {
        let none = |_: usize| false;
        self.faces.iter().enumerate().any(|(face, marked)| {
            let search = Search::new(launch, face, &[], &[], &none);
            search.may_touch(bounds, marked)
        })
    }

    /// Whether an object may bend the light, or occlude a caster.
    pub fn may_concern(&self, launch: &Launch, tracer: &Tracer, object: usize) -> bool {
        let Some(bounds) = tracer.scene().objects[object].bounds() else {
            return false;
        };
        if self.casters.contains(&object) {
            return true;
        }
        if !self.is_marked_towards(launch, bounds) {
            return false;
        }
        let mut wanted = vec![false; tracer.scene().objects.len()];
        self.casters.iter().for_each(|&caster| wanted[caster] = true);
        let wanted = |object: usize| wanted[object];
        self.faces.iter().enumerate().any(|(face, marked)| {
            let search = Search::new(launch, face, &EVERYWHERE, &[], &wanted);
            search.may_hide(bounds, marked, tracer.roots())
        })
    }

    pub fn marked_cells(&self) -> u64 {
        self.faces.iter().map(CellBits::count).sum()
    }

    /// Fraction of the domain that is marked, in (0, 1] if any cell is.
    pub fn marked_share(&self, launch: &Launch) -> f64 {
        let whole = launch.cell_measure(DVec2::ZERO, DVec2::ONE) * launch.face_count() as f64;
        self.marked_measure(launch) / whole
    }

    /// Solid angle of the marked cells [sr], or their area for a sun [m²].
    pub fn marked_measure(&self, launch: &Launch) -> f64 {
        let side = CELLS_PER_SIDE as f64;
        let mut sum = 0.0;
        for face in &self.faces {
            for row in 0..CELLS_PER_SIDE {
                for column in face.runs((row, row)).flat_map(|(begin, end)| begin..end) {
                    let low = DVec2::new(column as f64, row as f64) / side;
                    sum += launch.cell_measure(low, low + 1.0 / side);
                }
            }
        }
        sum
    }

    /// Number of lattice cells that touch a marked cell, over all faces: an upper bound on the rays.
    pub fn lattice_cells(&self, faces: usize, size: (usize, usize)) -> u64 {
        let in_face = |face: usize| -> u64 {
            let mut sum = 0;
            // Rows that touch the same cells have the same count.
            let mut last: Option<((usize, usize), u64)> = None;
            for row in 0..size.1 {
                let rows = touched(row, size.1, CELLS_PER_SIDE);
                let count = match last {
                    Some((known, count)) if known == rows => count,
                    _ => self
                        .spans(face, rows, size.0)
                        .map(|(begin, end)| (end - begin) as u64)
                        .sum(),
                };
                last = Some((rows, count));
                sum += count;
            }
            sum
        };
        (0..faces).into_par_iter().map(in_face).sum()
    }

    /// The columns of a lattice row that touch a marked cell, as ascending, disjoint half-open spans. `size`: columns
    /// and rows of the lattice.
    pub fn lattice_spans(&self, face: usize, row: usize, size: (usize, usize)) -> Vec<(usize, usize)> {
        self.spans(face, touched(row, size.1, CELLS_PER_SIDE), size.0)
            .collect()
    }

    /// Spans of lattice columns over some rows of cells.
    fn spans(
        &self,
        face: usize,
        rows: (usize, usize),
        columns: usize,
    ) -> impl Iterator<Item = (usize, usize)> {
        let mut runs = self.faces[face]
            .runs(rows)
            .map(move |(begin, end)| {
                let first = touched(begin, CELLS_PER_SIDE, columns).0;
                (first, touched(end - 1, CELLS_PER_SIDE, columns).1 + 1)
            })
            .peekable();
        std::iter::from_fn(move || {
            let mut span = runs.next()?;
            // Separate runs may fall into the same coarser lattice cell.
            while let Some(next) = runs.next_if(|next| next.0 <= span.1) {
                span.1 = next.1;
            }
            Some(span)
        })
    }
}

/// First and last of `fine` equal intervals of [0, 1] that overlap interval `index` of `coarse` ones.
fn touched(index: usize, coarse: usize, fine: usize) -> (usize, usize) {
    let first = index * fine / coarse;
    let last = ((index + 1) * fine).div_ceil(coarse) - 1;
    (first, last.min(fine - 1))
}

/// The boxes themselves, or one around all if there are too many.
fn few(boxes: Vec<Bounds>) -> Vec<Bounds> {
    if boxes.len() <= MAX_BOXES {
        return boxes;
    }
    let around = |a: Bounds, b: Bounds| (a.0.min(b.0), a.1.max(b.1));
    boxes.into_iter().reduce(around).into_iter().collect()
}
