//! `merge`: the maps of a bake from the sums of its shards.

use nephroid::error::Result;
use nephroid::export::map_folder::MapFolder;
use nephroid::export::shards::ShardSet;
use nephroid::session::BakeSession;
use nephroid::settings::BakeSettings;

use super::args::MergeArguments;
use super::bake::{self, Clock};
use super::job::{MissingLight, SceneInput};
use super::terminal::Interrupt;
use super::terminal::StageBar;
use super::terminal::Terminal;

/// Reads, adds up and writes.
///
/// # Errors
/// Shards that are torn, missing or of different bakes; another scene; output that cannot be written.
pub fn run(job: &MergeArguments, threads: usize, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
    let clock = Clock::start();
    let shards = ShardSet::open(&job.shards)?;
    let (shards_wall_s, shards_cpu_s) = shards.seconds();
    let manifest = shards.manifest().clone();
    let input = SceneInput {
        source: job.scene.clone().unwrap_or(manifest.scene.source),
        missing_light: if manifest.scene.default_light {
            MissingLight::Add
        } else {
            MissingLight::Fail
        },
        solid_glass: manifest.scene.solid_glass,
        environment: job.environment.clone().or(manifest.scene.environment),
    };
    let loaded = bake::load(&input, &clock, terminal)?;
    shards.check_scene(&loaded.scene)?;
    let folder = MapFolder::open(&job.output, job.force)?;
    let settings = BakeSettings {
        threads,
        ..manifest.settings
    };
    interrupt.check(&loaded.scene.source)?;
    let mut session = BakeSession::new(loaded.scene.clone())?;
    let bar = StageBar::new(terminal);
    let mut result = session.merge(&settings, Box::new(shards), &bar, interrupt.control())?;
    drop(bar);
    terminal.print_warnings(&result.warnings);
    (result.timings_s.load, result.cpu_s.load) = loaded.load_s;
    let (wall_s, cpu_s) = clock.seconds();
    // What the maps took: shards run side by side, then this.
    result.timings_s.total = wall_s + shards_wall_s;
    result.cpu_s.total = cpu_s + shards_cpu_s;
    let manifest = folder.write(&loaded.scene, &settings, &result)?;
    let text = bake::summary(&manifest, &result, &job.output.display().to_string());
    terminal.print_result(&text, &manifest)
}
