//! The lattice of light rays over one light's domain: rows of cells traced and cut into patches, a band at a time.

use glam::DVec2;
use rayon::prelude::*;

use super::band::{Corner, SampleId, Samples, Workspace};
use super::cell::{Cell, CellCutter, CellOutput, Patch, SpectralTag, SubdivisionLimits};
use super::edge::{Edge, EdgeCutter, may_bulge};
use super::kept_rays::{RayCache, TracedRay};
use super::lattice_ray::LatticeRay;
use super::refine::Refinement;
use super::spectrum::LightPart;
use super::subcell_features::SubcellFeatures;
use super::trace::StrandTracer;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::item_buffer::ItemBuffer;
use crate::light_pass::ledger_sum::{Account, LedgerSum};

/// Target number of cells per band: enough work for all cores within some ten megabytes of memory.
const CELLS_PER_BAND: f64 = 4096.0;

/// A row with more cells is traced in parts.
const MAX_CELLS_OF_ROW: f64 = 4.0 * CELLS_PER_BAND;

/// Cells that are traced together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LatticeBand {
    /// Half-open range of rows.
    pub rows: (usize, usize),
    /// Half-open range of columns.
    pub columns: (usize, usize),
}

/// The lattice of one light.
#[derive(Clone, Copy, Debug)]
pub struct WavefrontLattice<'a> {
    pub tracer: StrandTracer<'a>,
    /// Marks the cells worth tracing.
    pub item_buffer: &'a ItemBuffer,
    /// Columns and rows of cells of each face.
    pub size: (usize, usize),
    /// Unit of the flux counts.
    pub unit: FluxUnit,
    /// `None` without refinement.
    pub refinement: Option<&'a Refinement<'a>>,
    /// Features that the corners alone would miss.
    pub bodies: &'a SubcellFeatures,
    pub splits: SubdivisionLimits,
    /// If this is a spectral light, `tracer` is that of its first node.
    pub light: LightPart<'a>,
}

/// Some traced rows of cells of one face.
#[derive(Clone, Debug, Default)]
pub struct TracedBand {
    /// Face of the launch domain.
    pub face: u32,
    /// All samples that patches refer to.
    pub samples: Samples,
    /// Patches, row by row.
    pub patches: Vec<Vec<Patch>>,
    /// What surfaces did with the light on its way.
    pub ledger: LedgerSum,
    /// Hits that were not cached before, in arbitrary order.
    pub fresh: Vec<TracedRay>,
    /// Light rays that needed a query.
    pub rays: u64,
    /// Closest-hit queries.
    pub segments: u64,
    pub cells: u64,
    /// Patches that stand for a single ray.
    pub splats: u64,
}

#[derive(Clone, Debug, Default)]
struct CornerRow {
    /// Index of each column's sample; `NONE` without one.
    index: Vec<u32>,
    samples: Vec<LatticeRay>,
}

const NONE: u32 = u32::MAX;

impl TracedBand {
    /// Approximate memory [bytes].
    pub fn bytes(&self) -> u64 {
        let segments: usize = self
            .samples
            .chunks
            .iter()
            .flatten()
            .map(|sample| {
                size_of::<LatticeRay>() + size_of_val(&sample.segments[..]) + size_of_val(&sample.nodes[..])
            })
            .sum();
        let patches: usize = self.patches.iter().map(|row| size_of_val(&row[..])).sum();
        (segments + patches) as u64
    }
}

