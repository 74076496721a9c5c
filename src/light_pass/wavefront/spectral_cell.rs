//! Cells of a spectral light: one patch for all wavelengths where they go the same ways, one for each traced wavelength
//! where they do not.

use super::band::{Corner, SampleId, Workspace};
use super::bodies::SmallBodies;
use super::cell::{Cell, CellCutter, CellOutput, DEEPEST_SPLIT, Depth, EDGE_ENDS, Tone, reach_of};
use super::edge::{Edge, EdgeCutter, Reach, is_suspicious, same_ways};
use super::spectrum::{LightPart, LightSpectrum, NODES};
use crate::light_pass::caustic::path::PathSignature;

/// Samples at a cell's corners, wavelength by wavelength.
type NodeCorners = [[SampleId; 4]; NODES];

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
        if is_one && depth.ambiguous < DEEPEST_SPLIT && self.is_doubtful(cell, work) {
            let ambiguous = depth.ambiguous + 1;
            return self.split(cell, Depth { ambiguous, ..depth }, work, out);
        }
        let alike = alike(cell, &nodes, work);
        let all = CellCutter {
            tone: Tone::Spectrum {
                others: std::array::from_fn(|other| nodes[other + 1]),
                parted: !is_one,
            },
            ..*self
        };
        for &signature in &alike {
            all.patch(cell, signature, work, out);
        }
        for (node, corners) in nodes.iter().enumerate() {
            if is_one {
                let of_node = CellCutter {
                    channels: spectrum.interpolated[node],
                    ..*self
                };
                of_node.book_whole(cell, *corners, work, out);
            } else {
                self.cut_node(spectrum, node, cell, (*corners, &alike), depth, work, out);
            }
        }
    }

    fn node_corners(&self, cell: &Cell, work: &mut Workspace) -> NodeCorners {
        std::array::from_fn(|node| {
            cell.corners
                .map(|corner| match (node, work.at_node(corner.sample, node)) {
                    (0, _) => corner.sample,
                    (_, Some(sample)) => sample,
                    (_, None) => {
                        let tracer = self.edges.tracer.at_node(self.light, node);
                        let edges = EdgeCutter {
                            tracer: &tracer,
                            face: self.edges.face,
                        };
                        edges.corner(corner.square, work).sample
                    }
                })
        })
    }

    /// Cuts the cell as one wavelength sees it, but for the light that all wavelengths share.
    #[allow(
        clippy::too_many_arguments,
        reason = "one call site; a cell's state travels through it"
    )]
    fn cut_node(
        &self,
        spectrum: &LightSpectrum,
        node: usize,
        cell: &Cell,
        (corners, alike): ([SampleId; 4], &[PathSignature]),
        depth: Depth,
        work: &mut Workspace,
        out: &mut CellOutput,
    ) {
        let tracer = self.edges.tracer.at_node(self.light, node);
        let edges = EdgeCutter {
            tracer: &tracer,
            face: self.edges.face,
        };
        let none = SmallBodies::default();
        let cutter = CellCutter {
            edges,
            unit: self.unit,
            refinement: None,
            bodies: &none,
            light: LightPart::White,
            tone: Tone::Node(node as u8),
            channels: spectrum.nodes[node].channels,
            done: alike,
        };
        let corners: [Corner; 4] = std::array::from_fn(|corner| Corner {
            square: cell.corners[corner].square,
            sample: corners[corner],
        });
        let is_dim = is_dim_but_for(alike, &corners, work);
        let edges = if node == 0 {
            cell.edges.clone()
        } else if is_dim {
            Default::default()
        } else {
            EDGE_ENDS.map(|(from, to)| edges.edge([corners[from], corners[to]], false, work))
        };
        let seen = Cell {
            corners,
            edges,
            beside: [0; 4],
        };
        if is_dim {
            cutter.scatter(&seen, work, out);
        } else {
            cutter.cut_at(&seen, depth, work, out);
        }
    }
}

/// Light below this share of the brightest is not cut wavelength by wavelength.
const DIM_SHARE: f64 = 0.01;

/// Whether what corners have beside some light is dim.
fn is_dim_but_for(alike: &[PathSignature], corners: &[Corner; 4], work: &Workspace) -> bool {
    let samples = corners.map(|corner| work.get(corner.sample));
    let brightest_w = samples
        .iter()
        .map(|sample| sample.brightest_w)
        .fold(0.0, f64::max);
    let strands = samples.iter().flat_map(|sample| &sample.strands);
    strands
        .filter(|strand| alike.binary_search(&strand.signature).is_err())
        .all(|strand| strand.flux_w.luminance() <= DIM_SHARE * brightest_w)
}

/// Whether light of all wavelengths goes the same ways at all corners, on one sheet.
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

/// Light that goes the same way at all corners at all wavelengths, on one sheet; ascending.
fn alike(cell: &Cell, nodes: &NodeCorners, work: &Workspace) -> Vec<PathSignature> {
    let is_alike = |signature: &PathSignature| {
        let is_everywhere = nodes
            .iter()
            .flatten()
            .all(|sample| work.get(*sample).find(*signature).is_some());
        let is_whole = || (0..4).all(|edge| reach_of(cell, edge, work, *signature, false) == Reach::Whole);
        let is_smooth = |corners: &[SampleId; 4]| {
            EDGE_ENDS.iter().enumerate().all(|(edge, &(from, to))| {
                let ends = [from, to].map(|end| work.get(corners[end]));
                !is_suspicious(ends[0], ends[1], *signature, cell.edge_step(edge))
            })
        };
        is_everywhere && is_whole() && nodes[1..].iter().all(is_smooth)
    };
    let first = work.get(nodes[0][0]);
    let signatures = first.strands.iter().map(|strand| strand.signature);
    signatures.filter(is_alike).collect()
}
