//! Cells of a spectral light: one patch for all wavelengths where their paths and borders agree, and one per traced
//! wavelength elsewhere.

use super::band::{Corner, SampleId, Workspace};
use super::cell::{
    Cell, CellCutter, CellOutput, Depth, EDGE_ENDS, Patch, SpectralTag, light_regions, reach_of, signatures,
    surface_regions,
};
use super::edge::{Edge, EdgeCutter, EdgeReach, is_suspicious, same_ways};
use super::lattice_ray::LatticeRay;
use super::regions::{Outline, triangles};
use super::spectrum::{LightPart, LightSpectrum, NODES};
use super::subcell_features::SubcellFeatures;
use crate::light_pass::path::PathSignature;

/// Samples at a cell's corners by wavelength.
type NodeCorners = [[SampleId; 4]; NODES];

/// What all wavelengths of a cell share.
#[derive(Default)]
struct Shared {
    /// Signatures of light that has patches, ascending.
    done: Vec<PathSignature>,
    /// Signatures of surfaces whose light is booked, ascending.
    booked: Vec<PathSignature>,
}

impl CellCutter<'_> {
    /// Cuts a cell that is not divided further.
    pub(super) fn cut_spectrum(
        &self,
        spectrum: &LightSpectrum,
        cell: &Cell,
        depth: Depth,
        work: &mut Workspace,
        out: &mut CellOutput,
    ) {
        let nodes = self.node_corners(cell, work);
        let is_one = is_one(cell, &nodes, work);
        let is_unclear = |work: &mut Workspace| {
            if cell.edges.iter().all(Option::is_none) {
                is_one && self.needs_check_ray(cell, work)
            } else {
                self.is_ambiguous(cell, work)
            }
        };
        if depth.ambiguous < self.most_splits(cell, work) && is_unclear(work) {
            let ambiguous = depth.ambiguous + 1;
            return self.split(cell, Depth { ambiguous, ..depth }, work, out);
        }
        let mut shared = Shared {
            done: alike(cell, &nodes, work),
            booked: Vec::new(),
        };
        for &signature in &shared.done {
            let first = out.patches.len();
            self.patch(cell, signature, work, out);
            let others = std::array::from_fn(|other| nodes[other + 1]);
            for patch in &mut out.patches[first..] {
                patch.tone = SpectralTag::Spectrum {
                    others,
                    parted: !is_one,
                };
            }
        }
        if is_one {
            for (node, corners) in nodes.iter().enumerate() {
                let of_node = CellCutter {
                    channels: spectrum.interpolated[node],
                    ..*self
                };
                of_node.book_whole(cell, *corners, work, out);
            }
            return;
        }
        if self.is_ambiguous(cell, work) {
            return self.scatter_nodes(spectrum, cell, (&nodes, &shared.done), work, out);
        }
        self.cut_shared(spectrum, cell, &nodes, &mut shared, work, out);
        for (node, corners) in nodes.iter().enumerate() {
            self.cut_node(spectrum, node, cell, (*corners, &shared), depth, work, out);
        }
    }

    /// Represents each quarter of the cell by its corner.
    pub(super) fn scatter_spectrum(
        &self,
        spectrum: &LightSpectrum,
        cell: &Cell,
        work: &mut Workspace,
        out: &mut CellOutput,
    ) {
        let nodes = self.node_corners(cell, work);
        self.scatter_nodes(spectrum, cell, (&nodes, &[]), work, out);
    }

    /// Scatters the light that has no patches yet, each wavelength on its own.
    fn scatter_nodes(
        &self,
        spectrum: &LightSpectrum,
        cell: &Cell,
        (nodes, done): (&NodeCorners, &[PathSignature]),
        work: &Workspace,
        out: &mut CellOutput,
    ) {
        for (node, samples) in nodes.iter().enumerate() {
            let of_node = CellCutter {
                tone: SpectralTag::Node(node as u8),
                channels: spectrum.nodes[node].channels,
                done,
                ..*self
            };
            let seen = Cell {
                corners: std::array::from_fn(|corner| Corner {
                    sample: samples[corner],
                    square: cell.corners[corner].square,
                }),
                edges: Default::default(),
                beside: [0; 4],
            };
            of_node.scatter(&seen, work, out);
        }
    }

    fn node_corners(&self, cell: &Cell, work: &mut Workspace) -> NodeCorners {
        std::array::from_fn(|node| {
            cell.corners
                .map(|corner| self.sample_of(node, corner.sample, work))
        })
    }

    /// The sample of a wavelength where the first one was traced.
    fn sample_of(&self, node: usize, first: SampleId, work: &mut Workspace) -> SampleId {
        match (node, work.at_node(first, node)) {
            (0, _) => first,
            (_, Some(sample)) => sample,
            (_, None) => {
                let tracer = self.edges.tracer.at_node(self.light, node);
                let edges = EdgeCutter {
                    tracer: &tracer,
                    face: self.edges.face,
                };
                edges.again(first, work)
            }
        }
    }

    /// Emits patches and books fluxes that all wavelengths share up to the same borders, such as those of surfaces that
    /// light hits before it is dispersed.
    fn cut_shared(
        &self,
        spectrum: &LightSpectrum,
        cell: &Cell,
        nodes: &NodeCorners,
        shared: &mut Shared,
        work: &mut Workspace,
        out: &mut CellOutput,
    ) {
        let segments = signatures(cell, work, |sample, found| {
            found.extend(sample.segments.iter().map(|segment| segment.signature));
        });
        let has_segment = |sample: &LatticeRay, signature| sample.find(signature).is_some();
        for signature in segments {
            if let Err(place) = shared.done.binary_search(&signature)
                && is_at_the_same_corners(nodes, work, |sample| has_segment(sample, signature))
                && self.emit_shared(cell, signature, work, out)
            {
                shared.done.insert(place, signature);
            }
        }
        let surfaces = signatures(cell, work, |sample, found| {
            found.extend(sample.nodes.iter().map(|node| node.signature));
        });
        let has_surface = |sample: &LatticeRay, signature| sample.find_node(signature).is_some();
        for signature in surfaces {
            if is_at_the_same_corners(nodes, work, |sample| has_surface(sample, signature))
                && self.book_shared(spectrum, cell, signature, work, out)
            {
                shared.booked.push(signature);
            }
        }
    }

    /// Emits patches for light that fills the same parts of the cell at all wavelengths. Returns false, and emits none,
    /// where that is not so.
    fn emit_shared(
        &self,
        cell: &Cell,
        signature: PathSignature,
        work: &mut Workspace,
        out: &mut CellOutput,
    ) -> bool {
        let mut made = CellOutput::default();
        for region in light_regions(cell, signature, work) {
            self.emit(cell, &region, signature, work, &mut made);
        }
        for patch in &mut made.patches {
            let Some(others) = self.others_of(patch, signature, work) else {
                return false;
            };
            patch.tone = SpectralTag::Spectrum { others, parted: true };
        }
        out.patches.append(&mut made.patches);
        true
    }

    /// Samples of the other wavelengths at a patch's corners; `None` unless all have its light.
    fn others_of(
        &self,
        patch: &Patch,
        signature: PathSignature,
        work: &mut Workspace,
    ) -> Option<[[SampleId; 4]; NODES - 1]> {
        let mut others = [[patch.corners[0].0; 4]; NODES - 1];
        for (node, others) in others.iter_mut().enumerate() {
            for (corner, other) in others.iter_mut().enumerate() {
                *other = self.sample_of(node + 1, patch.corners[corner].0, work);
                work.get(*other).find(signature)?;
            }
        }
        Some(others)
    }

    /// Books what a surface did with light that hits it in the same parts of the cell at all wavelengths. Returns
    /// false, and books nothing, where that is not so.
    fn book_shared(
        &self,
        spectrum: &LightSpectrum,
        cell: &Cell,
        signature: PathSignature,
        work: &mut Workspace,
        out: &mut CellOutput,
    ) -> bool {
        let regions = surface_regions(cell, signature, work);
        let triangles: Vec<[Outline; 3]> = regions.iter().flat_map(|region| triangles(region)).collect();
        let mut found = Vec::new();
        for node in 0..NODES {
            for triangle in &triangles {
                let [a, b, c] = triangle.map(|outline| outline.square);
                let area = 0.5 * (b - a).perp_dot(c - a).abs();
                let mut weighted = [(triangle[0].sample, 0, area / 3.0); 3];
                for (outline, weighted) in triangle.iter().zip(&mut weighted) {
                    let sample = self.sample_of(node, outline.sample, work);
                    let Some(surface) = work.get(sample).find_node(signature) else {
                        return false;
                    };
                    (weighted.0, weighted.1) = (sample, surface);
                }
                found.push((node, weighted));
            }
        }
        for (node, weighted) in found {
            let of_node = CellCutter {
                channels: spectrum.nodes[node].channels,
                ..*self
            };
            of_node.book(&weighted, work, out);
        }
        true
    }

    /// Cuts the cell as one wavelength sees it, without the light that all wavelengths share.
    #[allow(
        clippy::too_many_arguments,
        reason = "one call site; a cell's state travels through it"
    )]
    fn cut_node(
        &self,
        spectrum: &LightSpectrum,
        node: usize,
        cell: &Cell,
        (corners, shared): ([SampleId; 4], &Shared),
        depth: Depth,
        work: &mut Workspace,
        out: &mut CellOutput,
    ) {
        let tracer = self.edges.tracer.at_node(self.light, node);
        let edges = EdgeCutter {
            tracer: &tracer,
            face: self.edges.face,
        };
        let none = SubcellFeatures::default();
        let cutter = CellCutter {
            edges,
            unit: self.unit,
            refinement: None,
            bodies: &none,
            splits: self.splits,
            light: LightPart::White,
            tone: SpectralTag::Node(node as u8),
            channels: spectrum.nodes[node].channels,
            done: &shared.done,
            booked: &shared.booked,
        };
        let corners: [Corner; 4] = std::array::from_fn(|corner| Corner {
            square: cell.corners[corner].square,
            sample: corners[corner],
        });
        let rest = UnsharedLight::of(shared, &corners, work);
        let edges = match rest {
            UnsharedLight::Nothing => return,
            _ if node == 0 => cell.edges.clone(),
            UnsharedLight::Dim => Default::default(),
            UnsharedLight::Bright => {
                EDGE_ENDS.map(|(from, to)| edges.edge([corners[from], corners[to]], false, work))
            }
        };
        let seen = Cell {
            corners,
            edges,
            beside: [0; 4],
        };
        if rest == UnsharedLight::Dim {
            cutter.scatter(&seen, work, out);
        } else {
            cutter.cut_at(&seen, depth, work, out);
        }
    }
}