impl WavefrontLattice<'_> {
    /// The same lattice with a cache of rays that were traced before.
    pub fn knowing<'b>(&'b self, kept: &'b RayCache) -> WavefrontLattice<'b> {
        let mut lattice: WavefrontLattice<'b> = *self;
        lattice.tracer.kept = Some(kept);
        lattice
    }

    /// Lattice cells that touch a marked cell of the item buffer.
    pub fn cell_count(&self) -> u64 {
        self.item_buffer
            .lattice_cells(self.tracer.launch.face_count(), self.size)
    }

    /// The bands that cover one face.
    pub fn bands(&self, face: usize) -> Vec<LatticeBand> {
        let mut bands = Vec::new();
        let (mut start, mut cells) = (0, 0.0);
        for row in 0..self.size.1 {
            let of_row = self.expected_cells(face, row);
            if of_row.iter().sum::<f64>() > MAX_CELLS_OF_ROW {
                if cells > 0.0 {
                    bands.push(self.whole_rows((start, row)));
                }
                bands.extend(self.parts_of_row(face, row, &of_row));
                (start, cells) = (row + 1, 0.0);
                continue;
            }
            cells += of_row.iter().sum::<f64>();
            if cells >= CELLS_PER_BAND {
                bands.push(self.whole_rows((start, row + 1)));
                (start, cells) = (row + 1, 0.0);
            }
        }
        if cells > 0.0 {
            bands.push(self.whole_rows((start, self.size.1)));
        }
        bands
    }

    fn whole_rows(&self, rows: (usize, usize)) -> LatticeBand {
        LatticeBand {
            rows,
            columns: (0, self.size.0),
        }
    }

    /// Approximate number of cells that each lattice cell of a row will become, span by span.
    fn expected_cells(&self, face: usize, row: usize) -> Vec<f64> {
        let spans = self.item_buffer.lattice_spans(face, row, self.size);
        let columns = spans.into_iter().flat_map(|(start, end)| start..end);
        columns
            .map(|column| {
                let corners = (self.square(column, row), self.square(column + 1, row + 1));
                self.bodies.cells_within(self.tracer.launch, face, corners)
            })
            .collect()
    }

    /// Divides a row of very many cells into parts; `expected` cells span by span.
    fn parts_of_row(&self, face: usize, row: usize, expected: &[f64]) -> Vec<LatticeBand> {
        let spans = self.item_buffer.lattice_spans(face, row, self.size);
        let columns = spans.into_iter().flat_map(|(start, end)| start..end);
        let mut parts = Vec::new();
        let (mut start, mut cells) = (0, 0.0);
        for (column, expected) in columns.zip(expected) {
            if cells > 0.0 && cells + expected > CELLS_PER_BAND {
                parts.push((start, column));
                (start, cells) = (column, 0.0);
            }
            cells += expected;
        }
        parts.push((start, self.size.0));
        let band = |columns| LatticeBand {
            rows: (row, row + 1),
            columns,
        };
        parts.into_iter().map(band).collect()
    }

    /// Spans of a row's columns that belong to a band.
    fn spans(&self, face: usize, row: usize, columns: (usize, usize)) -> Vec<(usize, usize)> {
        let spans = self.item_buffer.lattice_spans(face, row, self.size);
        spans
            .into_iter()
            .map(|(start, end)| (start.max(columns.0), end.min(columns.1)))
            .filter(|(start, end)| start < end)
            .collect()
    }

    fn square(&self, column: usize, row: usize) -> DVec2 {
        DVec2::new(
            column as f64 / self.size.0 as f64,
            row as f64 / self.size.1 as f64,
        )
    }

    /// Traces a band of a face and cuts its cells into patches.
    ///
    /// A row of corners between two bands is traced twice: the extra rays are few, and bands stay independent.
    pub fn trace(&self, face: usize, band: LatticeBand) -> TracedBand {
        let first_row = band.rows.0;
        let rows = band.rows.1 - first_row;
        let nodes = self.light.node_count();
        let mut corner_rows: Vec<CornerRow> = (0..=rows)
            .into_par_iter()
            .map(|row| self.trace_corners(face, first_row + row, band))
            .collect();
        let others: Vec<CornerRow> = (rows + 1..nodes * (rows + 1))
            .into_par_iter()
            .map(|row| {
                let (node, row) = (row / (rows + 1), row % (rows + 1));
                self.trace_again(face, node, &corner_rows[row])
            })
            .collect();
        corner_rows.extend(others);
        let mut samples = Samples::default();
        let mut index = Vec::with_capacity(rows + 1);
        for row in corner_rows {
            samples.chunks.push(row.samples);
            index.push(row.index);
        }
        let edges_of_rows: Vec<(Vec<Option<Edge>>, Vec<LatticeRay>)> = (0..=rows)
            .into_par_iter()
            .map(|row| {
                let mut work = Workspace::new(&samples, nodes * (rows + 1) + row, rows + 1);
                let edges = self.edges_across(face, (first_row, row), &index, &mut work);
                (edges, work.own)
            })
            .collect();
        let mut edges = Vec::with_capacity(rows + 1);
        for (row_edges, own) in edges_of_rows {
            samples.chunks.push(own);
            edges.push(row_edges);
        }
        let cut: Vec<(CellOutput, Vec<LatticeRay>)> = (0..rows)
            .into_par_iter()
            .map(|row| {
                let mut work = Workspace::new(&samples, (nodes + 1) * (rows + 1) + row, rows + 1);
                let output = self.cut_row(
                    face,
                    (first_row, row, band.columns),
                    &index,
                    [&edges[row], &edges[row + 1]],
                    &mut work,
                );
                (output, work.own)
            })
            .collect();
        let mut traced = TracedBand {
            face: face as u32,
            ..TracedBand::default()
        };
        for (output, own) in cut {
            samples.chunks.push(own);
            traced.ledger.merge(&output.ledger);
            traced.cells += output.cells;
            traced.splats += output.splats;
            traced.patches.push(output.patches);
        }
        for sample in samples.chunks.iter_mut().flatten() {
            traced.rays += u64::from(sample.queries > 0);
            traced.segments += u64::from(sample.queries);
            traced.fresh.extend(sample.fresh.take().map(|fresh| *fresh));
        }
        traced.samples = samples;
        traced
    }

    /// Traces a row of corners, as far as cells of the band above or below use them.
    fn trace_corners(&self, face: usize, row: usize, band: LatticeBand) -> CornerRow {
        let mut traced = CornerRow {
            index: vec![NONE; self.size.0 + 1],
            samples: Vec::new(),
        };
        let mut wanted = vec![false; self.size.0 + 1];
        for cell_row in [row.wrapping_sub(1), row] {
            if cell_row >= band.rows.0 && cell_row < band.rows.1 {
                for (start, end) in self.spans(face, cell_row, band.columns) {
                    wanted[start..=end].fill(true);
                }
            }
        }
        for (column, _) in wanted.iter().enumerate().filter(|(_, wanted)| **wanted) {
            traced.index[column] = traced.samples.len() as u32;
            let square = self.square(column, row);
            traced.samples.push(self.tracer.trace(face, square));
        }
        traced
    }

    /// The same corners at another wavelength.
    fn trace_again(&self, face: usize, node: usize, first: &CornerRow) -> CornerRow {
        let tracer = self.tracer.at_node(self.light, node);
        let samples = first.samples.iter();
        let samples = samples.map(|other| tracer.trace_again(face, other));
        CornerRow {
            index: first.index.clone(),
            samples: samples.collect(),
        }
    }

    /// Edges along row `row` of the band's corners; `None` where the path of light does not change.
    fn edges_across(
        &self,
        face: usize,
        (first_row, row): (usize, usize),
        index: &[Vec<u32>],
        work: &mut Workspace,
    ) -> Vec<Option<Edge>> {
        let corner = |row: usize, column: usize| self.corner_at(first_row, row, column, index);
        let beside = [row.checked_sub(1), Some(row + 1).filter(|row| *row < index.len())];
        (0..self.size.0)
            .map(|column| {
                let ends = [corner(row, column)?, corner(row, column + 1)?];
                let bulges = beside.iter().flatten().any(|&row| {
                    let beyond = [corner(row, column), corner(row, column + 1)];
                    may_bulge_over(ends, beyond, work)
                });
                let edges = self.edge_cutter(face);
                if edges.is_divided(ends, 0, work) {
                    return None;
                }
                edges.edge(ends, bulges, work)
            })
            .collect()
    }

    /// A traced corner of a band whose first row is `first_row`; `None` where none was traced.
    fn corner_at(&self, first_row: usize, row: usize, column: usize, index: &[Vec<u32>]) -> Option<Corner> {
        let place = *index.get(row)?.get(column)?;
        (place != NONE).then(|| Corner {
            square: self.square(column, first_row + row),
            sample: SampleId {
                chunk: row as u32,
                index: place,
            },
        })
    }

    fn edge_cutter(&self, face: usize) -> EdgeCutter<'_> {
        EdgeCutter {
            tracer: &self.tracer,
            face,
        }
    }

    fn cut_row(
        &self,
        face: usize,
        (first_row, row, columns): (usize, usize, (usize, usize)),
        index: &[Vec<u32>],
        across: [&[Option<Edge>]; 2],
        work: &mut Workspace,
    ) -> CellOutput {
        let mut output = CellOutput::default();
        let cutter = CellCutter {
            edges: self.edge_cutter(face),
            unit: self.unit,
            refinement: self.refinement,
            bodies: self.bodies,
            splits: self.splits,
            light: self.light,
            tone: match self.light {
                LightPart::White => SpectralTag::White,
                LightPart::Spectrum(_) | LightPart::Band(_) => SpectralTag::Node(0),
            },
            channels: self.light.channels(),
            done: &[],
            booked: &[],
        };
        let corner = |row: usize, column: usize| self.corner_at(first_row, row, column, index);
        let down = |column: usize, work: &mut Workspace| {
            let ends = [corner(row, column)?, corner(row + 1, column)?];
            if cutter.edges.is_divided(ends, 0, work) {
                return None;
            }
            let bulges = [column.checked_sub(1), Some(column + 1)]
                .into_iter()
                .flatten()
                .any(|column| may_bulge_over(ends, [corner(row, column), corner(row + 1, column)], work));
            cutter.edges.edge(ends, bulges, work)
        };
        for (start, end) in self.spans(face, first_row + row, columns) {
            let mut left = down(start, work);
            #[allow(clippy::needless_range_loop, reason = "columns name corners of both rows")]
            for column in start..end {
                let right = down(column + 1, work);
                let corners = [
                    corner(row, column),
                    corner(row, column + 1),
                    corner(row + 1, column + 1),
                    corner(row + 1, column),
                ];
                let [Some(a), Some(b), Some(c), Some(d)] = corners else {
                    continue;
                };
                let beyond = [
                    (row.checked_sub(1), Some(column), (0, 1)),
                    (Some(row), Some(column + 2), (1, 0)),
                    (Some(row + 2), Some(column), (0, 1)),
                    (Some(row), column.checked_sub(1), (1, 0)),
                ];
                let own = [a, b, c, d];
                let beside = beyond.map(|(row, column, (across, down))| {
                    let (Some(row), Some(column)) = (row, column) else {
                        return 0;
                    };
                    let ends = [corner(row, column), corner(row + down, column + across)];
                    let [Some(first), Some(second)] = ends else {
                        return 0;
                    };
                    cutter.rounds_beside(own, &[first, second], work)
                });
                let cell = Cell {
                    beside,
                    corners: own,
                    edges: [
                        across[0][column].clone(),
                        right.clone(),
                        across[1][column].clone(),
                        left,
                    ],
                };
                self.book_not_emitted(&cell, work, &mut output);
                cutter.cut(&cell, work, &mut output);
                left = right;
            }
        }
        output
    }

    /// Books flux of a cell whose first hit is not specular.
    fn book_not_emitted(&self, cell: &Cell, work: &Workspace, output: &mut CellOutput) {
        let step = cell.corners[2].square - cell.corners[0].square;
        let quarter = 0.25 * step.x * step.y;
        let channels = self.light.channels();
        for corner in &cell.corners {
            let missed_w = channels.apply(work.get(corner.sample).not_emitted) * quarter;
            output.ledger.book(Account::NotEmitted, self.unit.count(missed_w));
        }
    }
}

/// Whether something may bulge over an edge towards two corners beyond it.
fn may_bulge_over(ends: [Corner; 2], beyond: [Option<Corner>; 2], work: &Workspace) -> bool {
    let [Some(a), Some(b)] = beyond else {
        return false;
    };
    let samples = |corners: [Corner; 2]| corners.map(|corner| work.get(corner.sample));
    may_bulge(samples(ends), samples([a, b]))
}
