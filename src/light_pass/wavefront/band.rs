//! The traced samples of some rows of cells, in chunks that parallel tasks fill on their own.

use std::collections::HashMap;

use glam::DVec2;

use super::strand::{LatticeRay, PathSegment};

/// Where a sample is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleId {
    /// Chunk of the band.
    pub chunk: u32,
    /// Place in the chunk.
    pub index: u32,
}

/// A sample with its place in the unit square of its face.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// In the unit square.
    pub square: DVec2,
    /// The sample there.
    pub sample: SampleId,
}

/// Samples by chunk.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// Filled in the order of the chunks.
    pub chunks: Vec<Vec<LatticeRay>>,
}

impl Samples {
    /// A sample.
    pub fn get(&self, id: SampleId) -> &LatticeRay {
        &self.chunks[id.chunk as usize][id.index as usize]
    }

    /// A strand of a sample.
    pub fn strand(&self, id: SampleId, strand: u16) -> &PathSegment {
        &self.get(id).strands[usize::from(strand)]
    }
}

/// Samples that tasks may read, and the one chunk that this task adds to.
#[derive(Debug)]
pub struct Workspace<'a> {
    /// What was traced before.
    pub shared: &'a Samples,
    /// Number of the own chunk.
    pub chunk: u32,
    /// Traced by this task.
    pub own: Vec<LatticeRay>,
    /// Rows of the lattice's own corners, which come first, once for each wavelength.
    corner_rows: u32,
    /// Where this task traced already, by wavelength: cells share corners and edges.
    known: HashMap<(u32, [u64; 2]), SampleId>,
}

impl<'a> Workspace<'a> {
    /// An empty own chunk.
    pub fn new(shared: &'a Samples, chunk: usize, corner_rows: usize) -> Self {
        Self {
            shared,
            chunk: chunk as u32,
            own: Vec::new(),
            corner_rows: corner_rows as u32,
            known: HashMap::new(),
        }
    }

    /// The sample at a place of the unit square, of one of the wavelengths; traced unless this task did so before.
    pub fn sample_at(&mut self, node: u32, square: DVec2, trace: impl FnOnce() -> LatticeRay) -> SampleId {
        let key = (node, square.to_array().map(f64::to_bits));
        if let Some(id) = self.known.get(&key) {
            return *id;
        }
        let id = self.add(trace());
        self.known.insert(key, id);
        id
    }

    /// The sample at a place of the unit square, where this task traced one of that wavelength.
    pub fn known(&self, node: u32, square: DVec2) -> Option<SampleId> {
        let key = (node, square.to_array().map(f64::to_bits));
        self.known.get(&key).copied()
    }

    /// The sample at another wavelength of a corner of the lattice itself; `None` where it is none.
    pub fn at_node(&self, id: SampleId, node: usize) -> Option<SampleId> {
        (id.chunk < self.corner_rows).then(|| SampleId {
            chunk: id.chunk + node as u32 * self.corner_rows,
            index: id.index,
        })
    }

    /// A sample, shared or own.
    pub fn get(&self, id: SampleId) -> &LatticeRay {
        if id.chunk == self.chunk {
            &self.own[id.index as usize]
        } else {
            self.shared.get(id)
        }
    }

    fn add(&mut self, sample: LatticeRay) -> SampleId {
        self.own.push(sample);
        SampleId {
            chunk: self.chunk,
            index: (self.own.len() - 1) as u32,
        }
    }
}