/// Light below this share of the brightest is not cut wavelength by wavelength.
const DIM_SHARE: f64 = 0.01;

/// Light of a cell's corners that not all wavelengths share.
#[derive(Clone, Copy, PartialEq, Eq)]
enum UnsharedLight {
    Nothing,
    Dim,
    Bright,
}

impl UnsharedLight {
    fn of(shared: &Shared, corners: &[Corner; 4], work: &Workspace) -> Self {
        let samples = corners.map(|corner| work.get(corner.sample));
        let brightest_w = samples
            .iter()
            .map(|sample| sample.brightest_w)
            .fold(0.0, f64::max);
        let segments = samples.iter().flat_map(|sample| &sample.segments);
        let rest = segments.filter(|segment| shared.done.binary_search(&segment.signature).is_err());
        let most_w = rest.map(|segment| segment.flux_w.luminance()).reduce(f64::max);
        let is_booked = samples
            .iter()
            .flat_map(|sample| &sample.nodes)
            .all(|node| shared.booked.binary_search(&node.signature).is_ok());
        match most_w {
            None if is_booked => Self::Nothing,
            None => Self::Dim,
            Some(most_w) if most_w <= DIM_SHARE * brightest_w => Self::Dim,
            Some(_) => Self::Bright,
        }
    }
}

