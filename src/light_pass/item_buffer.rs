//! Which directions of a light see a specular surface (section 3.1.2 of the paper; Weghorst et al. 1984).
//!
//! Cells are marked by projecting the scene's hierarchy onto the faces of the launch domain, and the triangles of
//! specular objects below it where a box does not decide; triangles are tested against the cells exactly: one that is
//! smaller than a cell, edge-on or on a cube edge is never missed. Occlusion is left to the rays.

mod bits;
mod grid;
mod lit;
mod polygon;
mod search;

use glam::DVec2;
use rayon::prelude::*;

use self::bits::CellBits;
use self::search::{Bounds, Search};
use super::launch::Launch;
use crate::geometry::bvh::Node;
use crate::transport::Tracer;

/// Cells across and down each face.
pub const CELLS_PER_SIDE: usize = 128;

/// Triangles of an object that are tried before its nodes are searched for one that the light sees.
const TRIED_FIRST: usize = 16;

/// Boxes that every node is compared with; of more objects than these, one box around all is.
const MOST_BOXES: usize = 16;

/// Marked cells of all faces of one light.
#[derive(Debug)]
pub struct ItemBuffer {
    faces: Vec<CellBits>,
    /// Specular objects that mark at least one cell, ascending.
    pub casters: Vec<usize>,
}

impl ItemBuffer {
    /// Marks the cells that may see one of the `casters` (indices of specular objects).
    pub fn build(launch: &Launch, tracer: &Tracer, casters: &[usize]) -> Self {
        let lit: Vec<CellBits> = (0..launch.face_count())
            .into_par_iter()
            .map(|face| lit::lit_cells(launch, face))
            .collect();
        let builder = Builder {
            launch,
            tracer,
            lit,
            owners: Owners::new(tracer),
        };
        let objects = &tracer.scene().objects;
        let bounds: Vec<Option<Bounds>> = objects.par_iter().map(|object| object.mesh.bounds()).collect();
        let seen: Vec<usize> = casters
            .par_iter()
            .copied()
            .filter(|&object| bounds[object].is_some_and(|bounds| builder.sees(object, bounds)))
            .collect();
        let mut wanted = vec![false; objects.len()];
        casters.iter().for_each(|&object| wanted[object] = true);
        let boxes = |of_wanted: bool| {
            let chosen = (0..objects.len()).filter(|&object| wanted[object] == of_wanted);
            few(chosen.filter_map(|object| bounds[object]).collect())
        };
        let faces = builder.mark(&boxes(true), &boxes(false), &wanted);
        Self { faces, casters: seen }
    }

    /// Whether a cell is marked.
    pub fn is_marked(&self, face: usize, column: usize, row: usize) -> bool {
        self.faces[face].get(column, row)
    }

    /// Number of marked cells.
    pub fn marked_cells(&self) -> u64 {
        self.faces.iter().map(CellBits::count).sum()
    }

    /// Marked cells' part of the whole domain, (0, 1] where any is marked.
    pub fn marked_share(&self, launch: &Launch) -> f64 {
        let whole = launch.cell_measure(DVec2::ZERO, DVec2::ONE) * launch.face_count() as f64;
        self.marked_measure(launch) / whole
    }

    /// Solid angle [sr] of the marked cells, or their area [m²] for a sun.
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

    /// Lattice cells that touch a marked cell, over all faces: an upper bound of the rays.
    pub fn lattice_cells(&self, faces: usize, size: (usize, usize)) -> u64 {
        let in_face = |face: usize| -> u64 {
            let mut sum = 0;
            // Rows that touch the same cells hold as many.
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

    /// Lattice columns of a lattice row that touch a marked cell, as ascending, disjoint half-open spans. `size` is the
    /// lattice's columns and rows.
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
            // Runs apart may lie in the same coarser lattice cell.
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

/// The boxes themselves, or one around all where they are many.
fn few(boxes: Vec<Bounds>) -> Vec<Bounds> {
    if boxes.len() <= MOST_BOXES {
        return boxes;
    }
    let around = |a: Bounds, b: Bounds| (a.0.min(b.0), a.1.max(b.1));
    boxes.into_iter().reduce(around).into_iter().collect()
}

/// What marking needs.
struct Builder<'a> {
    launch: &'a Launch,
    tracer: &'a Tracer,
    /// Cells that the light sends anything to, by face.
    lit: Vec<CellBits>,
    owners: Owners,
}

impl Builder<'_> {
    fn root(&self) -> Option<Node<'_>> {
        self.tracer.bvh().root()
    }

    /// Whether the light sends anything towards an object.
    fn sees(&self, object: usize, bounds: Bounds) -> bool {
        let wanted = |triangle: u32| self.owners.of(triangle) == object;
        let bounds = [bounds];
        let mesh = &self.tracer.scene().objects[object].mesh;
        let faces = || self.lit.iter().enumerate();
        let at_once = (0..mesh.triangles.len().min(TRIED_FIRST)).any(|triangle| {
            let corners = mesh.corners(triangle);
            faces().any(|(face, lit)| {
                Search::new(self.launch, face, &bounds, &[], &wanted).touches(&corners, lit)
            })
        });
        at_once
            || self.root().is_some_and(|root| {
                faces()
                    .any(|(face, lit)| Search::new(self.launch, face, &bounds, &[], &wanted).finds(root, lit))
            })
    }

    /// The lit cells of each face that a triangle of a wanted object touches.
    fn mark(&self, boxes: &[Bounds], others: &[Bounds], objects: &[bool]) -> Vec<CellBits> {
        let wanted = |triangle: u32| objects[self.owners.of(triangle)];
        let mark = |(face, lit): (usize, &CellBits)| {
            let mut open = lit.clone();
            let search = Search::new(self.launch, face, boxes, others, &wanted);
            for (object, _) in self
                .tracer
                .scene()
                .objects
                .iter()
                .zip(objects)
                .filter(|(_, wanted)| **wanted)
            {
                search.close_some(&object.mesh, &mut open);
            }
            if let Some(root) = self.root() {
                search.close(root, &mut open);
            }
            lit.without(&open)
        };
        self.lit.par_iter().enumerate().map(mark).collect()
    }
}

/// Which object a triangle of the hierarchy belongs to: they are counted object by object.
struct Owners {
    /// Index after the last triangle of each object.
    ends: Vec<u32>,
}

impl Owners {
    fn new(tracer: &Tracer) -> Self {
        let mut end = 0;
        let count = |object: &crate::scene::Object| {
            end += object.mesh.triangles.len() as u32;
            end
        };
        Self {
            ends: tracer.scene().objects.iter().map(count).collect(),
        }
    }

    fn of(&self, triangle: u32) -> usize {
        self.ends.partition_point(|&end| end <= triangle)
    }
}
