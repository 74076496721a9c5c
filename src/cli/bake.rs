//! `bake`: maps and a manifest in a folder, or one shard of them as raw sums.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use nephroid::bake::forecast::forecast;
use nephroid::bake::{self, Bake, Forecast, ForecastReport, StopReason};
use nephroid::error::{Error, Result};
use nephroid::export::manifest::{Manifest, MapEntry};
use nephroid::export::map_folder::MapFolder;
use nephroid::export::sequence::{FrameTimes, SequenceFolder};
use nephroid::export::shards::{SceneOrigin, ShardFolder, ShardManifest};
use nephroid::light_pass::ledger::CarriedFlux;
use nephroid::light_pass::shard_index::ShardIndex;
use nephroid::scene::LoadOptions;
use nephroid::settings::{BakeSettings, Estimator, LayerKind, MapResolution};

use super::bake_options::BakeOptions;
use super::console::{Console, bytes, in_lines};
use super::loaded::{LoadedScene, within_reach};
use super::moments::MomentOptions;
use super::options::{RunOptions, SceneOptions};
use super::values;

/// Round error targets, for which forecasts are made [1].
const ROUND_TARGETS: [f64; 9] = [0.2, 0.1, 0.05, 0.03, 0.02, 0.01, 0.005, 0.002, 0.001];

#[derive(Debug, Args)]
pub struct BakeArguments {
    /// .glb, .gltf or builtin:NAME
    scene: String,
    /// Folder for the maps and manifest.json
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Write into a folder that holds other files
    #[arg(long, hide_short_help = true)]
    force: bool,
    /// Bake part I of N for `merge` (with --density and --map-resolution N)
    #[arg(long, value_name = "I/N", value_parser = values::share_of_bake, allow_hyphen_values = true)]
    shard: Option<ShardIndex>,
    #[command(flatten)]
    moment: MomentOptions,
    #[command(flatten)]
    scene_options: SceneOptions,
    #[command(flatten)]
    bake: BakeOptions,
    #[command(flatten)]
    pub run: RunOptions,
}

impl BakeArguments {
    /// Loads, bakes, writes and prints a summary.
    ///
    /// # Errors
    /// Bad usage; input, output or a bake that fails; a cancelled shard.
    pub fn run(&self, console: &Console) -> Result<()> {
        let settings = self.bake.settings(&[LayerKind::Caustic], self.run.threads())?;
        if self.shard.is_some() {
            bake::shards::check(&settings)?;
        }
        let options = self.scene_options.load_options(false);
        let times = self.moment.sequence();
        if times.is_some() {
            self.check_sequence(&settings)?;
        }
        let moment = (&self.moment, &settings.effects);
        let loaded = LoadedScene::load_at(&self.scene, &options, true, moment, console)?;
        if let Some(times) = times {
            return self.bake_sequence(times, &settings, &loaded, console);
        }
        if let Some(share) = self.shard {
            return self.bake_shard(share, &settings, &loaded, options, console);
        }
        let folder = MapFolder::open(&self.output, self.force)?;
        let result = loaded.bake(&settings, console)?;
        let manifest = folder.write(&loaded.scene, &settings, &result)?;
        let text = summary(&manifest, &result, &self.output.display().to_string());
        console.print_result(&text, &manifest)
    }

    fn check_sequence(&self, settings: &BakeSettings) -> Result<()> {
        let refused = |option: &str, what: &str, remedy: &str| Err(Error::usage(option, what, remedy));
        if self.shard.is_some() {
            return refused(
                "--shard",
                "a shard is a part of one moment",
                "bake every frame by itself with --time, or leave it out",
            );
        }
        if settings.map_resolution == MapResolution::Auto {
            return refused(
                "--frames",
                "`--map-resolution auto` may choose another size for every frame",
                "add --map-resolution, such as 256",
            );
        }
        Ok(())
    }

