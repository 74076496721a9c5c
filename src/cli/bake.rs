//! `bake`: maps and a manifest in a folder.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use cpu_time::ProcessTime;

use super::inspect::bytes;
use super::job::BakeJob;
use super::job::SceneInput;
use super::terminal::Interrupt;
use super::terminal::StageBar;
use super::terminal::Terminal;
use nephroid::error::{Result, Warning};
use nephroid::export::manifest::{Manifest, MapEntry};
use nephroid::export::map_folder::MapFolder;
use nephroid::files;
use nephroid::light_pass::ledger::CarriedFlux;
use nephroid::scene::Scene;
use nephroid::session::forecast::forecast;
use nephroid::session::{BakeResult, BakeSession, Forecast, ForecastReport, StopReason};
use nephroid::settings::{BakeSettings, Estimator};

/// Errors that people ask for [1].
const ROUND_TARGETS: [f64; 9] = [0.2, 0.1, 0.05, 0.03, 0.02, 0.01, 0.005, 0.002, 0.001];

/// Clocks from the start of the run on.
pub struct Clock {
    wall: Instant,
    cpu: ProcessTime,
}

impl Clock {
    /// Starts both.
    pub fn start() -> Self {
        Self {
            wall: Instant::now(),
            cpu: ProcessTime::now(),
        }
    }

    /// Wall-clock seconds since the start.
    pub fn wall_s(&self) -> f64 {
        self.wall.elapsed().as_secs_f64()
    }

    /// Wall-clock and CPU seconds since the start.
    pub fn seconds(&self) -> (f64, f64) {
        (self.wall_s(), self.cpu.elapsed().as_secs_f64())
    }
}

/// A scene, with the wall-clock and CPU seconds that loading it took.
pub struct LoadedScene {
    pub scene: Arc<Scene>,
    pub load_s: (f64, f64),
}

/// Loads a scene and prints its warnings.
///
/// # Errors
/// A scene that cannot be read, or has no light where one is needed.
pub fn load(input: &SceneInput, clock: &Clock, terminal: &Terminal) -> Result<LoadedScene> {
    let scene = Arc::new(input.load()?);
    terminal.print_warnings(&scene.warnings);
    Ok(LoadedScene {
        scene,
        load_s: clock.seconds(),
    })
}

/// Bakes with a progress bar, and prints the bake's warnings.
///
/// # Errors
/// Those of [`BakeSession::bake`].
pub fn bake(
    loaded: &LoadedScene,
    settings: &BakeSettings,
    clock: &Clock,
    terminal: &Terminal,
    interrupt: &Interrupt,
) -> Result<BakeResult> {
    interrupt.check(&loaded.scene.source)?;
    let settings = within_reach(settings, terminal);
    let mut session = BakeSession::new(loaded.scene.clone())?;
    let bar = StageBar::new(terminal);
    let mut result = session.bake(&settings, &bar, interrupt.control())?;
    drop(bar);
    terminal.print_warnings(&result.warnings);
    (result.timings_s.load, result.cpu_s.load) = loaded.load_s;
    (result.timings_s.total, result.cpu_s.total) = clock.seconds();
    Ok(result)
}

/// Loads, bakes, writes and sums up.
///
/// # Errors
/// Input, output or a bake that failed.
pub fn run(job: &BakeJob, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
    let clock = Clock::start();
    let loaded = load(&job.scene, &clock, terminal)?;
    let folder = MapFolder::open(&job.output, job.force)?;
    let result = bake(&loaded, &job.settings, &clock, terminal, interrupt)?;
    let manifest = folder.write(&loaded.scene, &job.settings, &result)?;
    let text = summary(&manifest, &result, &job.output.display().to_string());
    terminal.print_result(&text, &manifest)
}

