//! Cell sizes for waves and other normals that are finer than the mesh. The corners of a cell longer than that detail
//! agree or disagree by chance, and its patch is meaningless.

use glam::DVec2;

use super::strand::LatticeRay;
use crate::transport::RayDifferential;

/// Cells for each wave in the finest lattice: a cubic patch then follows a sine to about 2 %.
const CELLS_PER_WAVE: f64 = 4.0;

/// Cells of a whole lattice at most, once they are divided for detail.
const MAX_CELLS: f64 = 2_097_152.0;

/// Divisions at most.
const DEEPEST_LEVEL: u32 = 12;

/// What a lattice makes of detail of normals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BumpCells {
    /// Cells for each wave, at least.
    per_wave: f64,
    /// How often cells are divided for it at most. Where that is not enough, they are not divided at all: light goes on
    /// as one small patch per ray, as wide as if the surface had no bumps.
    deepest: u32,
}

impl BumpCells {
    /// For a lattice of so many cells whose steps are `2^coarser` times longer than those of the usual finest one: its
    /// cells may be as much longer, so that the difference between lattices shows what they miss.
    pub fn for_lattice(cells: u64, coarser: i32) -> Self {
        let longer = f64::from(coarser).exp2();
        let finest = (cells as f64 * longer * longer).max(1.0);
        let divisions = 0.5 * (MAX_CELLS / finest).log2();
        Self {
            per_wave: CELLS_PER_WAVE / longer,
            deepest: (divisions.max(0.0) as u32).min(DEEPEST_LEVEL),
        }
    }

    /// For rays whose derivatives alone are wanted: no detail is too fine.
    pub const EXACT: Self = Self {
        per_wave: CELLS_PER_WAVE,
        deepest: DEEPEST_LEVEL,
    };

    /// Cells are not divided: for a look at how wide lit areas are as a whole.
    pub const UNDIVIDED: Self = Self {
        per_wave: CELLS_PER_WAVE,
        deepest: 0,
    };

    /// Cells across and down the unit square that detail of a length [m] asks for, where a light ray falls on it with
    /// these derivatives.
    pub fn wanted(&self, at_hit: &RayDifferential, detail_m: f64) -> DVec2 {
        let derivatives = DVec2::new(at_hit.across.origin.length(), at_hit.down.origin.length());
        derivatives * (self.per_wave / detail_m)
    }

    /// Whether so many cells are more than any division gives, from cells with these steps on.
    pub fn is_too_fine(&self, wanted: DVec2, steps: [f64; 2]) -> bool {
        let finest = DVec2::from(steps) * (-f64::from(self.deepest)).exp2();
        (wanted * finest).max_element() > 1.0
    }

    /// Whether a cell or an edge with the given step in the unit square, divided `level` times for detail, has to be
    /// divided again.
    pub fn ask_for_finer(&self, samples: &[&LatticeRay], step: DVec2, level: u32) -> bool {
        let is_coarse = |sample: &&LatticeRay| (sample.bump_cells * step.abs()).max_element() > 1.0;
        let is_rough = samples.iter().any(|sample| sample.is_rough);
        !is_rough && level < self.deepest && samples.iter().any(is_coarse)
    }
}
