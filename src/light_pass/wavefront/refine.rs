//! Which cells are divided for a target error: an indicator that sees position, throughput and local irradiance.
//!
//! The error of a map is the root of the sum of its cells' squared errors. A cell that lights A texels with flux Φ and
//! places it wrongly by δ texels errs by about (Φ/A)·δ over the map; one whose flux is wrong by the share τ errs by
//! (Φ/A)·√A·τ. Each cell may have an equal part of the whole.

use super::edge::mismatch;
use super::receivers::Receivers;
use super::strand::{Landing, Strand};
use glam::DVec2;

/// Cells that refinement is expected to make of one, on average: each gets that part of the error.
const EXPECTED_GROWTH: f64 = 3.0;

/// Misplacement of a cubic patch's light, as a share of its width, over mismatch^(4/3): third differences say how
/// large fourth ones are. Measured on scenes with known solutions.
const PLACE_FACTOR: f64 = 0.12;

/// Error of flux that is linear between corners, over the squared relative change between them.
const FLUX_FACTOR: f64 = 0.06;

/// Share of a cut cell's light that a straight cut gives to the wrong side, at the starting lattice.
const CUT_FACTOR: f64 = 0.02;

/// How often a cell of the starting lattice is divided at most.
pub const DEEPEST_LEVEL: u32 = 7;

/// A target for the relative RMSE of maps.
#[derive(Clone, Copy, Debug)]
pub struct Refinement<'a> {
    /// Who is lit.
    pub receivers: &'a Receivers<'a>,
    /// Flux that all lights send to specular surfaces [W, luminance].
    pub reference_w: f64,
    /// Squared relative error that a cell may have.
    cell_limit: f64,
}

impl<'a> Refinement<'a> {
    /// For a target relative RMSE from a lattice of so many cells.
    pub fn new(receivers: &'a Receivers<'a>, reference_w: f64, target: f64, cells: u64) -> Self {
        Self {
            receivers,
            reference_w,
            cell_limit: target * target / (EXPECTED_GROWTH * cells.max(1) as f64),
        }
    }

    /// Starting density [1/sr] for a target: coarse enough that refinement decides, fine enough that no caster falls
    /// through.
    pub fn starting_density_per_sr(target: f64) -> f64 {
        (40.0 / target).clamp(400.0, 40_000.0)
    }

    /// How coarse triangles may be for a target, relative to those of a bake without one.
    pub fn coarseness(target: f64) -> f64 {
        (target / 0.04).clamp(0.1, 2.0)
    }

    /// Whether a cell has to be divided. Per strand: those of its corners that have it, in the cell's order around,
    /// and their places in the unit square; `area` of the cell in the unit square; `level` how often it was divided.
    pub fn is_too_coarse<'s>(
        &self,
        strands: impl Iterator<Item = Vec<(DVec2, &'s Strand)>>,
        area: f64,
        level: u32,
    ) -> bool {
        level < DEEPEST_LEVEL
            && strands
                .map(|corners| self.squared_error(&corners, area, level))
                .sum::<f64>()
                > self.cell_limit
    }

    /// Estimated squared error of a strand's light from one cell, relative to its map.
    fn squared_error(&self, corners: &[(DVec2, &Strand)], area: f64, level: u32) -> f64 {
        let Some(object) = corners.iter().find_map(|(_, strand)| match strand.landing {
            Landing::Receiver { object, .. } => Some(object),
            Landing::Escaped | Landing::Specular { .. } => None,
        }) else {
            return 0.0;
        };
        let Some(surface) = self.receivers.get(object) else {
            return 0.0;
        };
        let map_texels = (surface.chart.width * surface.chart.height) as f64;
        let texels_per_m = (map_texels / surface.area_m2).sqrt();
        let flux_w = corners
            .iter()
            .map(|(_, strand)| strand.flux_w.luminance())
            .sum::<f64>()
            / corners.len() as f64
            * area;
        let lit = lit_area_m2(corners) * texels_per_m * texels_per_m;
        let moved = misplacement_m(corners) * PLACE_FACTOR * texels_per_m;
        let lit = lit.max(moved * moved).max(1.0);
        let least = corners
            .iter()
            .map(|(_, s)| s.flux_w.luminance())
            .fold(f64::INFINITY, f64::min);
        let most = corners
            .iter()
            .map(|(_, s)| s.flux_w.luminance())
            .fold(0.0, f64::max);
        let change = (most - least) / most.max(f64::MIN_POSITIVE);
        let mut share = FLUX_FACTOR * change * change;
        if corners.len() < 4 {
            share += CUT_FACTOR * (-f64::from(level)).exp2();
        }
        let relative_w = flux_w / lit * map_texels / self.reference_w;
        relative_w * relative_w * (moved * moved + lit * share * share) / map_texels
    }
}

/// Area between the points that a strand's corners light [m²]; 0 for fewer than three of them.
fn lit_area_m2(corners: &[(DVec2, &Strand)]) -> f64 {
    let points: Vec<_> = corners
        .iter()
        .filter_map(|(_, strand)| strand.landing_point())
        .collect();
    (1..points.len().saturating_sub(1))
        .map(|i| 0.5 * (points[i] - points[0]).cross(points[i + 1] - points[0]).length())
        .sum()
}

/// How far light may fall from where a patch says, up to a factor [m].
fn misplacement_m(corners: &[(DVec2, &Strand)]) -> f64 {
    (0..corners.len())
        .map(|i| {
            let ((from, a), (to, b)) = (corners[i], corners[(i + 1) % corners.len()]);
            let off = mismatch(a, b, to - from).min(1.0);
            match (a.landing_point(), b.landing_point()) {
                (Some(p), Some(q)) => p.distance(q) * off.powf(4.0 / 3.0),
                _ => 0.0,
            }
        })
        .fold(0.0, f64::max)
}
