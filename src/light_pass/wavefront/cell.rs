//! Cells of the lattice: the segments at their corners, cut into patches along the lines where the light path changes.

use glam::DVec2;

use super::band::{Corner, SampleId, Workspace};
use super::cell_tests::worst_mismatch;
use super::edge::{Edge, EdgeCutter, EdgeReach, SUSPICION, may_bulge, mismatch};
use super::lattice_ray::LatticeRay;
use super::refine::{Refinement, RoundSet};
use super::regions::{Outline, regions, triangles};
use super::spectrum::{LightPart, NODES};
use super::subcell_features::SubcellFeatures;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::light_pass::path::PathSignature;
use crate::optics::{ColourMatrix, LinearSrgb};

/// Limits on splitting cells whose cuts leave open what lies in them. At the limit, each ray becomes one small patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SubdivisionLimits {
    /// Where cuts are ambiguous.
    pub ambiguous: u32,
    /// Where light is also shattered: it leaves the cell along very many paths.
    pub shattered: u32,
}

impl SubdivisionLimits {
    /// As far as it helps.
    pub const FULL: Self = Self {
        ambiguous: 2,
        shattered: 2,
    };

    /// Before rounds of refinement, which know better where splitting shattered light pays off.
    pub const BEFORE_ROUNDS: Self = Self {
        ambiguous: 2,
        shattered: 1,
    };

    pub const NONE: Self = Self {
        ambiguous: 0,
        shattered: 0,
    };
}

/// Mismatch along an edge above which a check ray decides between the cubic and the bilinear patch.
pub(super) const CHECK_MISMATCH: f64 = 0.08;

/// A piece of the wavefront between traced rays.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// Samples with the indices of their segments; as many as the shape has corners.
    pub corners: [(SampleId, u16); 4],
    /// Corners in the unit square.
    pub squares: [DVec2; 4],
    pub kind: PatchKind,
    pub tone: SpectralTag,
}

/// The part of a light's spectrum that a patch carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpectralTag {
    /// All of a light in RGB.
    White,
    /// The band of one of the traced wavelengths.
    Node(u8),
    /// All of a spectral light.
    Spectrum {
        /// Samples at the other wavelengths that have the same segments.
        others: [[SampleId; 4]; NODES - 1],
        /// Whether each wavelength stands for those around it, because other light of the cell is dispersed.
        parted: bool,
    },
}

/// Shape of a patch in the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PatchKind {
    /// Four corners of a rectangle, counter-clockwise from its low corner.
    Rectangle,
    /// A rectangle interpolated without derivatives.
    BilinearRectangle,
    Triangle,
    /// A triangle interpolated without derivatives.
    LinearTriangle,
    /// The rectangle between the second and third square, from the derivatives of the segment at the first.
    SingleRay,
}

impl Patch {
    /// Area in the unit square.
    pub fn area(&self) -> f64 {
        let [a, b, c, _] = self.squares;
        match self.kind {
            PatchKind::Rectangle | PatchKind::BilinearRectangle => (c.x - a.x) * (c.y - a.y),
            PatchKind::Triangle | PatchKind::LinearTriangle => 0.5 * (b - a).perp_dot(c - a).abs(),
            PatchKind::SingleRay => (c.x - b.x) * (c.y - b.y),
        }
    }

    /// Number of traced corners.
    pub fn corner_count(&self) -> usize {
        match self.kind {
            PatchKind::Rectangle | PatchKind::BilinearRectangle => 4,
            PatchKind::Triangle | PatchKind::LinearTriangle => 3,
            PatchKind::SingleRay => 1,
        }
    }
}

/// Result of cutting cells.
#[derive(Clone, Debug, Default)]
pub struct CellOutput {
    pub patches: Vec<Patch>,
    /// What surfaces on the way took, and the quadrature of what they passed on.
    pub ledger: LedgerSum,
    /// Number of cells, splits included.
    pub cells: u64,
    /// Patches that stand for a single ray.
    pub splats: u64,
}