/// What people want to know of a folder of maps.
pub fn summary(manifest: &Manifest, result: &BakeResult, folder: &str) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<9} {value}");
    };
    line("folder", folder.to_string());
    for map in &manifest.maps {
        line(
            "map",
            format!("{} {}x{} of {}", map.file, map.width, map.height, map.surface),
        );
    }
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
    if manifest.maps.is_empty() {
        line("maps", format!("none: {}", why_nothing(result)));
    }
    let counts = &manifest.counts;
    let pieces = match result.counts.cells {
        0 => format!("{} splats", counts.splats),
        cells => format!("{cells} cells, {} splats", counts.splats),
    };
    line("rays", format!("{}, {pieces}", counts.rays));
    let (visible, rmse) = (result.estimated_visible, result.estimated_relative_rmse);
    if let Some((visible, rmse)) = visible.zip(rmse) {
        let why = match result.stop_reason {
            StopReason::MaxError => ": the target is met",
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
    if let Some(report) = &result.forecast {
        line("forecast", told(report));
    }
    if let Some(next) = next_target(result, manifest.settings.estimator) {
        line("next", next.in_words());
    }
    let energy = &manifest.energy_w;
    line(
        "watts",
        format!(
            "{:.6} emitted = {:.6} deposited + {:.6} absorbed + {:.6} escaped + {:.6} truncated",
            energy.emitted,
            energy.deposited,
            energy.absorbed,
            energy.escaped,
            energy.truncated.total()
        ),
    );
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
    text
}

/// What was expected when the error was first known, and what it took.
fn told(report: &ForecastReport) -> String {
    let (made_at, actual) = (&report.made_at, &report.actual);
    format!(
        "{}, was expected at {:.1} %; it took {:.2} s, {} rays",
        report.expected.in_words(),
        100.0 * made_at.error,
        actual.wall_s,
        actual.rays
    )
}

/// What the next better round target would take.
fn next_target(result: &BakeResult, estimator: Estimator) -> Option<Forecast> {
    let reached = result.course.last()?.error;
    let target = ROUND_TARGETS.into_iter().find(|target| *target < 0.9 * reached)?;
    forecast(&result.course, target, estimator)
}

/// The plan's reason for having nothing to do.
fn why_nothing(result: &BakeResult) -> String {
    if result.stop_reason == StopReason::Cancelled {
        return "stopped before anything was deposited".into();
    }
    let reasons: Vec<&str> = result
        .plan
        .effects
        .iter()
        .filter(|line| !line.on)
        .map(|line| line.reason.as_str())
        .take(1)
        .collect();
    reasons
        .first()
        .map_or("no surface received light", |reason| reason)
        .to_string()
}

/// More than the system says about a process [bytes].
const MOST_BYTES: u64 = 1 << 16;

/// Share of what is left that maps may take: as much again for rays, files and the system's own tables.
const SHARE_OF_MAPS: u64 = 2;

/// The settings with no more memory for maps than there is room for, with a warning where that is less than they ask.
pub fn within_reach<'a>(settings: &'a BakeSettings, terminal: &Terminal) -> Cow<'a, BakeSettings> {
    let most = left_bytes().map_or(u64::MAX, |left| left / SHARE_OF_MAPS);
    if settings.memory_bytes <= most {
        return Cow::Borrowed(settings);
    }
    terminal.print_warnings(&[Warning::new(
        "--memory",
        format!(
            "the system grants this process so little address space that maps may take {} and not {}",
            bytes(most),
            bytes(settings.memory_bytes)
        ),
        "raise the limit (ulimit -v) for finer maps",
    )]);
    Cow::Owned(BakeSettings {
        memory_bytes: most,
        ..settings.clone()
    })
}

/// Address space that is granted and not taken yet [bytes]; `None` where it is not limited or the system does not tell.
fn left_bytes() -> Option<u64> {
    let read = |name: &str| {
        let bytes = files::read_file(&Path::new("/proc/self").join(name), MOST_BYTES).ok()?;
        String::from_utf8(bytes).ok()
    };
    let limit = granted_bytes(&read("limits")?)?;
    Some(limit.saturating_sub(taken_bytes(&read("status")?)?))
}

/// The limit in the text of `/proc/PID/limits`; `None` where there is none.
fn granted_bytes(limits: &str) -> Option<u64> {
    let line = limits
        .lines()
        .find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// What is taken by the text of `/proc/PID/status`, in which it stands in KiB.
fn taken_bytes(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmSize:"))?;
    let kibibytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_read_as_the_system_writes_them() {
        let limits = |value: &str| {
            format!(
                "Limit                     Soft Limit           Hard Limit           Units     \n\
                 Max open files            1024                 524288               files     \n\
                 Max address space         {value}           unlimited            bytes     \n"
            )
        };
        assert_eq!(granted_bytes(&limits("1536000000")), Some(1_536_000_000));
        assert_eq!(granted_bytes(&limits("unlimited")), None);
        assert_eq!(granted_bytes(""), None);
        assert_eq!(
            taken_bytes("Name:\tnephroid\nVmPeak:\t  300 kB\nVmSize:\t  200 kB\n"),
            Some(204_800)
        );
        assert_eq!(taken_bytes("Name:\tnephroid\n"), None);
    }
}
