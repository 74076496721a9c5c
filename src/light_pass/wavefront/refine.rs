//! Selects the cells to divide: those whose light falls on map tiles with too large an error.
//!
//! Each round divides cells once more. A round's tiles come from the difference between the maps of two rounds before
//! it, so that refinement goes where the error was measured, not where it was foreseen.

use std::collections::BTreeMap;

use glam::DVec2;

use super::lattice_ray::{LatticeRay, PathSegment, SegmentEnd};
use super::overshoot::PatchOvershoot;
use super::receivers::Receivers;
use crate::illumination::Receiver;
use crate::light_pass::path::PathSignature;

/// Side of a tile [texels].
pub const TILE_SIDE: usize = 16;

/// Light below this share of a cell's brightest does not divide it.
const MIN_SHARE: f64 = 0.02;

/// Selected tiles of one map.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TileSet {
    columns: usize,
    chosen: Vec<bool>,
}

/// Selected tiles of all maps.
pub type RoughTiles = BTreeMap<Receiver, TileSet>;

impl TileSet {
    /// With no tile selected, for a map of the given size [texels].
    pub fn none(width: usize, height: usize) -> Self {
        let (columns, rows) = tile_counts(width, height);
        Self {
            columns,
            chosen: vec![false; columns * rows],
        }
    }

    /// Selects a tile by its row-major index.
    pub fn choose(&mut self, tile: usize) {
        self.chosen[tile] = true;
    }

    /// Whether a tile is selected, by its row-major index.
    pub fn is_chosen(&self, tile: usize) -> bool {
        self.chosen[tile]
    }

    /// Whether any selected tile meets the box between two points of the map [texels].
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

/// Number of tiles across and down a map of the given size [texels].
pub fn tile_counts(width: usize, height: usize) -> (usize, usize) {
    (
        width.div_ceil(TILE_SIDE).max(1),
        height.div_ceil(TILE_SIDE).max(1),
    )
}

/// What one round refines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Round {
    /// Cells are divided if their light falls on these tiles.
    pub tiles: RoughTiles,
    /// Cells are divided if they contain one of these points of the launch domain: face and point of the unit square,
    /// ascending. Their patches reach the tiles though their rays do not.
    places: Vec<(u32, DVec2)>,
}

impl Round {
    /// For tiles selected after a level with these overshoots.
    pub fn new(tiles: RoughTiles, overshoots: &[PatchOvershoot]) -> Self {
        let meets = |patch: &&PatchOvershoot| {
            let tiles = tiles.get(&patch.receiver);
            tiles.is_some_and(|tiles| tiles.meets(patch.low, patch.high))
        };
        let mut places: Vec<(u32, DVec2)> = overshoots
            .iter()
            .filter(meets)
            .map(|patch| (patch.face, patch.middle))
            .collect();
        places.sort_by(|a, b| {
            a.0.cmp(&b.0)
                .then(a.1.x.total_cmp(&b.1.x))
                .then(a.1.y.total_cmp(&b.1.y))
        });
        Self { tiles, places }
    }

    /// Whether one of the points lies between two corners of the unit square.
    fn has_place(&self, face: u32, low: DVec2, high: DVec2) -> bool {
        let begin = self
            .places
            .partition_point(|(on, place)| (*on, place.x) < (face, low.x));
        self.places[begin..]
            .iter()
            .take_while(|(on, place)| *on == face && place.x <= high.x)
            .any(|(_, place)| place.y >= low.y && place.y <= high.y)
    }
}

/// Rounds of refinement so far.
#[derive(Clone, Copy, Debug)]
pub struct Refinement<'a> {
    pub receivers: &'a Receivers<'a>,
    /// Ascending: each round divides the cells of the previous ones once more.
    pub rounds: &'a [Round],
}

/// A set of rounds: bit r stands for round r.
pub type RoundSet = u32;

impl Refinement<'_> {
    /// Whether a cell that was divided in `rounds_before` rounds has to be divided again, judged by the samples at its
    /// corners and along its edges. `low` and `high` are corners of the cell in the unit square of its face.
    pub fn is_too_coarse(
        &self,
        (face, low, high): (usize, DVec2, DVec2),
        samples: &[&LatticeRay],
        rounds_before: usize,
    ) -> bool {
        let Some(Round { tiles, .. }) = self.rounds.get(rounds_before) else {
            return false;
        };
        if self.rounds[rounds_before].has_place(face as u32, low, high) {
            return true;
        }
        bright_signatures(samples).into_iter().any(|signature| {
            let segments = segments_of(samples, signature);
            self.falls_on(&segments, tiles)
        })
    }

    /// Rounds that divide neighbouring light which not all corners of a cell have: the border of that light may reach
    /// into the cell between its corners.
    pub fn rounds_beside(&self, own: [&LatticeRay; 4], beside: &[&LatticeRay]) -> RoundSet {
        if self.rounds.is_empty() {
            return 0;
        }
        let mut rounds = 0;
        for signature in bright_signatures(beside) {
            if own.iter().all(|sample| sample.find(signature).is_some()) {
                continue;
            }
            let segments = segments_of(beside, signature);
            for (round, Round { tiles, .. }) in self.rounds.iter().enumerate() {
                if self.falls_on(&segments, tiles) {
                    rounds |= 1 << round;
                }
            }
        }
        rounds
    }

    /// Whether a segment's light may fall on selected tiles: they meet the bounding box of the points that its corners
    /// light.
    fn falls_on(&self, corners: &[&PathSegment], tiles: &RoughTiles) -> bool {
        let mut lit: Vec<(Receiver, DVec2, DVec2)> = Vec::new();
        for segment in corners {
            let SegmentEnd::Receiver {
                receiver,
                triangle,
                barycentric,
                ..
            } = segment.landing
            else {
                continue;
            };
            let Some(surface) = self.receivers.get(receiver) else {
                continue;
            };
            let texel = surface.texel(triangle, barycentric);
            match lit.iter_mut().find(|(lit, ..)| *lit == receiver) {
                Some((_, low, high)) => (*low, *high) = (low.min(texel), high.max(texel)),
                None => lit.push((receiver, texel, texel)),
            }
        }
        lit.into_iter()
            .any(|(receiver, low, high)| tiles.get(&receiver).is_some_and(|tiles| tiles.meets(low, high)))
    }
}

/// Signatures of all segments that are not dim relative to the brightest.
fn bright_signatures(samples: &[&LatticeRay]) -> Vec<PathSignature> {
    let brightest_w = samples
        .iter()
        .map(|sample| sample.brightest_w)
        .fold(0.0, f64::max);
    let is_bright = |segment: &&PathSegment| segment.flux_w.luminance() >= MIN_SHARE * brightest_w;
    let segments = samples
        .iter()
        .flat_map(|sample| &sample.segments)
        .filter(is_bright);
    let mut signatures: Vec<PathSignature> = segments.map(|segment| segment.signature).collect();
    signatures.sort_unstable();
    signatures.dedup();
    signatures
}

fn segments_of<'s>(samples: &[&'s LatticeRay], signature: PathSignature) -> Vec<&'s PathSegment> {
    samples
        .iter()
        .filter_map(|sample| Some(&sample.segments[sample.find(signature)?]))
        .collect()
}
