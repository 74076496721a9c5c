//! `bake --shard`: one part of a bake, as raw sums in a folder.

use std::fmt::Write as _;

use nephroid::error::Result;
use nephroid::export::shards::{SceneOrigin, ShardFolder, ShardManifest};
use nephroid::light_pass::share::Share;
use nephroid::session::BakeSession;

use super::bake::{self, Clock};
use super::inspect::bytes;
use super::job::BakeJob;
use super::job::MissingLight;
use super::terminal::Interrupt;
use super::terminal::StageBar;
use super::terminal::Terminal;

/// Loads, bakes the share and writes its sums.
///
/// # Errors
/// Input, output or a bake that failed or was stopped.
pub fn run(job: &BakeJob, share: Share, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
    let clock = Clock::start();
    let loaded = bake::load(&job.scene, &clock, terminal)?;
    let folder = ShardFolder::open(&job.output, share, job.force)?;
    interrupt.check(&loaded.scene.source)?;
    let mut session = BakeSession::new(loaded.scene.clone())?;
    let bar = StageBar::new(terminal);
    let settings = bake::within_reach(&job.settings, terminal);
    let mut sums = session.bake_shard(&settings, share, &bar, interrupt.control())?;
    drop(bar);
    (sums.timings_s.load, sums.cpu_s.load) = loaded.load_s;
    (sums.timings_s.total, sums.cpu_s.total) = clock.seconds();
    let origin = SceneOrigin {
        source: job.scene.source.clone(),
        default_light: job.scene.missing_light == MissingLight::Add,
        solid_glass: job.scene.solid_glass,
        environment: job.scene.environment.clone(),
    };
    let manifest = ShardManifest::new(&loaded.scene, origin, &job.settings, share, &sums);
    folder.write(&manifest, &sums)?;
    let size: usize = sums.passes.iter().map(Vec::len).sum();
    let mut text = String::new();
    let _ = writeln!(text, "folder    {}", job.output.display());
    let _ = writeln!(text, "shard     {} of {}", share.number(), share.count());
    let _ = writeln!(
        text,
        "sums      {} of {} passes",
        bytes(size as u64),
        sums.passes.len()
    );
    let _ = writeln!(
        text,
        "seconds   {:.2} ({:.2} of CPU)",
        sums.timings_s.total, sums.cpu_s.total
    );
    terminal.print_result(&text, &manifest)
}
