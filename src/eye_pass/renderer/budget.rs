//! Which levels of which maps the device holds where not all of them fit.

use super::paging::{TILE, is_halved};

/// What a map would take.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cost {
    /// The finest level that can be told from coarser ones where it is seen nearest; negative where even the finest is
    /// seen coarsely.
    pub(super) need: f64,
    /// Tiles of each level, from fine to coarse.
    pub(super) tiles: Vec<u64>,
}

/// Upper bound on the tiles of a map with all its coarser levels.
pub(super) fn tiles_of(width: usize, height: usize) -> u64 {
    let (mut width, mut height, mut tiles) = (width, height, 0);
    loop {
        tiles += (width.div_ceil(TILE) * height.div_ceil(TILE)) as u64;
        if !is_halved([width, height]) {
            return tiles;
        }
        (width, height) = (width.div_ceil(2), height.div_ceil(2));
    }
}

/// The finest level to be held of each map, so that together they take no more than `budget` tiles where the coarsest
/// levels alone do: as long as they take more, the map whose finest level is needed least loses it.
pub(super) fn finest_levels(costs: &[Cost], budget: u64) -> Vec<usize> {
    let mut finest = vec![0; costs.len()];
    let mut total: u64 = costs.iter().flat_map(|cost| &cost.tiles).sum();
    while total > budget {
        // Positive where the finest level held is finer than needed.
        let spare = |index: usize| costs[index].need - finest[index] as f64;
        let can_lose = |index: &usize| finest[*index] + 1 < costs[*index].tiles.len();
        let candidates = (0..costs.len()).filter(can_lose);
        let Some(least) = candidates.max_by(|a, b| spare(*a).total_cmp(&spare(*b)).then(b.cmp(a))) else {
            break;
        };
        total -= costs[least].tiles[finest[least]];
        finest[least] += 1;
    }
    finest
}