    fn bake_sequence(
        &self,
        times: FrameTimes,
        settings: &BakeSettings,
        loaded: &LoadedScene,
        console: &Console,
    ) -> Result<()> {
        // The folder is opened and memory is bounded before the first frame, since a film may take hours.
        let mut folder = SequenceFolder::open(&self.output, self.force, times)?;
        let affordable = within_reach(settings, console);
        let (mut worst, mut cpu_s) = (0.0_f64, 0.0);

        // One baker serves all frames and keeps what does not change between them. Each frame is written once it is
        // baked, so that memory holds the maps of one.
        loaded.session(console, |session, bar, control| {
            for frame in 0..times.frames {
                let scene = Arc::new(loaded.scene.at(times.time_s(frame)));
                session.set_scene(scene.clone())?;
                let result = session.bake(&affordable, bar, control)?;
                console.check(&loaded.scene.source)?;
                console.warn(&result.warnings);
                let entry = folder.write(frame, &scene, settings, &result)?;
                worst = worst.max(entry.error.estimated_visible.unwrap_or(0.0));
                cpu_s += entry.cpu_s;
            }
            Ok(())
        })?;

        // Only a film whose frames are all there gets its manifest.
        let Some(manifest) = folder.finish()? else {
            return Ok(());
        };

        // The worst frame stands for all, since a film flickers where one is noisier than its neighbours.
        let wall_s = loaded.seconds().0;
        let text = in_lines(&[
            ("folder", self.output.display().to_string()),
            ("frames", format!("{} at {} a second", times.frames, times.fps)),
            ("maps", format!("{} in each", manifest.maps.len())),
            (
                "error",
                format!("{:.2} % visible at most, estimated", 100.0 * worst),
            ),
            (
                "seconds",
                format!(
                    "{wall_s:.2} ({cpu_s:.2} of CPU), {:.3} of CPU a frame",
                    cpu_s / times.frames as f64
                ),
            ),
        ]);
        console.print_result(&text, &manifest)
    }

    fn bake_shard(
        &self,
        share: ShardIndex,
        settings: &BakeSettings,
        loaded: &LoadedScene,
        options: LoadOptions,
        console: &Console,
    ) -> Result<()> {
        // The folder of another shard is refused before the work, not after it.
        let folder = ShardFolder::open(&self.output, share, self.force)?;
        let affordable = within_reach(settings, console);

        // A shard keeps raw sums of flux instead of maps: these add up to the same texels in any order.
        let mut sums = loaded.session(console, |session, bar, control| {
            session.bake_shard(&affordable, share, bar, control)
        })?;
        loaded.book(&mut sums.timings_s, &mut sums.cpu_s);

        // The merge loads the scene in the same way, and refuses one whose hash differs.
        let origin = SceneOrigin {
            source: self.scene.clone(),
            default_light: options.default_light,
            solid_glass: options.solid_glass,
            environment: options.environment,
        };
        let manifest = ShardManifest::new(&loaded.scene, origin, settings, share, &sums);
        folder.write(&manifest, &sums)?;

        let size: usize = sums.passes.iter().map(Vec::len).sum();
        let (wall_s, cpu_s) = (sums.timings_s.total, sums.cpu_s.total);
        let text = in_lines(&[
            ("folder", self.output.display().to_string()),
            ("shard", format!("{} of {}", share.number(), share.count())),
            (
                "sums",
                format!("{} of {} passes", bytes(size as u64), sums.passes.len()),
            ),
            ("seconds", format!("{wall_s:.2} ({cpu_s:.2} of CPU)")),
        ]);
        console.print_result(&text, &manifest)
    }
}

