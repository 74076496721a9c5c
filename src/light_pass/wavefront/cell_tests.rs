//! Tests for cells whose interior differs from what their corners and edges show.

use glam::DVec2;

use super::band::{SampleId, Workspace};
use super::cell::{CHECK_MISMATCH, Cell, CellCutter, EDGE_ENDS, reach_of};
use super::edge::{EdgeReach, mismatch};
use super::lattice_ray::LatticeRay;
use super::patch::PatchShape;
use crate::geometry::Ray;
use crate::light_pass::path::PathSignature;

/// Light below this share of the brightest does not make a cell ambiguous: it is cut as is, and what the cuts leave
/// open is booked.
const BRIGHT_SHARE: f64 = 0.1;

/// A patch with a larger error in its middle, relative to the cell's width, is useless.
const DOUBTFUL_SHARE: f64 = 0.1;

/// Bright light that leaves a cell along more paths than this is shattered, and so would be the pieces of the cell.
const MANY_WAYS: usize = 8;

/// Error of both patches in the middle of a cell, and the cell's width there: distances between origins plus those
/// between directions times the distance to the landing point [m].
#[derive(Clone, Copy, Debug)]
struct Check {
    cubic: f64,
    bilinear: f64,
    width: f64,
}

impl CellCutter<'_> {
    /// Decided by a check ray through the middle of the cell.
    pub(super) fn is_bilinear_better(
        &self,
        cell: &Cell,
        corners: [(SampleId, u16); 4],
        step: DVec2,
        work: &mut Workspace,
    ) -> bool {
        self.check(cell, corners, step, work)
            .is_none_or(|Check { cubic, bilinear, .. }| cubic > bilinear || cubic.is_nan())
    }

    /// Whether no patch over a cell predicts where the bright light in its middle goes.
    pub(super) fn needs_check_ray(&self, cell: &Cell, work: &mut Workspace) -> bool {
        let ids = cell.corners.map(|corner| corner.sample);
        let brightest_w = ids.iter().map(|id| work.get(*id).brightest_w).fold(0.0, f64::max);
        (0..work.get(ids[0]).segments.len()).any(|segment| {
            let corners = ids.map(|id| (id, segment as u16));
            let flux_w = work.get(ids[0]).segments[segment].flux_w.luminance();
            flux_w > BRIGHT_SHARE * brightest_w
                && worst_mismatch(cell, corners, work) > CHECK_MISMATCH
                && self.check(cell, corners, cell.step(), work).is_none_or(
                    |Check {
                         cubic,
                         bilinear,
                         width,
                     }| {
                        let best = if cubic < bilinear { cubic } else { bilinear };
                        best.is_nan() || best > DOUBTFUL_SHARE * width
                    },
                )
        })
    }

    /// Compares both patch shapes with a ray traced through the middle; `None` if that ray does not take the same path.
    fn check(
        &self,
        cell: &Cell,
        corners: [(SampleId, u16); 4],
        step: DVec2,
        work: &mut Workspace,
    ) -> Option<Check> {
        let middle = cell.corners[0].square + step * 0.5;
        let middle = self.edges.corner(middle, work);
        let segments = corners.map(|(id, segment)| &work.get(id).segments[usize::from(segment)]);
        let check = work.get(middle.sample);
        let found = &check.segments[check.find(segments[0].signature)?];
        let reach_m = found.landing.distance_m();
        let reach_m = if reach_m.is_finite() { reach_m } else { 1.0 };
        let apart = |a: &Ray, b: &Ray| {
            let direction = a.direction.normalize_or_zero();
            a.origin.distance(b.origin) + reach_m * direction.distance(b.direction)
        };
        let error = |shape: &PatchShape| apart(&shape.ray(DVec2::splat(0.5)), &found.ray);
        Some(Check {
            cubic: error(&PatchShape::coons(segments, step)),
            bilinear: error(&PatchShape::bilinear(segments)),
            width: apart(&segments[0].ray, &segments[2].ray).max(apart(&segments[1].ray, &segments[3].ray)),
        })
    }

    /// How often an ambiguous cell is split.
    pub(super) fn most_splits(&self, cell: &Cell, work: &Workspace) -> u32 {
        let samples = cell.corners.map(|corner| work.get(corner.sample));
        let least_w = least_bright_w(samples);
        let ways = all_bright(samples.iter().map(|sample| bright(sample, least_w)));
        if ways.len() > MANY_WAYS {
            self.splits.shattered
        } else {
            self.splits.ambiguous
        }
    }

    /// Whether cuts along the edges leave open what lies between them.
    pub(super) fn is_ambiguous(&self, cell: &Cell, work: &Workspace) -> bool {
        let samples = cell.corners.map(|corner| work.get(corner.sample));
        let least_w = least_bright_w(samples);
        let mut kinds: Vec<Vec<PathSignature>> =
            samples.iter().map(|sample| bright(sample, least_w)).collect();
        let all = all_bright(kinds.iter().cloned());
        // A path that is bright at one corner counts at every corner that has it.
        for (kind, sample) in kinds.iter_mut().zip(samples) {
            *kind = all
                .iter()
                .copied()
                .filter(|s| sample.find(*s).is_some())
                .collect();
        }
        kinds.sort_unstable();
        kinds.dedup();
        // Light that only samples along the edges found lies between the corners.
        let is_between = |sample: SampleId| {
            let inner = bright(work.get(sample), least_w);
            inner
                .iter()
                .any(|signature| all.binary_search(signature).is_err())
        };
        let mut inner = cell.edges.iter().flatten().flat_map(|edge| &edge.samples);
        if kinds.len() > 2 || inner.any(|(_, sample)| is_between(*sample)) {
            return true;
        }
        all.iter().any(|&signature| {
            let there = samples.map(|sample| sample.find(signature).is_some());
            let diagonal = there == [true, false, true, false] || there == [false, true, false, true];
            let crossed_twice = cell
                .edges
                .iter()
                .flatten()
                .any(|edge| edge.changes(work, signature) > 1);
            let torn = there == [true; 4]
                && (0..4).any(|edge| reach_of(cell, edge, work, signature, false) != EdgeReach::Whole);
            diagonal || crossed_twice || torn
        })
    }
}

/// Threshold of bright light at the corners of a cell [W].
fn least_bright_w(samples: [&LatticeRay; 4]) -> f64 {
    let brightest_w = samples.iter().map(|sample| sample.brightest_w);
    brightest_w.fold(0.0, f64::max) * BRIGHT_SHARE
}

/// Signatures of a sample's bright light.
fn bright(sample: &LatticeRay, least_w: f64) -> Vec<PathSignature> {
    let segments = sample.segments.iter();
    let bright = segments.filter(|segment| segment.flux_w.luminance() > least_w);
    bright.map(|segment| segment.signature).collect()
}

/// All signatures, ascending and without duplicates.
fn all_bright(ways: impl Iterator<Item = Vec<PathSignature>>) -> Vec<PathSignature> {
    let mut all: Vec<PathSignature> = ways.flatten().collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Largest mismatch along a cell's edges.
pub(super) fn worst_mismatch(cell: &Cell, corners: [(SampleId, u16); 4], work: &Workspace) -> f64 {
    let segment = |corner: usize| {
        let (id, segment) = corners[corner];
        &work.get(id).segments[usize::from(segment)]
    };
    EDGE_ENDS
        .into_iter()
        .enumerate()
        .map(|(edge, (from, to))| mismatch(segment(from), segment(to), cell.edge_step(edge)))
        .fold(0.0, f64::max)
}
