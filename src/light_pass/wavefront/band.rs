//! The traced samples of some rows of cells, in chunks that parallel tasks fill on their own.

use std::collections::HashMap;

use glam::DVec2;

use super::lattice_ray::{LatticeRay, PathSegment};

/// Address of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleId {
    /// Chunk of the band.
    pub chunk: u32,
    /// Index in the chunk.
    pub index: u32,
}

/// A sample with its position.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// In the unit square of its face.
    pub square: DVec2,
    pub sample: SampleId,
}

/// Samples by chunk.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// In the order of the chunks.
    pub chunks: Vec<Vec<LatticeRay>>,
}

impl Samples {
    pub fn get(&self, id: SampleId) -> &LatticeRay {
        &self.chunks[id.chunk as usize][id.index as usize]
    }

    pub fn segment(&self, id: SampleId, segment: u16) -> &PathSegment {
        &self.get(id).segments[usize::from(segment)]
    }
}

/// Samples that tasks may read, and the one chunk that this task adds to.
#[derive(Debug)]
pub struct Workspace<'a> {
    /// Samples traced before.
    pub shared: &'a Samples,
    /// Number of the own chunk.
    pub chunk: u32,
    /// Samples traced by this task.
    pub own: Vec<LatticeRay>,
    /// Rows of the lattice's own corners, which are the first chunks, once per wavelength.
    corner_rows: u32,
    /// Samples traced by this task, by wavelength and position: cells share corners and edges.
    known: HashMap<(u32, [u64; 2]), SampleId>,
}

impl<'a> Workspace<'a> {
    /// With an empty chunk of its own.
    pub fn new(shared: &'a Samples, chunk: usize, corner_rows: usize) -> Self {
        Self {
            shared,
            chunk: chunk as u32,
            own: Vec::new(),
            corner_rows: corner_rows as u32,
            known: HashMap::new(),
        }
    }

    /// The sample of a wavelength at a point of the unit square; traced unless this task did so before.
    pub fn sample_at(&mut self, node: u32, square: DVec2, trace: impl FnOnce() -> LatticeRay) -> SampleId {
        let key = (node, square.to_array().map(f64::to_bits));
        if let Some(id) = self.known.get(&key) {
            return *id;
        }
        let id = self.add(trace());
        self.known.insert(key, id);
        id
    }

    /// The sample of a wavelength at a point of the unit square, if this task traced one.
    pub fn known(&self, node: u32, square: DVec2) -> Option<SampleId> {
        let key = (node, square.to_array().map(f64::to_bits));
        self.known.get(&key).copied()
    }

    /// The sample at another wavelength of a corner of the lattice; `None` for other samples.
    pub fn at_node(&self, id: SampleId, node: usize) -> Option<SampleId> {
        (id.chunk < self.corner_rows).then(|| SampleId {
            chunk: id.chunk + node as u32 * self.corner_rows,
            index: id.index,
        })
    }

    /// A shared sample or an own one.
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
