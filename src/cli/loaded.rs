//! A loaded scene, and bakes of it.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use cpu_time::ProcessTime;
use nephroid::bake::{Bake, Baker, Timings};
use nephroid::effect::EffectSwitches;
use nephroid::error::{Error, Result, Warning};
use nephroid::files;
use nephroid::progress::Control;
use nephroid::scene::{LoadOptions, Scene};
use nephroid::settings::BakeSettings;

use super::console::{Console, StageBar, bytes};
use super::moments::MomentOptions;

/// A scene, with clocks that started with the run, and their times when it was loaded.
pub struct LoadedScene {
    pub scene: Arc<Scene>,
    started: (Instant, ProcessTime),
    load_s: (f64, f64),
}

impl LoadedScene {
    /// Loads a scene and prints its warnings.
    ///
    /// # Errors
    /// A scene that cannot be read, or has no light although it needs one.
    pub fn load(source: &str, options: &LoadOptions, needs_light: bool, console: &Console) -> Result<Self> {
        let rest = (&MomentOptions::default(), &EffectSwitches::default());
        Self::load_at(source, options, needs_light, rest, console)
    }

    /// Loads a scene at a moment.
    ///
    /// # Errors
    /// As [`Self::load`]; a moment of a scene that does not move.
    pub fn load_at(
        source: &str,
        options: &LoadOptions,
        needs_light: bool,
        (moment, effects): (&MomentOptions, &EffectSwitches),
        console: &Console,
    ) -> Result<Self> {
        let started = (Instant::now(), ProcessTime::now());
        let scene = Arc::new(moment.apply(Scene::load(source, options)?, effects)?);
        if needs_light && scene.lights.is_empty() {
            return Err(Error::failure(
                source,
                "the scene has no light",
                "add one to the file, a sun with --default-light or a sky with --environment",
            ));
        }
        console.warn(&scene.warnings);
        let mut loaded = Self {
            scene,
            started,
            load_s: (0.0, 0.0),
        };
        loaded.load_s = loaded.seconds();
        Ok(loaded)
    }

    /// Wall-clock and CPU seconds since the start.
    pub fn seconds(&self) -> (f64, f64) {
        (
            self.started.0.elapsed().as_secs_f64(),
            self.started.1.elapsed().as_secs_f64(),
        )
    }

    /// Runs work on a baker of the scene, with a progress bar.
    ///
    /// # Errors
    /// Those of the work; a signal before it.
    pub fn session<T>(
        &self,
        console: &Console,
        work: impl FnOnce(&mut Baker, &StageBar, &Control) -> Result<T>,
    ) -> Result<T> {
        console.check(&self.scene.source)?;
        let mut session = Baker::new(self.scene.clone())?;
        let result = work(&mut session, &console.bar(), console.control());
        // What it keeps for another bake takes up to half a second to free: maps are written meanwhile.
        // Without a thread to be had, it is freed here.
        let _ = std::thread::Builder::new().spawn(|| drop(session));
        result
    }

    /// Bakes within the available memory, and prints the bake's warnings.
    ///
    /// # Errors
    /// Those of [`Baker::bake`].
    pub fn bake(&self, settings: &BakeSettings, console: &Console) -> Result<Bake> {
        let settings = within_reach(settings, console);
        let mut result = self.session(console, |session, bar, control| {
            session.bake(&settings, bar, control)
        })?;
        console.warn(&result.warnings);
        self.book(&mut result.timings_s, &mut result.cpu_s);
        Ok(result)
    }

    /// Sets the time of loading, and the total time until now.
    pub fn book(&self, wall: &mut Timings, cpu: &mut Timings) {
        (wall.load, cpu.load) = self.load_s;
        (wall.total, cpu.total) = self.seconds();
    }
}

/// Maximum size of a system file that is read [bytes].
const MAX_BYTES: u64 = 1 << 16;

/// Divisor of the remaining address space for maps: the rest is for rays, files and tables of the system.
const SHARE_OF_MAPS: u64 = 2;

/// The settings with no more memory for maps than is available; warns if that is less than requested.
pub fn within_reach<'a>(settings: &'a BakeSettings, console: &Console) -> Cow<'a, BakeSettings> {
    let most = left_bytes().map_or(u64::MAX, |left| left / SHARE_OF_MAPS);
    if settings.memory_bytes <= most {
        return Cow::Borrowed(settings);
    }
    console.warn(&[Warning::new(
        "--memory",
        format!(
            "the address space of this process is limited: maps may take {} instead of {}",
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

/// Remaining address space [bytes]; `None` if it is unlimited or unknown.
fn left_bytes() -> Option<u64> {
    let read = |name: &str| {
        let bytes = files::read_file(&Path::new("/proc/self").join(name), MAX_BYTES).ok()?;
        String::from_utf8(bytes).ok()
    };
    let limit = granted_bytes(&read("limits")?)?;
    Some(limit.saturating_sub(taken_bytes(&read("status")?)?))
}

/// The limit in the text of `/proc/PID/limits` [bytes]; `None` if there is none.
fn granted_bytes(limits: &str) -> Option<u64> {
    let line = limits
        .lines()
        .find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Address space in use [bytes], by the text of `/proc/PID/status`, which states it in KiB.
fn taken_bytes(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmSize:"))?;
    let kibibytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes << 10)
}
