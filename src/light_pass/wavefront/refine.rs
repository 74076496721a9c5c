//! Which cells are divided: those whose light falls on tiles of maps that were found to be too rough.
//!
//! Each round divides cells once more. A round's tiles come from the difference between the maps of two rounds before
//! it, so that refinement goes where the error was measured, not where it was foreseen.

use std::collections::BTreeMap;

use glam::DVec2;

use super::receivers::Receivers;
use super::strand::{Landing, LightSample, Strand};
use crate::light_pass::caustic::path::PathSignature;

/// Side of a tile [texels].
pub const TILE_SIDE: usize = 16;

/// Light below this share of a cell's brightest does not divide it.
const LEAST_SHARE: f64 = 0.02;

/// Tiles of one map.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TileSet {
    columns: usize,
    chosen: Vec<bool>,
}

/// Tiles of all maps, by object.
pub type RoughTiles = BTreeMap<usize, TileSet>;

impl TileSet {
    /// No tile of a map of the given size [texels].
    pub fn none(width: usize, height: usize) -> Self {
        let (columns, rows) = tile_counts(width, height);
        Self {
            columns,
            chosen: vec![false; columns * rows],
        }
    }

    /// Chooses a tile, counted row by row.
    pub fn choose(&mut self, tile: usize) {
        self.chosen[tile] = true;
    }

    /// Whether a tile, counted row by row, is chosen.
    pub fn is_chosen(&self, tile: usize) -> bool {
        self.chosen[tile]
    }

    /// Whether any tile is chosen between two points of the map [texels].
    fn meets(&self, low: DVec2, high: DVec2) -> bool {
        let side = TILE_SIDE as f64;
        let rows = self.chosen.len() / self.columns;
        let clamped = |texels: f64, count: usize| ((texels / side) as usize).min(count - 1);
        let (left, right) = (clamped(low.x, self.columns), clamped(high.x, self.columns));
        let (top, bottom) = (clamped(low.y, rows), clamped(high.y, rows));
        (top..=bottom).any(|row| {
            let begin = row * self.columns;
            self.chosen[begin + left..=begin + right].contains(&true)
        })
    }
}

/// Tiles across and down a map of the given size [texels].
pub fn tile_counts(width: usize, height: usize) -> (usize, usize) {
    (
        width.div_ceil(TILE_SIDE).max(1),
        height.div_ceil(TILE_SIDE).max(1),
    )
}

/// Rounds of refinement so far.
#[derive(Clone, Copy, Debug)]
pub struct Refinement<'a> {
    /// Who is lit.
    pub receivers: &'a Receivers<'a>,
    /// Where each round refines.
    pub rounds: &'a [RoughTiles],
}

/// Rounds as a set: bit r stands for round r.
pub type RoundSet = u32;

impl Refinement<'_> {
    /// Whether a cell has to be divided that was divided in so many rounds before, by the samples at its corners.
    pub fn is_too_coarse(&self, corners: [&LightSample; 4], rounds_before: usize) -> bool {
        let Some(tiles) = self.rounds.get(rounds_before) else {
            return false;
        };
        bright_signatures(&corners).into_iter().any(|signature| {
            let strands = strands_of(&corners, signature);
            self.falls_on(&strands, tiles)
        })
    }

    /// Rounds that divide light beside a cell which not all of its corners have: the border of that light may reach into
    /// the cell, between its corners.
    pub fn rounds_beside(&self, own: [&LightSample; 4], beside: &[&LightSample]) -> RoundSet {
        if self.rounds.is_empty() {
            return 0;
        }
        let mut rounds = 0;
        for signature in bright_signatures(beside) {
            if own.iter().all(|sample| sample.find(signature).is_some()) {
                continue;
            }
            let strands = strands_of(beside, signature);
            for (round, tiles) in self.rounds.iter().enumerate() {
                if self.falls_on(&strands, tiles) {
                    rounds |= 1 << round;
                }
            }
        }
        rounds
    }

    /// Whether a strand's light may fall on chosen tiles: they meet the box around the places that its corners light.
    fn falls_on(&self, corners: &[&Strand], tiles: &RoughTiles) -> bool {
        let mut lit: Vec<(u32, DVec2, DVec2)> = Vec::new();
        for strand in corners {
            let Landing::Receiver {
                object,
                triangle,
                barycentric,
                ..
            } = strand.landing
            else {
                continue;
            };
            let Some(surface) = self.receivers.get(object) else {
                continue;
            };
            let texel = surface.texel(triangle, barycentric);
            match lit.iter_mut().find(|(lit, ..)| *lit == object) {
                Some((_, low, high)) => (*low, *high) = (low.min(texel), high.max(texel)),
                None => lit.push((object, texel, texel)),
            }
        }
        lit.into_iter().any(|(object, low, high)| {
            tiles
                .get(&(object as usize))
                .is_some_and(|tiles| tiles.meets(low, high))
        })
    }
}

/// Signatures of all strands that are not dim beside the brightest.
fn bright_signatures(samples: &[&LightSample]) -> Vec<PathSignature> {
    let brightest_w = samples
        .iter()
        .map(|sample| sample.brightest_w)
        .fold(0.0, f64::max);
    let is_bright = |strand: &&Strand| strand.flux_w.luminance() >= LEAST_SHARE * brightest_w;
    let strands = samples
        .iter()
        .flat_map(|sample| &sample.strands)
        .filter(is_bright);
    let mut signatures: Vec<PathSignature> = strands.map(|strand| strand.signature).collect();
    signatures.sort_unstable();
    signatures.dedup();
    signatures
}

fn strands_of<'s>(samples: &[&'s LightSample], signature: PathSignature) -> Vec<&'s Strand> {
    samples
        .iter()
        .filter_map(|sample| Some(&sample.strands[sample.find(signature)?]))
        .collect()
}
