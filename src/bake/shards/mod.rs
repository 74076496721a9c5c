//! Bakes in shards. Each shard traces and deposits its share of every pass and writes raw sums. The merge runs the same
//! passes on the sums of all shards without tracing a ray, and ends with the maps of the whole bake, bit for bit.
//!
//! What follows from the sums (smoothing, gutters, errors, maps) and what is not part of the light pass (direct and
//! indirect light) is done once, by the merge. All shards have to make the same decisions: settings under which
//! decisions depend on the traced light are refused.

mod pass_sums;
mod shard_role;

use std::time::Instant;

use crate::bake::clock::Clock;
use crate::bake::light_level::LightStates;
use crate::bake::{Bake, Baker, Timings};
use crate::error::{Error, Result};
use crate::light_pass::pass_report::Stopwatch;
use crate::light_pass::shard_index::ShardIndex;
use crate::plan;
use crate::progress::{Control, Progress};
use crate::settings::{BakeSettings, MapResolution};
pub(super) use pass_sums::PassSums;
pub(super) use shard_role::ShardRole;

/// Output of a shard.
#[derive(Clone, Debug)]
pub struct ShardSums {
    /// Compressed sums of each pass.
    pub passes: Vec<Vec<u8>>,
    /// Wall-clock seconds.
    pub timings_s: Timings,
    /// CPU seconds over all threads of the process.
    pub cpu_s: Timings,
}

/// Access to the sums of all shards of a bake.
pub trait ShardSource: Send + Sync {
    /// Number of shards.
    fn shard_count(&self) -> usize;

    /// Number of passes that a shard has sums of.
    fn pass_count(&self, shard: usize) -> usize;

    /// Sums of one pass of a shard, in the form of [`ShardSums::passes`].
    ///
    /// # Errors
    /// Sums that cannot be read.
    fn pass(&self, shard: usize, pass: usize) -> Result<Vec<u8>>;

    /// The shard's name in messages: its folder.
    fn name(&self, shard: usize) -> String;
}

/// Refuses settings that cannot be split: those under which the traced light decides how far the bake goes.
///
/// # Errors
/// A usage error that names the option and its replacement.
pub fn check(settings: &BakeSettings) -> Result<()> {
    settings.validate()?;

    // Each shard sees a part of the light only. Under the first three settings it would decide otherwise than the
    // others.
    if let Some(target) = settings.max_error {
        return Err(Error::usage(
            "--max-error",
            format!(
                "shards need a fixed density; only the whole bake knows whether its error is below {:.3} %",
                100.0 * target
            ),
            "give --density RAYS_PER_SR instead of --max-error, --max-time and --preset",
        ));
    }
    if settings.max_time_s.is_some() {
        return Err(Error::usage(
            "--max-time",
            "shards need a fixed density; a time limit ends each of them elsewhere",
            "give --density RAYS_PER_SR alone",
        ));
    }
    if settings.map_resolution == MapResolution::Auto {
        return Err(Error::usage(
            "--map-resolution",
            "shards need maps of a fixed size; auto depends on where light falls",
            "give --map-resolution N or WxH",
        ));
    }
    if !plan::wants_caustics(settings) {
        return Err(Error::usage(
            "--layers",
            "a shard is a part of the caustic layer, which --layers leaves out",
            "add caustic to --layers or bake without shards",
        ));
    }
    Ok(())
}

impl Baker {
    /// Bakes one shard of the caustic layer, as sums for [`Self::merge`].
    ///
    /// # Errors
    /// Settings outside their ranges or refused by [`check`]; maps that may exceed the memory limit; cancellation.
    pub fn bake_shard(
        &mut self,
        settings: &BakeSettings,
        share: ShardIndex,
        progress: &dyn Progress,
        control: &Control,
    ) -> Result<ShardSums> {
        check(settings)?;
        self.threads.of(settings)?.install(|| {
            let (whole, mut clock) = (Stopwatch::start(), Clock::default());
            let ground = self.prepare(settings, progress, control, (&mut clock, Instant::now()));
            let mut role = ShardRole::shard(share);
            let mut states = LightStates::default();
            ground.bake(&self.sizes, &mut states, &mut clock, &mut role, None)?;
            if control.is_cancelled() {
                return Err(Error::cancelled(&self.scene.source));
            }
            clock.total = whole.elapsed();
            let (timings_s, cpu_s) = clock.timings();
            Ok(ShardSums {
                passes: role.into_passes(),
                timings_s,
                cpu_s,
            })
        })
    }

    /// Merges the shards of a bake.
    ///
    /// # Errors
    /// As [`Self::bake_shard`]; sums that cannot be read or belong to another bake.
    pub fn merge(
        &mut self,
        settings: &BakeSettings,
        shards: Box<dyn ShardSource>,
        progress: &dyn Progress,
        control: &Control,
    ) -> Result<Bake> {
        check(settings)?;
        // Shards start without anything cached.
        self.lights = LightStates::default();
        let mut role = ShardRole::merge(shards);
        let threads = self.threads.of(settings)?;
        let result = threads.install(|| self.bake_here(settings, progress, control, None, &mut role))?;
        if control.is_cancelled() {
            return Err(Error::cancelled(&self.scene.source));
        }
        role.finish()?;
        Ok(result)
    }
}