/// Cuts cells of one face.
#[derive(Clone, Copy, Debug)]
pub struct CellCutter<'a> {
    /// Traces further rays.
    pub edges: EdgeCutter<'a>,
    /// Unit of the flux counts.
    pub unit: FluxUnit,
    /// `None` without refinement.
    pub refinement: Option<&'a Refinement<'a>>,
    /// Features that the corners alone would miss.
    pub bodies: &'a SubcellFeatures,
    pub splits: SubdivisionLimits,
    /// The light, before it is dispersed.
    pub light: LightPart<'a>,
    /// Given to all patches.
    pub tone: SpectralTag,
    /// From the flux of paths to the light's channels.
    pub channels: ColourMatrix,
    /// Signatures of light that has patches already, ascending.
    pub done: &'a [PathSignature],
    /// Signatures of surfaces whose light is booked already, ascending.
    pub booked: &'a [PathSignature],
}

/// How often a cell was divided, by reason.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Depth {
    /// Because it, or a cell around it, contains a small body.
    pub(super) bodies: u32,
    /// For bumps.
    pub(super) bumps: u32,
    /// In rounds of refinement.
    pub(super) rounds: usize,
    /// Because its cuts were ambiguous.
    pub(super) ambiguous: u32,
}

/// A cell with corners (0,0), (1,0), (1,1), (0,1) and the edges between them, each in the direction of its increasing
/// coordinate; `None` where light takes the same paths at both ends.
#[derive(Clone, Debug)]
pub struct Cell {
    pub corners: [Corner; 4],
    /// Bottom (0→1), right (1→2), top (3→2), left (0→3).
    pub edges: [Option<Edge>; 4],
    /// Rounds that divide the light beyond each edge, except the cell's own light.
    pub beside: [RoundSet; 4],
}

/// Corners at the ends of the four edges.
pub(super) const EDGE_ENDS: [(usize, usize); 4] = [(0, 1), (1, 2), (3, 2), (0, 3)];

impl Cell {
    pub(super) fn step(&self) -> DVec2 {
        self.corners[2].square - self.corners[0].square
    }

    pub(super) fn edge_step(&self, edge: usize) -> DVec2 {
        let (from, to) = EDGE_ENDS[edge];
        self.corners[to].square - self.corners[from].square
    }
}

