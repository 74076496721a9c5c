//! `bake --shard`: one part of a bake, as raw sums in a folder.

use std::fmt::Write as _;
use std::path::PathBuf;

use nephroid::error::Result;
use nephroid::export::shards::{SceneOrigin, ShardFolder, ShardManifest};
use nephroid::light_pass::share::Share;
use nephroid::session::{BakeSession, shards};
use nephroid::settings::BakeSettings;

use super::address_space;
use super::bake::{self, Clock};
use super::interrupt::Interrupt;
use super::progress_bar::StageBar;
use super::scene_input::{MissingLight, SceneInput};
use super::survey_report::bytes;
use super::terminal::Terminal;

/// A validated `bake --shard`.
#[derive(Debug)]
pub struct ShardJob {
    scene: SceneInput,
    settings: BakeSettings,
    share: Share,
    output: PathBuf,
    force: bool,
}

impl ShardJob {
    /// Checks that the bake can be cut.
    ///
    /// # Errors
    /// Settings under which the light decides how far it is traced.
    pub fn new(
        scene: SceneInput,
        settings: BakeSettings,
        share: Share,
        (output, force): (PathBuf, bool),
    ) -> Result<Self> {
        shards::check(&settings)?;
        Ok(Self {
            scene,
            settings,
            share,
            output,
            force,
        })
    }
}

/// Loads, bakes the share and writes its sums.
///
/// # Errors
/// Input, output or a bake that failed or was stopped.
pub fn run(job: &ShardJob, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
    let clock = Clock::start();
    let loaded = bake::load(&job.scene, &clock, terminal)?;
    let folder = ShardFolder::open(&job.output, job.share, job.force)?;
    interrupt.check(&loaded.scene.source)?;
    let mut session = BakeSession::new(loaded.scene.clone())?;
    let bar = StageBar::new(terminal);
    let settings = address_space::within_reach(&job.settings, terminal);
    let mut sums = session.bake_shard(&settings, job.share, &bar, interrupt.control())?;
    drop(bar);
    (sums.timings_s.load, sums.cpu_s.load) = loaded.load_s;
    (sums.timings_s.total, sums.cpu_s.total) = clock.seconds();
    let origin = SceneOrigin {
        source: job.scene.source.clone(),
        default_light: job.scene.missing_light == MissingLight::Add,
        solid_glass: job.scene.solid_glass,
        environment: job.scene.environment.clone(),
    };
    let manifest = ShardManifest::new(&loaded.scene, origin, &job.settings, job.share, &sums);
    folder.write(&manifest, &sums)?;
    let size: usize = sums.passes.iter().map(Vec::len).sum();
    let mut text = String::new();
    let _ = writeln!(text, "folder    {}", job.output.display());
    let _ = writeln!(text, "shard     {} of {}", job.share.number(), job.share.count());
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
