//! Whether a pass is traced here, restricted to one shard, or summed from shard files.

use std::io;

use super::ShardSource;
use super::pass_sums::PassSums;
use crate::error::{Error, Result};
use crate::light_pass::receiver_maps::ChartFor;
use crate::light_pass::shard_index::ShardIndex;

/// Where a pass is computed.
pub(in crate::bake) enum ShardRole {
    /// This bake computes it.
    Alone,
    /// This bake computes its share of it.
    Shard { share: ShardIndex, passes: Vec<Vec<u8>> },
    /// Shards have computed it.
    Merge(Merging),
}

/// Sums of shards, pass by pass.
pub(in crate::bake) struct Merging {
    shards: Box<dyn ShardSource>,
    /// Number of the next pass.
    next: usize,
}

impl ShardRole {
    pub(super) fn shard(share: ShardIndex) -> Self {
        Self::Shard {
            share,
            passes: Vec::new(),
        }
    }

    pub(super) fn merge(shards: Box<dyn ShardSource>) -> Self {
        Self::Merge(Merging { shards, next: 0 })
    }

    /// Whether the bake is split into shards.
    pub(in crate::bake) fn is_cut(&self) -> bool {
        !matches!(self, Self::Alone)
    }

    /// Whether maps hold only this shard's part of the light.
    pub(in crate::bake) fn is_shard(&self) -> bool {
        matches!(self, Self::Shard { .. })
    }

    /// This shard's share of the next pass; `None` if the pass is not split.
    pub(in crate::bake) fn share(&self) -> Option<ShardIndex> {
        match self {
            Self::Shard { share, passes } => Some(share.shifted(passes.len() as u64)),
            Self::Alone | Self::Merge(_) => None,
        }
    }

    /// Records the sums of a shard's pass.
    pub(in crate::bake) fn note(&mut self, sums: &PassSums) -> Result<()> {
        if let Self::Shard { share, passes } = self
            && !sums.report.cancelled
        {
            let encoded = sums.encode(*share, passes.len()).map_err(|error| {
                Error::failure(
                    "--shard",
                    format!("its sums cannot be packed ({error})"),
                    "report this",
                )
            });
            passes.push(encoded?);
        }
        Ok(())
    }

    /// The recorded passes of a shard.
    pub(super) fn into_passes(self) -> Vec<Vec<u8>> {
        match self {
            Self::Shard { passes, .. } => passes,
            Self::Alone | Self::Merge(_) => Vec::new(),
        }
    }

    /// Checks that no shard has passes that the bake did not ask for.
    pub(super) fn finish(&self) -> Result<()> {
        let Self::Merge(merging) = self else {
            return Ok(());
        };
        match (0..merging.shards.shard_count())
            .find(|&shard| merging.shards.pass_count(shard) != merging.next)
        {
            None => Ok(()),
            Some(shard) => Err(merging.other_passes(shard)),
        }
    }
}

impl Merging {
    /// The sum of the next pass over all shards.
    ///
    /// # Errors
    /// A shard without such a pass or with damaged sums; shards that are missing or given twice.
    pub(in crate::bake) fn pass(&mut self, chart_for: &ChartFor, mut sums: PassSums) -> Result<PassSums> {
        let number = self.next;
        self.next += 1;
        let mut shares = Vec::new();
        for shard in 0..self.shards.shard_count() {
            if number >= self.shards.pass_count(shard) {
                return Err(self.other_passes(shard));
            }
            let bytes = self.shards.pass(shard, number)?;
            let share = sums.add_encoded(number, &bytes, chart_for);
            shares.push(share.map_err(|error| self.unreadable(shard, &error))?);
        }
        shares.sort_unstable();
        let count = shares.len() as u32;
        if !shares.into_iter().eq((1..=count).map(|number| (number, count))) {
            return Err(Error::failure(
                self.shards.name(0),
                "a part of the lattice is in no shard, or in two",
                "bake all shards again",
            ));
        }
        Ok(sums)
    }

    fn other_passes(&self, shard: usize) -> Error {
        Error::failure(
            self.shards.name(shard),
            "it does not hold the passes of this bake",
            "bake the shard again with the program that merges",
        )
    }

    fn unreadable(&self, shard: usize, error: &io::Error) -> Error {
        Error::failure(
            self.shards.name(shard),
            format!("its sums are damaged ({error})"),
            "bake this shard again",
        )
    }
}