impl CellCutter<'_> {
    /// Cuts a cell into patches.
    pub fn cut(&self, cell: &Cell, work: &mut Workspace, out: &mut CellOutput) {
        self.cut_at(cell, Depth::default(), work, out);
    }

    pub(super) fn cut_at(&self, cell: &Cell, depth: Depth, work: &mut Workspace, out: &mut CellOutput) {
        out.cells += 1;
        if self.holds_small_body(cell, depth.bodies, work) {
            let bodies = depth.bodies + 1;
            return self.split(cell, Depth { bodies, ..depth }, work, out);
        }
        if self.holds_bumps(cell, depth.bumps, work) {
            let bumps = depth.bumps + 1;
            return self.split(cell, Depth { bumps, ..depth }, work, out);
        }
        if self.is_too_coarse(cell, &depth, work) {
            let rounds = depth.rounds + 1;
            return self.split(cell, Depth { rounds, ..depth }, work, out);
        }
        let is_rough = cell.corners.iter().any(|corner| work.get(corner.sample).is_rough);
        match self.light.spectrum() {
            Some(spectrum) if is_rough => return self.scatter_spectrum(spectrum, cell, work, out),
            Some(spectrum) => return self.cut_spectrum(spectrum, cell, depth, work, out),
            None if is_rough => return self.scatter(cell, work, out),
            None => {}
        }
        if cell.edges.iter().all(Option::is_none) {
            return if depth.ambiguous < self.splits.ambiguous && self.needs_check_ray(cell, work) {
                let ambiguous = depth.ambiguous + 1;
                self.split(cell, Depth { ambiguous, ..depth }, work, out)
            } else {
                self.whole(cell, work, out)
            };
        }
        if self.is_ambiguous(cell, work) {
            // Cells that were divided for one of many small bodies are fine already.
            return if depth.ambiguous + depth.bodies.min(self.bodies.are_many())
                < self.most_splits(cell, work)
            {
                let ambiguous = depth.ambiguous + 1;
                self.split(cell, Depth { ambiguous, ..depth }, work, out)
            } else {
                self.scatter(cell, work, out)
            };
        }
        let segments = signatures(cell, work, |sample, found| {
            found.extend(sample.segments.iter().map(|segment| segment.signature));
        });
        for signature in segments.into_iter().filter(|signature| !self.is_done(*signature)) {
            for region in light_regions(cell, signature, work) {
                self.emit(cell, &region, signature, work, out);
            }
        }
        let nodes = signatures(cell, work, |sample, found| {
            found.extend(sample.nodes.iter().map(|node| node.signature));
        });
        for signature in nodes.into_iter().filter(|signature| !self.is_booked(*signature)) {
            for region in surface_regions(cell, signature, work) {
                self.book_region(&region, signature, work, out);
            }
        }
    }

    fn holds_small_body(&self, cell: &Cell, level: u32, work: &Workspace) -> bool {
        if self.bodies.is_empty() {
            return false;
        }
        let [low, _, high, _] = cell.corners.map(|corner| corner.square);
        let launch = self.edges.tracer.launch;
        // What lies behind everything that the corners hit is not visible in the cell.
        let hidden_beyond_m = cell
            .corners
            .iter()
            .map(|corner| work.get(corner.sample).stopped_m.unwrap_or(f64::INFINITY))
            .fold(0.0, f64::max);
        self.bodies
            .ask_for_finer(launch, self.edges.face, (low, high), level, hidden_beyond_m)
    }

    /// Whether the bumps of a surface are too fine for the cell.
    fn holds_bumps(&self, cell: &Cell, level: u32, work: &Workspace) -> bool {
        let samples = cell.corners.map(|corner| work.get(corner.sample));
        let bumps = &self.edges.tracer.bumps;
        bumps.ask_for_finer(&samples, cell.step(), level)
    }

    fn is_too_coarse(&self, cell: &Cell, depth: &Depth, work: &Workspace) -> bool {
        let Some(refinement) = self.refinement else {
            return false;
        };
        let beside = cell.beside.iter().fold(0, |all, rounds| all | rounds);
        let [low, _, high, _] = cell.corners.map(|corner| corner.square);
        let place = (self.edges.face, low, high);
        // Near a silhouette light lands much farther away between the corners than at them.
        let along = cell.edges.iter().flatten().flat_map(|edge| &edge.samples);
        let corners = cell.corners.iter().map(|corner| corner.sample);
        let nodes = 1..self.light.node_count();
        let others = (cell.corners.iter())
            .flat_map(|corner| nodes.clone().filter_map(|node| work.at_node(corner.sample, node)));
        let samples: Vec<&LatticeRay> = corners
            .chain(along.map(|(_, sample)| *sample))
            .chain(others)
            .map(|sample| work.get(sample))
            .collect();
        beside >> depth.rounds & 1 == 1 || refinement.is_too_coarse(place, &samples, depth.rounds)
    }

    /// Rounds that divide the light beside a cell, judged by samples on that side.
    pub fn rounds_beside(&self, own: [Corner; 4], beside: &[Corner], work: &Workspace) -> RoundSet {
        self.refinement.map_or(0, |refinement| {
            let sample = |corner: &Corner| work.get(corner.sample);
            let beside: Vec<&LatticeRay> = beside.iter().map(sample).collect();
            refinement.rounds_beside(own.map(|corner| sample(&corner)), &beside)
        })
    }

    /// For a cell whose corners agree in everything.
    fn whole(&self, cell: &Cell, work: &mut Workspace, out: &mut CellOutput) {
        self.patches(cell, work, out);
        self.book_whole(cell, cell.corners.map(|corner| corner.sample), work, out);
    }

    /// Emits the patches of a cell whose corners agree.
    pub(super) fn patches(&self, cell: &Cell, work: &mut Workspace, out: &mut CellOutput) {
        let ids = cell.corners.map(|corner| corner.sample);
        for segment in 0..work.get(ids[0]).segments.len() {
            if !self.is_done(work.get(ids[0]).segments[segment].signature) {
                let corners = ids.map(|id| (id, segment as u16));
                self.rectangle(cell, corners, work, out);
            }
        }
    }

    /// Emits the patch of one segment that all corners have.
    pub(super) fn patch(
        &self,
        cell: &Cell,
        signature: PathSignature,
        work: &mut Workspace,
        out: &mut CellOutput,
    ) {
        let corners = cell.corners.map(|corner| {
            let segment = work.get(corner.sample).find(signature);
            (corner.sample, segment.expect("all corners have it") as u16)
        });
        self.rectangle(cell, corners, work, out);
    }

    fn is_done(&self, signature: PathSignature) -> bool {
        self.done.binary_search(&signature).is_ok()
    }

    fn is_booked(&self, signature: PathSignature) -> bool {
        self.booked.binary_search(&signature).is_ok()
    }

    /// Books what surfaces did with the light of a cell whose corners agree.
    pub(super) fn book_whole(&self, cell: &Cell, ids: [SampleId; 4], work: &Workspace, out: &mut CellOutput) {
        let area = cell.step().x * cell.step().y;
        for node in 0..work.get(ids[0]).nodes.len() {
            let weighted = ids.map(|id| (id, node, 0.25 * area));
            self.book(&weighted, work, out);
        }
    }

    fn rectangle(
        &self,
        cell: &Cell,
        corners: [(SampleId, u16); 4],
        work: &mut Workspace,
        out: &mut CellOutput,
    ) {
        let step = cell.step();
        let worst = worst_mismatch(cell, corners, work);
        let mut kind = PatchKind::Rectangle;
        if worst > CHECK_MISMATCH && self.is_bilinear_better(cell, corners, step, work) {
            kind = PatchKind::BilinearRectangle;
        }
        out.patches.push(Patch {
            corners,
            squares: cell.corners.map(|corner| corner.square),
            kind,
            tone: self.tone,
        });
    }

    /// Divides a cell into four of the given depth.
    pub(super) fn split(&self, cell: &Cell, depth: Depth, work: &mut Workspace, out: &mut CellOutput) {
        let [a, b, c, d] = cell.corners;
        let middles: [Corner; 4] = std::array::from_fn(|edge| {
            let (from, to) = EDGE_ENDS[edge];
            let square = cell.corners[from].square.lerp(cell.corners[to].square, 0.5);
            match cell.edges[edge].as_ref().and_then(|edge| edge.at(0.5)) {
                Some(sample) => Corner { square, sample },
                None => self.edges.corner(square, work),
            }
        });
        let [bottom, right, top, left] = middles;
        let centre = self.edges.corner(a.square.lerp(c.square, 0.5), work);
        let mut half = |edge: usize, second: bool, ends: [Corner; 2], beyond: [Corner; 2]| {
            let (low, high) = if second { (0.5, 1.0) } else { (0.0, 0.5) };
            match &cell.edges[edge] {
                Some(edge) if edge.at(0.5).is_some() => {
                    let known = edge.part(low, high);
                    self.finish_edge(known, ends, work)
                }
                _ => self.new_edge(ends, &[beyond], depth.bumps, work),
            }
        };
        let halves = [
            [
                half(0, false, [a, bottom], [left, centre]),
                half(0, true, [bottom, b], [centre, right]),
            ],
            [
                half(1, false, [b, right], [bottom, centre]),
                half(1, true, [right, c], [centre, top]),
            ],
            [
                half(2, false, [d, top], [left, centre]),
                half(2, true, [top, c], [centre, right]),
            ],
            [
                half(3, false, [a, left], [bottom, centre]),
                half(3, true, [left, d], [centre, top]),
            ],
        ];
        let mut inner =
            |ends: [Corner; 2], beyond: [[Corner; 2]; 2]| self.new_edge(ends, &beyond, depth.bumps, work);
        let down = inner([bottom, centre], [[a, left], [b, right]]);
        let up = inner([centre, top], [[left, d], [right, c]]);
        let west = inner([left, centre], [[a, bottom], [d, top]]);
        let east = inner([centre, right], [[bottom, b], [top, c]]);
        let [[b0, b1], [r0, r1], [t0, t1], [l0, l1]] = halves;
        let children = [
            ([a, bottom, centre, left], [b0, down.clone(), west.clone(), l0]),
            ([bottom, b, right, centre], [b1, r0, east.clone(), down]),
            ([left, centre, top, d], [west, up.clone(), t0, l1]),
            ([centre, right, c, top], [east, r1, t1, up]),
        ];
        // Neighbours of a child: its siblings within the cell, the cell's own neighbours beyond it.
        const SIBLINGS: [[Option<usize>; 4]; 4] = [
            [None, Some(1), Some(2), None],
            [None, None, Some(3), Some(0)],
            [Some(0), Some(3), None, None],
            [Some(1), None, None, Some(2)],
        ];
        let corners_of = children.each_ref().map(|(corners, _)| *corners);
        for (child, (corners, edges)) in children.into_iter().enumerate() {
            let beside = std::array::from_fn(|side| match SIBLINGS[child][side] {
                Some(sibling) => self.rounds_beside(corners, &corners_of[sibling], work),
                None => cell.beside[side],
            });
            let part = Cell {
                corners,
                edges,
                beside,
            };
            self.cut_at(&part, depth, work, out);
        }
    }

    /// An edge within a cell, divided `level` times for bumps; `beyond`: pairs of samples on either side of it.
    fn new_edge(
        &self,
        ends: [Corner; 2],
        beyond: &[[Corner; 2]],
        level: u32,
        work: &mut Workspace,
    ) -> Option<Edge> {
        if self.edges.is_divided(ends, level, work) {
            return None;
        }
        let samples = |corners: [Corner; 2]| corners.map(|corner| work.get(corner.sample));
        let bulges = beyond
            .iter()
            .any(|&beyond| may_bulge(samples(ends), samples(beyond)));
        self.edges.edge(ends, bulges, work)
    }

    fn finish_edge(&self, mut edge: Edge, [from, to]: [Corner; 2], work: &mut Workspace) -> Option<Edge> {
        let step = to.square - from.square;
        if edge.samples.len() == 2 && Edge::is_plain(work.get(from.sample), work.get(to.sample), step) {
            return None;
        }
        self.edges.resolve(&mut edge, [from.square, to.square], work);
        Some(edge)
    }

    /// Represents each quarter of the cell by its corner.
    pub(super) fn scatter(&self, cell: &Cell, work: &Workspace, out: &mut CellOutput) {
        let centre = cell.corners[0].square.lerp(cell.corners[2].square, 0.5);
        for corner in cell.corners {
            self.scatter_corner(corner, centre, work, out);
        }
    }

    /// Represents the quarter of a cell between a corner and the cell's centre by that corner.
    fn scatter_corner(&self, corner: Corner, centre: DVec2, work: &Workspace, out: &mut CellOutput) {
        let (low, high) = (corner.square.min(centre), corner.square.max(centre));
        let area = (high.x - low.x) * (high.y - low.y);
        let sample = work.get(corner.sample);
        for segment in 0..sample.segments.len() {
            if self.is_done(sample.segments[segment].signature) {
                continue;
            }
            out.splats += 1;
            out.patches.push(Patch {
                corners: [(corner.sample, segment as u16); 4],
                squares: [corner.square, low, high, high],
                kind: PatchKind::SingleRay,
                tone: self.tone,
            });
        }
        for node in 0..sample.nodes.len() {
            if !self.is_booked(sample.nodes[node].signature) {
                self.book(&[(corner.sample, node, area)], work, out);
            }
        }
    }

    /// Emits a region's patches.
    pub(super) fn emit(
        &self,
        cell: &Cell,
        region: &[Outline],
        signature: PathSignature,
        work: &mut Workspace,
        out: &mut CellOutput,
    ) {
        let corner = |outline: &Outline| {
            let segment = work.get(outline.sample).find(signature);
            (
                outline.sample,
                segment.expect("regions are made of samples that have the segment") as u16,
            )
        };
        if region.len() == 4
            && region
                .iter()
                .zip(&cell.corners)
                .all(|(a, b)| a.square == b.square)
        {
            let corners = [0, 1, 2, 3].map(|index| corner(&region[index]));
            return self.rectangle(cell, corners, work, out);
        }
        for triangle in triangles(region) {
            let [a, b, c] = triangle;
            let corners = [a, b, c, c].map(|outline| corner(&outline));
            let worst = (0..3)
                .map(|i| {
                    let segment = |i: usize| {
                        let (id, segment) = corners[i];
                        &work.get(id).segments[usize::from(segment)]
                    };
                    let next = (i + 1) % 3;
                    mismatch(
                        segment(i),
                        segment(next),
                        triangle[next].square - triangle[i].square,
                    )
                })
                .fold(0.0, f64::max);
            out.patches.push(Patch {
                corners,
                squares: [a.square, b.square, c.square, c.square],
                kind: if worst > SUSPICION {
                    PatchKind::LinearTriangle
                } else {
                    PatchKind::Triangle
                },
                tone: self.tone,
            });
        }
    }

    fn book_region(
        &self,
        region: &[Outline],
        signature: PathSignature,
        work: &Workspace,
        out: &mut CellOutput,
    ) {
        for triangle in triangles(region) {
            let [a, b, c] = triangle.map(|outline| outline.square);
            let area = 0.5 * (b - a).perp_dot(c - a).abs();
            let weighted = triangle.map(|outline| {
                let node = work.get(outline.sample).find_node(signature);
                (
                    outline.sample,
                    node.expect("regions are made of samples that met the surface"),
                    area / 3.0,
                )
            });
            self.book(&weighted, work, out);
        }
    }

    /// Books what a surface did with the light of some samples, each weighted by its area of the unit square. What it
    /// passed on is booked against the flux of the segments.
    pub(super) fn book(&self, weighted: &[(SampleId, usize, f64)], work: &Workspace, out: &mut CellOutput) {
        let sum = |of: fn(&super::lattice_ray::SurfaceFluxRecord) -> LinearSrgb| {
            let sum = weighted.iter().fold(LinearSrgb::BLACK, |sum, &(id, node, area)| {
                sum + of(&work.get(id).nodes[node]) * area
            });
            self.channels.apply(sum)
        };
        let first = work.get(weighted[0].0).nodes[weighted[0].1].first;
        let incident = self.unit.count(sum(|node| node.incident));
        let taken = self.unit.count(sum(|node| node.taken));
        let kept = [
            (Account::Absorbed, self.unit.count(sum(|node| node.absorbed))),
            (Account::Depth, self.unit.count(sum(|node| node.depth))),
            (Account::Threshold, self.unit.count(sum(|node| node.threshold))),
            (Account::Unresolved, self.unit.count(sum(|node| node.unresolved))),
            (Account::NonFinite, self.unit.count(sum(|node| node.non_finite))),
            (
                Account::SwitchedOff,
                self.unit.count(sum(|node| node.switched_off)),
            ),
        ];
        // Incident flux comes from the segments that lead here, or from the light; the remainder goes into other
        // segments.
        let mut passed: [i64; 3] = std::array::from_fn(|channel| incident[channel] - taken[channel]);
        if first {
            out.ledger.book(Account::Emitted, passed);
            out.ledger.book(Account::NotEmitted, taken);
        } else {
            out.ledger.book(Account::Quadrature, passed.map(|count| -count));
        }
        for (account, count) in kept {
            out.ledger.book(account, count);
            for channel in 0..3 {
                passed[channel] -= count[channel];
            }
        }
        out.ledger.book(Account::Quadrature, passed);
    }
}

