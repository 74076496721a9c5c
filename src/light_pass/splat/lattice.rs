//! The lattice of light rays over a launch domain, traced a band of rows at a time, so that memory does not grow with
//! the number of rays.

use glam::{DVec2, DVec3};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use crate::geometry::sampling::mix64;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::item_buffer::ItemBuffer;
use crate::light_pass::launch::Launch;
use crate::light_pass::ledger_sum::LedgerSum;
use crate::light_pass::path::{Arrival, PathLimits, PathTracer};
use crate::light_pass::spectral_node::SpectralNode;
use crate::scene::Scene;
use crate::settings::RayPlacement;
use crate::transport::Tracer;

/// Everything needed to trace the lattice of one light.
#[derive(Clone, Copy, Debug)]
pub struct Lattice<'a> {
    pub tracer: &'a Tracer,
    /// The wavelength of its rays; `None` for RGB.
    pub band: Option<&'a SpectralNode>,
    pub launch: &'a Launch,
    /// Marks the cells worth tracing.
    pub item_buffer: &'a ItemBuffer,
    /// Columns and rows of each face.
    pub size: (usize, usize),
    /// Only every n-th column and row is traced, and its arrivals represent as many cells; 1 for the whole lattice. The
    /// ledger covers the traced rays alone.
    pub strides: (usize, usize),
    /// Placement of rays within their cells.
    pub placement: RayPlacement,
    /// Common place of the rays within their cells for [`RayPlacement::Lattice`], [0, 1)².
    pub centre: DVec2,
    /// Seed of the jitter.
    pub seed: u64,
    pub limits: PathLimits,
    /// Unit of the flux counts.
    pub unit: FluxUnit,
}

/// One traced row: arrivals in ascending order of their columns.
#[derive(Clone, Debug, Default)]
pub struct TracedRow {
    /// Column of each arrival.
    pub columns: Vec<u32>,
    pub arrivals: Vec<Arrival>,
    pub ledger: LedgerSum,
    /// Rays launched.
    pub rays: u64,
    /// Closest-hit queries.
    pub segments: u64,
}

impl TracedRow {
    /// The arrival in a column that took the same path to the same receiver as `like`; `start` is the column's first
    /// arrival or beyond it.
    pub fn matching_from(&self, start: usize, column: u32, like: &Arrival) -> Option<&Arrival> {
        self.columns[start..]
            .iter()
            .zip(&self.arrivals[start..])
            .take_while(|(c, _)| **c == column)
            .map(|(_, arrival)| arrival)
            .find(|arrival| arrival.receiver == like.receiver && arrival.signature == like.signature)
    }
}

/// Positions of arrivals; caches the last triangle.
pub(super) struct Points<'a> {
    scene: &'a Scene,
    /// Object, triangle, its corners.
    last: Option<(usize, u32, [DVec3; 3])>,
}

impl<'a> Points<'a> {
    pub(super) fn new(scene: &'a Scene) -> Self {
        Self { scene, last: None }
    }

    /// Position of an arrival [m], a function of its triangle and barycentric coordinates alone.
    pub(super) fn of(&mut self, arrival: &Arrival) -> DVec3 {
        let (object, triangle) = (arrival.receiver.object(), arrival.triangle);
        let [a, b, c] = match self.last {
            Some((o, t, corners)) if o == object && t == triangle => corners,
            _ => {
                let mesh = self.scene.objects[object].mesh_in_scene();
                let corners = mesh.corners(triangle as usize);
                self.last = Some((object, triangle, corners));
                corners
            }
        };
        let DVec2 { x: wb, y: wc } = arrival.barycentric;
        a * (1.0 - wb - wc) + b * wb + c * wc
    }
}

/// Half-open range of columns (rows) of the whole lattice that a traced one represents.
fn group(index: usize, stride: usize, size: usize) -> (usize, usize) {
    (index * stride, ((index + 1) * stride).min(size))
}

