//! Cell sizes for waves and other normals that are finer than the mesh. The corners of a cell longer than that detail
//! agree or disagree by chance, and its patch is meaningless.

use glam::DVec2;

use super::lattice_ray::LatticeRay;
use crate::transport::RayDifferential;

/// Cells per period of the bumps in the finest lattice: a cubic patch then follows a sine to about 2 %.
const CELLS_PER_WAVE: f64 = 4.0;

/// Most cells of a whole lattice after division for bumps.
const MAX_CELLS: f64 = 2_097_152.0;

const DEEPEST_LEVEL: u32 = 12;

/// How a lattice resolves bumps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BumpCells {
    /// Fewest cells per period of the bumps.
    per_wave: f64,
    /// Most divisions of a cell for bumps. Where more would be needed, cells are not divided at all: each ray becomes
    /// one small patch, as wide as if the surface had no bumps.
    deepest: u32,
}

impl BumpCells {
    /// For a lattice of `cells` cells with steps `2^coarser` times those of the usual finest one: its cells may be
    /// longer by the same factor, so that the difference between lattices shows what they miss.
    pub fn for_lattice(cells: u64, coarser: i32) -> Self {
        let longer = f64::from(coarser).exp2();
        let finest = (cells as f64 * longer * longer).max(1.0);
        let divisions = 0.5 * (MAX_CELLS / finest).log2();
        Self {
            per_wave: CELLS_PER_WAVE / longer,
            deepest: (divisions.max(0.0) as u32).min(DEEPEST_LEVEL),
        }
    }

    /// For rays of which only derivatives are wanted: no bump is too fine.
    pub const EXACT: Self = Self {
        per_wave: CELLS_PER_WAVE,
        deepest: DEEPEST_LEVEL,
    };

    /// Never divides cells: for a first estimate of how wide the lit areas are.
    pub const UNDIVIDED: Self = Self {
        per_wave: CELLS_PER_WAVE,
        deepest: 0,
    };

    /// Cells across and down the unit square that bumps of a length [m] require, where a light ray hits them with the
    /// given derivatives.
    pub fn wanted(&self, at_hit: &RayDifferential, detail_m: f64) -> DVec2 {
        let derivatives = DVec2::new(at_hit.across.origin.length(), at_hit.down.origin.length());
        derivatives * (self.per_wave / detail_m)
    }

    /// Whether this many cells exceed what divisions of cells with these steps can give.
    pub fn is_too_fine(&self, wanted: DVec2, steps: [f64; 2]) -> bool {
        let finest = DVec2::from(steps) * (-f64::from(self.deepest)).exp2();
        (wanted * finest).max_element() > 1.0
    }

    /// Whether a cell or an edge with the given step in the unit square, divided `level` times for bumps, has to be
    /// divided again.
    pub fn ask_for_finer(&self, samples: &[&LatticeRay], step: DVec2, level: u32) -> bool {
        let is_coarse = |sample: &&LatticeRay| (sample.bump_cells * step.abs()).max_element() > 1.0;
        let is_rough = samples.iter().any(|sample| sample.is_rough);
        !is_rough && level < self.deepest && samples.iter().any(is_coarse)
    }
}