pub(super) fn reach_of(
    cell: &Cell,
    edge: usize,
    work: &Workspace,
    signature: PathSignature,
    backwards: bool,
) -> EdgeReach {
    match &cell.edges[edge] {
        Some(samples) => samples.reach(work, signature, cell.edge_step(edge), backwards),
        None => EdgeReach::Whole,
    }
}

/// The parts of a cell that light of a signature fills.
pub(super) fn light_regions(cell: &Cell, signature: PathSignature, work: &Workspace) -> Vec<Vec<Outline>> {
    regions(
        cell,
        &|edge, backwards| reach_of(cell, edge, work, signature, backwards),
        &|corner| work.get(cell.corners[corner].sample).find(signature).is_some(),
    )
}

/// The parts of a cell whose light hits a surface along the path of a signature.
pub(super) fn surface_regions(cell: &Cell, signature: PathSignature, work: &Workspace) -> Vec<Vec<Outline>> {
    let is_there = |corner: usize| {
        let sample = work.get(cell.corners[corner].sample);
        sample.find_node(signature).is_some()
    };
    regions(
        cell,
        &|edge, backwards| match &cell.edges[edge] {
            Some(edge) => edge.reach_of_node(work, signature, backwards),
            None => EdgeReach::Whole,
        },
        &is_there,
    )
}

/// All signatures at the corners, ascending.
pub(super) fn signatures(
    cell: &Cell,
    work: &Workspace,
    collect: impl Fn(&LatticeRay, &mut Vec<PathSignature>),
) -> Vec<PathSignature> {
    let mut found = Vec::new();
    for corner in &cell.corners {
        collect(work.get(corner.sample), &mut found);
    }
    found.sort_unstable();
    found.dedup();
    found
}
