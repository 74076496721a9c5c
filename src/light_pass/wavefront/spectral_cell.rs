//! Cells of a spectral light: one patch for all wavelengths where they go the same ways, one for each traced wavelength
//! where they do not.

use super::band::{Corner, SampleId, Workspace};
use super::bodies::SmallBodies;
use super::cell::{Cell, CellCutter, CellOutput, DEEPEST_SPLIT, Depth, EDGE_ENDS, Tone};
use super::edge::{Edge, EdgeCutter, same_ways};
use super::spectrum::{LightSpectrum, NODES};

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
        let nodes = self.node_corners(spectrum, cell, work);
        if !self.goes_alike(cell, &nodes, work) {
            for (node, corners) in nodes.iter().enumerate() {
                self.cut_node(spectrum, node, cell, *corners, depth, work, out);
            }
            return;
        }
        if depth.ambiguous < DEEPEST_SPLIT && self.is_doubtful(cell, work) {
            let ambiguous = depth.ambiguous + 1;
            return self.split(cell, Depth { ambiguous, ..depth }, work, out);
        }
        let all = CellCutter {
            tone: Tone::Spectrum(std::array::from_fn(|other| nodes[other + 1])),
            ..*self
        };
        all.patches(cell, work, out);
        for (node, corners) in nodes.iter().enumerate() {
            let of_node = CellCutter {
                colour: spectrum.nodes[node].xyz,
                ..*self
            };
            of_node.book_whole(cell, *corners, work, out);
        }
    }

    fn node_corners(&self, spectrum: &LightSpectrum, cell: &Cell, work: &mut Workspace) -> NodeCorners {
        std::array::from_fn(|node| {
            cell.corners.map(|corner| match (node, work.at_node(corner.sample, node)) {
                (0, _) => corner.sample,
                (_, Some(sample)) => sample,
                (_, None) => {
                    let tracer = self.edges.tracer.at_node(spectrum, node);
                    let edges = EdgeCutter {
                        tracer: &tracer,
                        face: self.edges.face,
                    };
                    edges.corner(corner.square, work).sample
                }
            })
        })
    }

    /// Whether light of all wavelengths goes the same ways at all corners, on one sheet.
    fn goes_alike(&self, cell: &Cell, nodes: &NodeCorners, work: &Workspace) -> bool {
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

    /// Cuts the cell as one wavelength sees it.
    #[allow(clippy::too_many_arguments, reason = "one call site; a cell's state travels through it")]
    fn cut_node(
        &self,
        spectrum: &LightSpectrum,
        node: usize,
        cell: &Cell,
        corners: [SampleId; 4],
        depth: Depth,
        work: &mut Workspace,
        out: &mut CellOutput,
    ) {
        let tracer = self.edges.tracer.at_node(spectrum, node);
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
            spectrum: None,
            tone: Tone::Node(node as u8),
            colour: spectrum.nodes[node].xyz,
        };
        let corners: [Corner; 4] = std::array::from_fn(|corner| Corner {
            square: cell.corners[corner].square,
            sample: corners[corner],
        });
        let edges = if node == 0 {
            cell.edges.clone()
        } else {
            EDGE_ENDS.map(|(from, to)| edges.edge([corners[from], corners[to]], false, work))
        };
        let seen = Cell {
            corners,
            edges,
            beside: [0; 4],
        };
        cutter.cut_at(&seen, depth, work, out);
    }
}
