//! Which directions of a light see a specular surface (section 3.1.2 of the paper; Weghorst et al. 1984).
//!
//! Cells are marked by projecting every triangle of every specular object onto the faces of the launch domain, and
//! testing it against the cells exactly: a triangle smaller than a cell, edge-on or on a cube edge is never missed.
//! Occlusion is left to the rays.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::launch::Launch;
use crate::geometry::cube_face::FaceMapping;
use crate::scene::Scene;

/// Cells across and down each face.
pub const CELLS_PER_SIDE: usize = 128;

/// Widening of the cell test, in units of the face's half side: above rounding, far below a cell.
const MARGIN: f64 = 1e-9;

const WORDS: usize = CELLS_PER_SIDE * CELLS_PER_SIDE / 64;

/// Marked cells of all faces of one light.
#[derive(Debug)]
pub struct ItemBuffer {
    /// One bit per cell, row by row.
    faces: Vec<Vec<u64>>,
    /// Specular objects that mark at least one cell, ascending.
    pub casters: Vec<usize>,
}

impl ItemBuffer {
    /// Marks the cells that may see one of the `casters` (indices of specular objects).
    pub fn build(launch: &Launch, scene: &Scene, casters: &[usize]) -> Self {
        let faces: Vec<Face> = (0..launch.face_count())
            .map(|face| Face::new(launch, face))
            .collect();
        let mut seen = Vec::new();
        for &object in casters {
            let mesh = &scene.objects[object].mesh;
            let visible = AtomicBool::new(false);
            (0..mesh.triangles.len())
                .into_par_iter()
                .with_min_len(1024)
                .for_each(|triangle| {
                    let corners = mesh.corners(triangle);
                    for (face, cells) in faces.iter().enumerate() {
                        let projected = corners.map(|corner| launch.to_face(face, corner));
                        if cells.mark_triangle(launch, &projected) {
                            visible.store(true, Ordering::Relaxed);
                        }
                    }
                });
            if visible.into_inner() {
                seen.push(object);
            }
        }
        let faces = faces.into_iter().map(Face::into_bits).collect();
        Self { faces, casters: seen }
    }

    /// Whether a cell is marked.
    pub fn is_marked(&self, face: usize, column: usize, row: usize) -> bool {
        let bit = row * CELLS_PER_SIDE + column;
        self.faces[face][bit / 64] >> (bit % 64) & 1 == 1
    }

    /// Number of marked cells.
    pub fn marked_cells(&self) -> u64 {
        self.faces
            .iter()
            .flatten()
            .map(|word| u64::from(word.count_ones()))
            .sum()
    }

    /// Solid angle [sr] of the marked cells, or their area [m²] for a sun.
    pub fn marked_measure(&self, launch: &Launch) -> f64 {
        let side = CELLS_PER_SIDE as f64;
        let mut sum = 0.0;
        for face in 0..self.faces.len() {
            for row in 0..CELLS_PER_SIDE {
                for column in (0..CELLS_PER_SIDE).filter(|&column| self.is_marked(face, column, row)) {
                    let low = DVec2::new(column as f64, row as f64) / side;
                    sum += launch.cell_measure(low, low + 1.0 / side);
                }
            }
        }
        sum
    }

    /// Lattice cells that touch a marked cell, over all faces: an upper bound of the rays.
    pub fn lattice_cells(&self, faces: usize, size: (usize, usize)) -> u64 {
        (0..faces)
            .into_par_iter()
            .flat_map_iter(|face| (0..size.1).map(move |row| (face, row)))
            .map(|(face, row)| {
                self.lattice_spans(face, row, size)
                    .iter()
                    .map(|(start, end)| (end - start) as u64)
                    .sum::<u64>()
            })
            .sum()
    }