impl Lattice<'_> {
    /// Traced columns and rows of each face.
    pub fn traced_size(&self) -> (usize, usize) {
        (
            self.size.0.div_ceil(self.strides.0),
            self.size.1.div_ceil(self.strides.1),
        )
    }

    /// Corners of the part of its face's unit square that a traced ray represents.
    pub fn cell(&self, column: usize, row: usize) -> (DVec2, DVec2) {
        let size = DVec2::new(self.size.0 as f64, self.size.1 as f64);
        let (left, right) = group(column, self.strides.0, self.size.0);
        let (top, bottom) = group(row, self.strides.1, self.size.1);
        (
            DVec2::new(left as f64, top as f64) / size,
            DVec2::new(right as f64, bottom as f64) / size,
        )
    }

    /// Number of cells of the whole lattice that a traced ray represents.
    pub fn cells_of(&self, column: usize, row: usize) -> f64 {
        let (left, right) = group(column, self.strides.0, self.size.0);
        let (top, bottom) = group(row, self.strides.1, self.size.1);
        ((right - left) * (bottom - top)) as f64
    }

    /// Row of the whole lattice that is traced as row `row`.
    pub fn fine_row(&self, row: usize) -> usize {
        let (top, bottom) = group(row, self.strides.1, self.size.1);
        (top + bottom) / 2
    }

    /// Traced index of a column of the whole lattice; `None` where it is skipped.
    pub fn coarse_column(&self, column: usize) -> Option<usize> {
        let coarse = column / self.strides.0;
        let (left, right) = group(coarse, self.strides.0, self.size.0);
        (column == (left + right) / 2).then_some(coarse)
    }

    /// Upper bound on the rays: lattice cells that touch a marked cell of the item buffer.
    pub fn ray_count(&self) -> u64 {
        self.item_buffer
            .lattice_cells(self.launch.face_count(), self.size)
    }

    /// Upper bound on the rays of a traced row.
    pub fn row_ray_count(&self, face: usize, row: usize) -> usize {
        let spans = self
            .item_buffer
            .lattice_spans(face, self.fine_row(row), self.size);
        spans
            .iter()
            .map(|(start, end)| (end - start).div_ceil(self.strides.0))
            .sum()
    }

    /// Traces one row of one face.
    pub fn trace_row(&self, face: usize, row: usize) -> TracedRow {
        // With strides, a row of the whole lattice stands for several.
        let mut traced = TracedRow::default();
        let fine_row = self.fine_row(row);
        if fine_row >= self.size.1 {
            return traced;
        }

        // Places and seeds are those of the whole lattice, so that a run with strides traces a part of its rays.
        let mut points = Points::new(self.tracer.scene());
        let whole = Self {
            strides: (1, 1),
            ..*self
        };
        let mut paths = match self.band {
            Some(band) => PathTracer::new(&band.tracer, self.limits, self.unit).with_channels(band.channels),
            None => PathTracer::new(self.tracer, self.limits, self.unit),
        };

        // Only cells that touch a marked cell of the item buffer can meet a specular surface.
        for (start, end) in self.item_buffer.lattice_spans(face, fine_row, self.size) {
            for fine_column in start..end {
                let Some(column) = self.coarse_column(fine_column) else {
                    continue;
                };

                // The flux of a cell travels along one ray.
                let (low, high) = whole.cell(fine_column, fine_row);
                let square = low + (high - low) * self.place(face, fine_column, fine_row);
                let ray = self.launch.ray(face, square);
                let flux_w = self.launch.cell_flux_w(low, high, ray.direction);
                if flux_w.max_channel() <= 0.0 {
                    continue;
                }

                // Microfacets are drawn by cell, independent of the order of tracing.
                traced.rays += 1;
                let cell_seed = self.cell_seed(face, fine_column, fine_row);
                paths.limits.microfacets = self.limits.microfacets.map(|seed| mix64(seed ^ cell_seed));
                paths.trace(ray, flux_w, self.launch.media(), |mut arrival, _| {
                    arrival.point = points.of(&arrival);
                    arrival.flux_w = arrival.flux_w * self.cells_of(column, row);
                    traced.columns.push(column as u32);
                    traced.arrivals.push(arrival);
                });
            }
        }
        traced.ledger = paths.ledger;
        traced.segments = paths.segments;
        traced
    }

    /// A seed per cell: independent of the order of tracing.
    fn cell_seed(&self, face: usize, column: usize, row: usize) -> u64 {
        let cell = (face as u64) << 60 ^ (row as u64) << 30 ^ column as u64;
        self.seed.rotate_left(17) ^ cell
    }

    /// Place of the ray within its cell, [0, 1)².
    fn place(&self, face: usize, column: usize, row: usize) -> DVec2 {
        match self.placement {
            RayPlacement::Lattice => self.centre,
            RayPlacement::Jittered => {
                let mut generator = Pcg64Mcg::seed_from_u64(self.cell_seed(face, column, row));
                let unit = |bits: u64| (bits >> 11) as f64 * (-53_f64).exp2();
                DVec2::new(unit(generator.next_u64()), unit(generator.next_u64()))
            }
        }
    }
}