/// Summary of a folder of maps as text.
pub fn summary(manifest: &Manifest, result: &Bake, folder: &str) -> String {
    let mut lines = Vec::new();
    let mut line = |name, value| lines.push((name, value));

    // Each file with its size in texels and the surface that it lights.
    line("folder", folder.to_string());
    for map in &manifest.maps {
        line(
            "map",
            format!("{} {}x{} of {}", map.file, map.width, map.height, map.surface),
        );
    }

    // Memory, if tiles save some of it.
    let sum = |bytes: fn(&MapEntry) -> u64| manifest.maps.iter().map(bytes).sum::<u64>();
    let (taken, dense) = (sum(|map| map.memory_bytes), sum(|map| map.dense_bytes));
    if taken < dense {
        let times = dense as f64 / taken as f64;
        line(
            "memory",
            format!(
                "{} of maps in tiles, {times:.1} times less than dense",
                bytes(taken)
            ),
        );
    }

    // A bake without maps states why, so that an effect that is off is not taken for an error.
    if manifest.maps.is_empty() {
        line("maps", format!("none: {}", why_nothing(result)));
    }

    // What was traced, and how exact that made the maps.
    let counts = &manifest.counts;
    let pieces = match result.counts.cells {
        0 => format!("{} splats", counts.splats),
        squares => format!("{squares} squares, {} splats", counts.splats),
    };
    line("rays", format!("{}, {pieces}", counts.rays));
    let (visible, rmse) = (result.estimated_visible, result.estimated_relative_rmse);
    if let Some((visible, rmse)) = visible.zip(rmse) {
        let why = match result.stop_reason {
            StopReason::MaxError if result.has_met_target(&manifest.settings) => ": the target is met",
            StopReason::MaxError => ": the target is missed",
            StopReason::MaxTime => ": the time was up",
            StopReason::Memory => ": the target takes more memory",
            _ => "",
        };
        let [visible, rmse] = [visible, rmse].map(|error| 100.0 * error);
        line(
            "error",
            format!("{visible:.2} % visible, {rmse:.2} % relative RMSE, estimated{why}"),
        );
    }

    // A forecast beside its actual cost shows how far to trust the next one.
    if let Some(report) = &result.forecast {
        line("forecast", forecast_text(report));
    }
    if let Some(next) = next_target(result, manifest.settings.estimator) {
        line("next", next.in_words());
    }

    // Where the light went, and what carried it. Each account is summed on its own, so that the balance is a test.
    let energy = &manifest.energy_w;
    let mut watts = format!(
        "{:.6} emitted = {:.6} deposited + {:.6} absorbed + {:.6} escaped + {:.6} truncated",
        energy.emitted,
        energy.deposited,
        energy.absorbed,
        energy.escaped,
        energy.truncated.total()
    );
    if energy.sampling != 0.0 {
        let sign = if energy.sampling < 0.0 { '-' } else { '+' };
        watts += &format!(" {sign} {:.6} sampling", energy.sampling.abs());
    }
    line("watts", watts);
    if let Some(parts) = CarriedFlux::sum(&result.ledgers).in_words(energy.deposited) {
        line("carried", parts);
    }
    line(
        "seconds",
        format!(
            "{:.2} ({:.2} of CPU)",
            manifest.timings_s.total, manifest.cpu_s.total
        ),
    );
    if manifest.partial {
        line("partial", "stopped before it was done".to_string());
    }
    in_lines(&lines)
}

/// The forecast from when the error was first known, and the actual cost.
fn forecast_text(report: &ForecastReport) -> String {
    let (made_at, actual) = (&report.made_at, &report.actual);
    format!(
        "{}, was expected at {:.1} %; it took {:.2} s, {} rays",
        report.expected.in_words(),
        100.0 * made_at.error,
        actual.wall_s,
        actual.rays
    )
}

/// Forecast for the next smaller round target.
fn next_target(result: &Bake, estimator: Estimator) -> Option<Forecast> {
    let reached = result.course.last()?.error;
    let target = ROUND_TARGETS.into_iter().find(|target| *target < 0.9 * reached)?;
    forecast(&result.course, target, estimator)
}

/// The plan's reason for having nothing to do.
fn why_nothing(result: &Bake) -> String {
    if result.stop_reason == StopReason::Cancelled {
        return "stopped before anything was deposited".into();
    }
    let off = result.plan.effects.iter().find(|line| !line.on);
    off.map_or("no surface received light", |line| line.reason.as_str())
        .to_string()
}