    /// Lattice columns of a lattice row that touch a marked cell, as ascending, disjoint half-open spans. `size` is the
    /// lattice's columns and rows.
    pub fn lattice_spans(&self, face: usize, row: usize, size: (usize, usize)) -> Vec<(usize, usize)> {
        let (first_row, last_row) = touched(row, size.1, CELLS_PER_SIDE);
        let mut spans: Vec<(usize, usize)> = Vec::new();
        for column in 0..CELLS_PER_SIDE {
            if !(first_row..=last_row).any(|cell_row| self.is_marked(face, column, cell_row)) {
                continue;
            }
            let (start, last) = touched(column, CELLS_PER_SIDE, size.0);
            match spans.last_mut() {
                Some(span) if start <= span.1 => span.1 = last + 1,
                _ => spans.push((start, last + 1)),
            }
        }
        spans
    }
}

/// First and last of `fine` equal intervals of [0, 1] that overlap interval `index` of `coarse` ones.
fn touched(index: usize, coarse: usize, fine: usize) -> (usize, usize) {
    let first = index * fine / coarse;
    let last = ((index + 1) * fine).div_ceil(coarse) - 1;
    (first, last.min(fine - 1))
}

/// Cells of one face while they are being marked.
struct Face {
    marked: Vec<AtomicU64>,
    /// Cells that the light sends anything to: those that a spot's cone touches.
    lit: Vec<u64>,
}

impl Face {
    fn new(launch: &Launch, face: usize) -> Self {
        let side = CELLS_PER_SIDE as f64;
        let mut lit = vec![0; WORDS];
        for bit in 0..CELLS_PER_SIDE * CELLS_PER_SIDE {
            let low = DVec2::new((bit % CELLS_PER_SIDE) as f64, (bit / CELLS_PER_SIDE) as f64) / side;
            if launch.may_light_cell(face, low, low + 1.0 / side) {
                lit[bit / 64] |= 1 << (bit % 64);
            }
        }
        Self {
            marked: (0..WORDS).map(|_| AtomicU64::new(0)).collect(),
            lit,
        }
    }

    fn into_bits(self) -> Vec<u64> {
        self.marked.into_iter().map(AtomicU64::into_inner).collect()
    }

    /// Marks all lit cells that a triangle in homogeneous face coordinates touches; says whether there was one.
    fn mark_triangle(&self, launch: &Launch, corners: &[DVec3; 3]) -> bool {
        let mut polygon = Polygon::new(corners);
        if !polygon.clip_to_face() {
            return false;
        }
        let Some((low, high)) = polygon.plane_bounds() else {
            return self.mark_all();
        };
        let (columns, rows) = cell_range(launch.mapping(), low, high);
        let single = columns.0 == columns.1 && rows.0 == rows.1;
        let mut any = false;
        for row in rows.0..=rows.1 {
            for column in columns.0..=columns.1 {
                let bit = row * CELLS_PER_SIDE + column;
                let (word, mask) = (bit / 64, 1 << (bit % 64));
                if self.lit[word] & mask == 0 {
                    continue;
                }
                let marked = self.marked[word].load(Ordering::Relaxed) & mask != 0;
                // A cell that another triangle marked still has to say whether this one is seen.
                if single || polygon.touches_cell(launch, column, row) {
                    any = true;
                    if !marked {
                        self.marked[word].fetch_or(mask, Ordering::Relaxed);
                    }
                }
            }
        }
        any
    }

    /// The light touches the surface: it may see it anywhere on this face.
    fn mark_all(&self) -> bool {
        for (word, lit) in self.marked.iter().zip(&self.lit) {
            word.fetch_or(*lit, Ordering::Relaxed);
        }
        self.lit.iter().any(|lit| *lit != 0)
    }
}

/// First and last column and row of the cells that may overlap a rectangle of the face.
fn cell_range(mapping: FaceMapping, low: DVec2, high: DVec2) -> ((usize, usize), (usize, usize)) {
    let index = |share: f64| ((share * CELLS_PER_SIDE as f64).max(0.0) as usize).min(CELLS_PER_SIDE - 1);
    // v falls in magnitude with |x|, so that its extremes lie at the extremes of |x|.
    let nearest_x = if low.x <= 0.0 && high.x >= 0.0 {
        0.0
    } else {
        low.x.abs().min(high.x.abs())
    };
    let farthest_x = low.x.abs().max(high.x.abs());
    let v = |x: f64, y: f64| mapping.square_from_plane(DVec2::new(x, y)).y;
    let columns = (
        index(mapping.square_from_plane(low).x - MARGIN),
        index(mapping.square_from_plane(high).x + MARGIN),
    );
    let rows = (
        index(v(nearest_x, low.y).min(v(farthest_x, low.y)) - MARGIN),
        index(v(nearest_x, high.y).max(v(farthest_x, high.y)) + MARGIN),
    );
    (columns, rows)
}