/// Whether something exists at the same corners at all wavelengths.
fn is_at_the_same_corners(
    nodes: &NodeCorners,
    work: &Workspace,
    is_there: impl Fn(&LatticeRay) -> bool,
) -> bool {
    (0..4).all(|corner| {
        let first = is_there(work.get(nodes[0][corner]));
        let mut others = nodes[1..].iter();
        others.all(|corners| is_there(work.get(corners[corner])) == first)
    })
}

/// Whether light of all wavelengths takes the same paths at all corners, on one sheet.
fn is_one(cell: &Cell, nodes: &NodeCorners, work: &Workspace) -> bool {
    let is_plain = |corners: &[SampleId; 4]| {
        EDGE_ENDS.iter().enumerate().all(|(edge, &(from, to))| {
            let ends = [from, to].map(|end| work.get(corners[end]));
            Edge::is_plain(ends[0], ends[1], cell.edge_step(edge))
        })
    };
    let first = work.get(nodes[0][0]);
    cell.edges.iter().all(Option::is_none)
        && nodes[1..]
            .iter()
            .all(|corners| same_ways(first, work.get(corners[0])) && is_plain(corners))
}

/// Signatures of light that takes the same path at all corners and wavelengths, on one sheet; ascending.
fn alike(cell: &Cell, nodes: &NodeCorners, work: &Workspace) -> Vec<PathSignature> {
    let is_alike = |signature: &PathSignature| {
        let is_everywhere = nodes
            .iter()
            .flatten()
            .all(|sample| work.get(*sample).find(*signature).is_some());
        let is_whole =
            || (0..4).all(|edge| reach_of(cell, edge, work, *signature, false) == EdgeReach::Whole);
        let is_smooth = |corners: &[SampleId; 4]| {
            EDGE_ENDS.iter().enumerate().all(|(edge, &(from, to))| {
                let ends = [from, to].map(|end| work.get(corners[end]));
                !is_suspicious(ends[0], ends[1], *signature, cell.edge_step(edge))
            })
        };
        is_everywhere && is_whole() && nodes[1..].iter().all(is_smooth)
    };
    let first = work.get(nodes[0][0]);
    let signatures = first.segments.iter().map(|segment| segment.signature);
    signatures.filter(is_alike).collect()
}
