//! `merge`: the maps of a bake from the sums of its shards.

use std::path::PathBuf;

use clap::Args;
use nephroid::error::Result;
use nephroid::export::map_folder::MapFolder;
use nephroid::export::shards::ShardSet;
use nephroid::scene::LoadOptions;
use nephroid::settings::BakeSettings;

use super::bake;
use super::console::Console;
use super::loaded::LoadedScene;
use super::options::RunOptions;

#[derive(Debug, Args)]
pub struct MergeArguments {
    /// The folders of all shards of a bake
    #[arg(required = true, value_name = "DIR")]
    shards: Vec<PathBuf>,
    /// Folder for the maps and manifest.json
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Write into a folder that holds other files
    #[arg(long, hide_short_help = true)]
    force: bool,
    /// The scene, if it has moved since the shards were baked
    #[arg(long, value_name = "SCENE")]
    scene: Option<String>,
    /// The environment image, if it has moved
    #[arg(long, value_name = "FILE")]
    environment: Option<PathBuf>,
    #[command(flatten)]
    pub run: RunOptions,
}

impl MergeArguments {
    /// Reads the shards, merges them and writes the maps.
    ///
    /// # Errors
    /// Shards that are damaged, missing or of different bakes; another scene; output that cannot be written.
    pub fn run(&self, console: &Console) -> Result<()> {
        // Shards are checked against each other before the scene is loaded, which takes longer.
        let threads = self.run.threads();
        let shards = ShardSet::open(&self.shards)?;
        let (shards_wall_s, shards_cpu_s) = shards.seconds();
        let manifest = shards.manifest().clone();

        // The scene is loaded as it was for the shards: other glass or another light would be another scene.
        let options = LoadOptions {
            solid_glass: manifest.scene.solid_glass,
            default_light: manifest.scene.default_light,
            environment: self.environment.clone().or(manifest.scene.environment),
            ..LoadOptions::default()
        };
        let source = self.scene.clone().unwrap_or(manifest.scene.source);
        let loaded = LoadedScene::load(&source, &options, true, console)?;
        shards.check_scene(&loaded.scene)?;

        // All settings are those of the shards except for the threads, which do not change the sums.
        let folder = MapFolder::open(&self.output, self.force)?;
        let settings = BakeSettings {
            threads,
            ..manifest.settings
        };
        let mut result = loaded.session(console, |session, bar, control| {
            session.merge(&settings, Box::new(shards), bar, control)
        })?;
        console.warn(&result.warnings);
        loaded.book(&mut result.timings_s, &mut result.cpu_s);

        // Total cost of the maps: the shards, side by side, then this merge.
        result.timings_s.total += shards_wall_s;
        result.cpu_s.total += shards_cpu_s;

        let manifest = folder.write(&loaded.scene, &settings, &result)?;
        let text = bake::summary(&manifest, &result, &self.output.display().to_string());
        console.print_result(&text, &manifest)
    }
}