/// A convex polygon in homogeneous face coordinates, at most a triangle clipped by four planes.
struct Polygon {
    corners: [DVec3; 8],
    count: usize,
}

impl Polygon {
    fn new(triangle: &[DVec3; 3]) -> Self {
        let mut corners = [DVec3::ZERO; 8];
        corners[..3].copy_from_slice(triangle);
        Self { corners, count: 3 }
    }

    fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    /// Keeps the part within |x| ≤ z, |y| ≤ z (a little widened); says whether anything is left.
    fn clip_to_face(&mut self) -> bool {
        let widened = 1.0 + MARGIN;
        let planes = [
            DVec3::new(1.0, 0.0, widened),
            DVec3::new(-1.0, 0.0, widened),
            DVec3::new(0.0, 1.0, widened),
            DVec3::new(0.0, -1.0, widened),
        ];
        for plane in planes {
            let outside = self
                .corners()
                .iter()
                .filter(|corner| corner.dot(plane) < 0.0)
                .count();
            if outside == self.count {
                return false;
            }
            if outside > 0 {
                self.clip(plane);
            }
        }
        self.count > 0
    }

    fn clip(&mut self, plane: DVec3) {
        let old = self.corners;
        let count = self.count;
        self.count = 0;
        for index in 0..count {
            let (a, b) = (old[index], old[(index + 1) % count]);
            let (da, db) = (a.dot(plane), b.dot(plane));
            if da >= 0.0 {
                self.push(a);
            }
            if (da < 0.0) != (db < 0.0) {
                self.push(a + (b - a) * (da / (da - db)));
            }
        }
    }

    fn push(&mut self, corner: DVec3) {
        self.corners[self.count] = corner;
        self.count += 1;
    }

    /// Bounds on the plane z = 1, within the face; `None` where the polygon reaches the light itself.
    fn plane_bounds(&self) -> Option<(DVec2, DVec2)> {
        let mut low = DVec2::INFINITY;
        let mut high = DVec2::NEG_INFINITY;
        for corner in self.corners() {
            let point = corner.truncate() / corner.z;
            if !point.is_finite() {
                return None;
            }
            (low, high) = (low.min(point), high.max(point));
        }
        Some((
            low.clamp(DVec2::NEG_ONE, DVec2::ONE),
            high.clamp(DVec2::NEG_ONE, DVec2::ONE),
        ))
    }

    /// Separating-axis test of the polygon against the bounds of a cell.
    fn touches_cell(&self, launch: &Launch, column: usize, row: usize) -> bool {
        let side = CELLS_PER_SIDE as f64;
        let square = DVec2::new(column as f64, row as f64) / side;
        let (low, high) = launch.mapping().cell_bounds(square, square + 1.0 / side);
        let (low, high) = (low - MARGIN, high + MARGIN);
        let corners = self.corners();
        for (index, a) in corners.iter().enumerate() {
            let b = corners[(index + 1) % corners.len()];
            // The plane through the light and the edge: homogeneous, so that no division loses a near corner.
            let edge = a.cross(b);
            let inside = corners
                .iter()
                .map(|corner| edge.dot(*corner))
                .fold(0.0, |m: f64, d| if d.abs() > m.abs() { d } else { m });
            let side_of = |x: f64, y: f64| edge.dot(DVec3::new(x, y, 1.0)) * inside.signum();
            let farthest = side_of(low.x, low.y)
                .max(side_of(high.x, low.y))
                .max(side_of(low.x, high.y))
                .max(side_of(high.x, high.y));
            if inside != 0.0 && farthest < 0.0 {
                return false;
            }
        }
        true
    }
}
