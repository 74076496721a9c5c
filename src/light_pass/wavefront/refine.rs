//! Which cells are divided: those whose light falls on tiles of maps that were found to be too rough.
//!
//! Each round divides cells once more. A round's tiles come from the difference between the maps of two rounds before
//! it, so that refinement goes where the error was measured, not where it was foreseen.

use std::collections::BTreeMap;

use glam::DVec2;

use super::receivers::Receivers;
use super::strand::{Landing, Strand};

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

impl Refinement<'_> {
    /// Whether a cell has to be divided that was divided in so many rounds before. Per strand: those of the cell's
    /// corners that have it.
    pub fn is_too_coarse<'s>(
        &self,
        strands: impl Iterator<Item = Vec<&'s Strand>>,
        brightest_w: f64,
        rounds_before: usize,
    ) -> bool {
        let Some(tiles) = self.rounds.get(rounds_before) else {
            return false;
        };
        strands
            .filter(|corners| {
                let most_w = corners.iter().map(|strand| strand.flux_w.luminance());
                most_w.fold(0.0, f64::max) >= LEAST_SHARE * brightest_w
            })
            .any(|corners| self.falls_on(&corners, tiles))
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
