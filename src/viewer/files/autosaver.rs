//! Saves the state of a scene on a thread of its own, shortly after it changed and at the end.

use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use super::Recent;
use super::config::{ConfigFolder, SavedState};
use crate::scene::Scene;
use crate::scene::changes::Change;
use crate::viewer::background::{Background, Task, Wake};

/// Longest time that a change stays unsaved: the most that a killed process loses.
pub const SOON: Duration = Duration::from_secs(1);

/// State of a scene to be saved.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Everything but the edits; of these, the ones that were saved before and not restored.
    pub kept: SavedState,
    /// The scene as loaded.
    pub loaded: Arc<Scene>,
    pub edited: Arc<Scene>,
}

impl Snapshot {
    /// Whether both would be saved alike.
    pub fn is_same(&self, other: &Self) -> bool {
        self.kept == other.kept
            && Arc::ptr_eq(&self.loaded, &other.loaded)
            && Arc::ptr_eq(&self.edited, &other.edited)
    }
}

/// Saves the state of scenes in a folder. Dropping it writes pending changes.
#[derive(Debug)]
pub struct Autosaver {
    folder: ConfigFolder,
    /// Last state that was saved or restored.
    known: Option<Snapshot>,
    /// Pending state, and the time of its first change.
    waiting: Option<(Instant, Snapshot)>,
    writing: Background<(), ()>,
}

impl Autosaver {
    pub fn new(folder: ConfigFolder) -> Self {
        Self {
            folder,
            known: None,
            waiting: None,
            writing: Background::new("keeper", &Wake::new(|| ())),
        }
    }

    /// Sets the restored state: only a state that differs from it is saved.
    pub fn begin(&mut self, snapshot: Snapshot) {
        self.known = Some(snapshot);
    }

    /// Takes the present state, and saves it [`SOON`] after the first change.
    pub fn look(&mut self, snapshot: Snapshot, now: Instant) {
        match &mut self.waiting {
            Some((_, waiting)) => *waiting = snapshot,
            None if self.known.as_ref().is_some_and(|known| known.is_same(&snapshot)) => return,
            None => self.waiting = Some((now, snapshot)),
        }
        if self.due().is_some_and(|due| now >= due) {
            self.flush();
        }
    }

    /// When [`look`](Self::look) has to be called without any event.
    pub fn due(&self) -> Option<Instant> {
        self.waiting.as_ref().map(|(since, _)| *since + SOON)
    }

    /// Saves the list of recent files.
    pub fn keep_recent(&mut self, recent: &Recent) {
        let (folder, recent) = (self.folder.clone(), recent.clone());
        self.write(move || {
            if let Err(error) = folder.write_recent(&recent) {
                log::warn!("{error}");
            }
        });
    }

    /// Saves pending changes and waits until they are on disk, for a caller that reads them back at once.
    pub fn settle(&mut self) {
        self.flush();
        self.writing.wait();
    }

    /// Starts to save pending changes.
    fn flush(&mut self) {
        if let Some((_, snapshot)) = self.waiting.take() {
            self.known = Some(snapshot.clone());
            let folder = self.folder.clone();
            self.write(move || write(&folder, snapshot));
        }
    }

    /// Writes on a thread, after earlier writes.
    fn write(&mut self, work: impl FnOnce() + Send + 'static) {
        self.writing.wait();
        if let Err(error) = self.writing.start((), |_| work()) {
            log::warn!("what is kept cannot be written: {error}");
        }
    }
}

impl Drop for Autosaver {
    fn drop(&mut self) {
        self.settle();
    }
}

fn write(folder: &ConfigFolder, snapshot: Snapshot) {
    let Snapshot {
        mut kept,
        loaded,
        edited,
    } = snapshot;
    // Without edits, saved edits that were not restored are kept.
    if !Arc::ptr_eq(&loaded, &edited) {
        kept.changes = Change::diff(&loaded, &edited);
    }
    if let Err(error) = folder.write_scene(&kept) {
        log::warn!("{error}");
    }
}

/// Polling interval. A change counts once two polls see the same state, so that unfinished writes are not read.
pub const POLL_INTERVAL: Duration = Duration::from_millis(500);

/// Modification times and sizes [bytes] of files; `None` for a missing file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Stamps(Vec<(PathBuf, Option<(SystemTime, u64)>)>);

impl Stamps {
    /// Present state of files.
    pub fn of(paths: Vec<PathBuf>) -> Self {
        let stamp = |path: PathBuf| {
            let data = std::fs::metadata(&path).ok();
            let stamp = data.and_then(|data| Some((data.modified().ok()?, data.len())));
            (path, stamp)
        };
        Self(paths.into_iter().map(stamp).collect())
    }

    /// Present state of the same files.
    fn again(&self) -> Self {
        Self::of(self.0.iter().map(|(path, _)| path.clone()).collect())
    }
}

/// Blocks until the files differ from `known` and have come to rest; returns their new state, or `known` if
/// cancelled.
pub(super) fn changed(known: Stamps, task: &Task) -> Stamps {
    let mut before = known.clone();
    while !task.control.is_cancelled() {
        thread::sleep(POLL_INTERVAL);
        let now = known.again();
        if now == before && now != known {
            return now;
        }
        before = now;
    }
    known
}
