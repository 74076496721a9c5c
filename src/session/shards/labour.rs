//! Who does the work of a pass: the bake itself, one shard of it, or shards that have done it before.

use std::collections::BTreeMap;
use std::io;

use super::ShardSource;
use super::pass_sums::PassSums;
use crate::error::{Error, Result};
use crate::light_pass::receiver_maps::ChartFor;
use crate::light_pass::share::Share;
use crate::light_pass::wavefront::ray_log::KnownRays;

/// What a bake of the whole keeps of a pass for later ones, as far as it takes no more than so many bytes: what it then
/// does not count again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::session) enum Kept {
    /// Nothing.
    Nothing,
    /// Every ray.
    Rays(u64),
    /// All that arrives.
    Arrivals(u64),
    /// It uses what arrived before.
    FromArrivals,
}

/// One pass of a bake.
#[derive(Clone, Copy)]
pub(in crate::session) struct Pass<'a> {
    /// Whose light, by its place in the scene.
    pub(in crate::session) light: usize,
    /// What is kept of it.
    pub(in crate::session) kept: Kept,
    /// The charts of its maps.
    pub(in crate::session) chart_for: &'a ChartFor<'a>,
    /// Memory that what is read may take [bytes].
    pub(in crate::session) memory_bytes: u64,
}

/// Who does the work.
pub(in crate::session) enum Labour {
    /// This bake alone.
    Alone,
    /// This bake, its share.
    Shard { share: Share, passes: Vec<Vec<u8>> },
    /// Others have done it.
    Merge(Merging),
}

/// Sums of shards, pass by pass.
pub(in crate::session) struct Merging {
    shards: Box<dyn ShardSource>,
    /// Number of the next pass.
    next: usize,
    /// Of each light, what a bake of the whole would know.
    known: BTreeMap<usize, KnownRays>,
    /// Lights whose arrivals it would keep.
    arrived: Vec<usize>,
}

impl Labour {
    pub(super) fn shard(share: Share) -> Self {
        Self::Shard {
            share,
            passes: Vec::new(),
        }
    }

    pub(super) fn merge(shards: Box<dyn ShardSource>) -> Self {
        Self::Merge(Merging {
            shards,
            next: 0,
            known: BTreeMap::new(),
            arrived: Vec::new(),
        })
    }

    /// Whether a bake is cut.
    pub(in crate::session) fn is_cut(&self) -> bool {
        !matches!(self, Self::Alone)
    }

    /// Whether maps are only a part of what they will be.
    pub(in crate::session) fn is_shard(&self) -> bool {
        matches!(self, Self::Shard { .. })
    }

    /// Whether others have done the work, whose times count.
    pub(in crate::session) fn is_merge(&self) -> bool {
        matches!(self, Self::Merge(_))
    }

    /// The share of the next pass; `None` where nobody shares.
    pub(in crate::session) fn share(&self) -> Option<Share> {
        match self {
            Self::Shard { share, passes } => Some(share.shifted(passes.len() as u64)),
            Self::Alone | Self::Merge(_) => None,
        }
    }

    /// Writes down what a shard did.
    pub(in crate::session) fn note(&mut self, sums: &PassSums) -> Result<()> {
        if let Self::Shard { passes, .. } = self
            && !sums.report.cancelled
        {
            let encoded = sums.encode().map_err(|error| {
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

    /// What a shard did.
    pub(super) fn into_passes(self) -> Vec<Vec<u8>> {
        match self {
            Self::Shard { passes, .. } => passes,
            Self::Alone | Self::Merge(_) => Vec::new(),
        }
    }

    /// Whether shards have sums of no other passes than those that were asked for.
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
    /// A shard that has no such pass, or whose sums are damaged.
    pub(in crate::session) fn pass(&mut self, pass: &Pass, mut sums: PassSums) -> Result<PassSums> {
        let number = self.next;
        self.next += 1;
        for shard in 0..self.shards.shard_count() {
            if number >= self.shards.pass_count(shard) {
                return Err(self.other_passes(shard));
            }
            let bytes = self.shards.pass(shard, number)?;
            sums.add_encoded(&bytes, pass.chart_for, pass.memory_bytes)
                .map_err(|error| self.unreadable(shard, &error))?;
        }
        self.count_once(pass, &mut sums)?;
        Ok(sums)
    }

    /// Takes back what a bake of the whole would not have done again.
    fn count_once(&mut self, pass: &Pass, sums: &mut PassSums) -> Result<()> {
        if !sums.rays.sort() {
            return Err(Error::failure(
                self.shards.name(0),
                "a part of the lattice is in no shard, or in two",
                "bake all shards again",
            ));
        }
        let report = &mut sums.report;
        match pass.kept {
            Kept::Nothing => {}
            Kept::Rays(most_bytes) => {
                let known = self.known.entry(pass.light).or_default();
                (report.rays, report.segments) = (0, 0);
                (report.paths.transmitted, report.paths.reflected) = (0, 0);
                for band in &sums.rays.bands {
                    let counts = known.count(band, most_bytes);
                    report.rays += counts.rays;
                    report.segments += counts.segments;
                    report.paths.transmitted += counts.transmitted;
                    report.paths.reflected += counts.reflected;
                }
            }
            Kept::Arrivals(most_bytes) => {
                if sums.kept_bytes <= most_bytes && most_bytes > 0 {
                    self.arrived.push(pass.light);
                }
            }
            Kept::FromArrivals => {
                if self.arrived.contains(&pass.light) {
                    (report.rays, report.segments) = (0, 0);
                    report.paths = Default::default();
                }
            }
        }
        Ok(())
    }

    fn other_passes(&self, shard: usize) -> Error {
        Error::failure(
            self.shards.name(shard),
            "it does not hold the passes of this bake",
            "bake the shard again with the program that merges",
        )
    }

    fn unreadable(&self, shard: usize, error: &io::Error) -> Error {
        let name = self.shards.name(shard);
        if error.kind() == io::ErrorKind::OutOfMemory {
            return Error::failure(
                name,
                "counting its rays takes more memory than the bake may",
                "bake all shards with more --memory",
            );
        }
        Error::failure(
            name,
            format!("its sums are damaged ({error})"),
            "bake this shard again",
        )
    }
}
