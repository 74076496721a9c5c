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

/// Longest that a change waits: a program that is killed loses no more than this.
pub const SOON: Duration = Duration::from_secs(1);

/// What is to be written of a scene.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// All but the edits; of those, what was kept before and not taken over.
    pub kept: SavedState,
    /// As it was loaded.
    pub loaded: Arc<Scene>,
    pub edited: Arc<Scene>,
}

impl Snapshot {
    /// Whether both would be written alike.
    pub fn is_same(&self, other: &Self) -> bool {
        self.kept == other.kept
            && Arc::ptr_eq(&self.loaded, &other.loaded)
            && Arc::ptr_eq(&self.edited, &other.edited)
    }
}

/// Keeps scenes in a folder; dropping it writes what is still to be written.
#[derive(Debug)]
pub struct Autosaver {
    folder: ConfigFolder,
    /// As it was handed over last, or read back.
    known: Option<Snapshot>,
    /// What is another one since some time.
    waiting: Option<(Instant, Snapshot)>,
    writing: Background<(), ()>,
}

impl Autosaver {
    /// Keeps nothing yet.
    pub fn new(folder: ConfigFolder) -> Self {
        Self {
            folder,
            known: None,
            waiting: None,
            writing: Background::new("keeper", &Wake::new(|| ())),
        }
    }

    /// What is in the window from now on, as it was read back: only what comes to differ from it is written.
    pub fn begin(&mut self, snapshot: Snapshot) {
        self.known = Some(snapshot);
    }

    /// Looks what is in the window, and hands it over once it has been another one for [`SOON`].
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

    /// When [`look`](Self::look) is to be called though nothing happens.
    pub fn due(&self) -> Option<Instant> {
        self.waiting.as_ref().map(|(since, _)| *since + SOON)
    }

    /// Keeps the list of files that were opened.
    pub fn keep_recent(&mut self, recent: &Recent) {
        let (folder, recent) = (self.folder.clone(), recent.clone());
        self.write(move || {
            if let Err(error) = folder.write_recent(&recent) {
                log::warn!("{error}");
            }
        });
    }

    /// Writes what waits, and comes back when it is on the disk: for who reads it back at once.
    pub fn settle(&mut self) {
        self.flush();
        self.writing.wait();
    }

    /// Begins to write what waits.
    fn flush(&mut self) {
        if let Some((_, snapshot)) = self.waiting.take() {
            self.known = Some(snapshot.clone());
            let folder = self.folder.clone();
            self.write(move || write(&folder, snapshot));
        }
    }

    /// Writes on a thread, after what is being written.
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
    // Without an edit, what was kept of edits before is kept on.
    if !Arc::ptr_eq(&loaded, &edited) {
        kept.changes = Change::between(&loaded, &edited);
    }
    if let Err(error) = folder.write_scene(&kept) {
        log::warn!("{error}");
    }
}

/// Time between two looks. A change counts once it is the same at two of them: who writes has come to rest.
pub const BETWEEN_LOOKS: Duration = Duration::from_millis(500);

/// When files were written last, and how long they are; `None` for one that is not there.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Stamps(Vec<(PathBuf, Option<(SystemTime, u64)>)>);

impl Stamps {
    /// As the files are now.
    pub fn of(paths: Vec<PathBuf>) -> Self {
        let stamp = |path: PathBuf| {
            let data = std::fs::metadata(&path).ok();
            let stamp = data.and_then(|data| Some((data.modified().ok()?, data.len())));
            (path, stamp)
        };
        Self(paths.into_iter().map(stamp).collect())
    }

    /// Of the same files now.
    fn again(&self) -> Self {
        Self::of(self.0.iter().map(|(path, _)| path.clone()).collect())
    }
}

/// Waits until files that were as `known` says have changed; as they are then.
pub(super) fn changed(known: Stamps, task: &Task) -> Stamps {
    let mut before = known.clone();
    while !task.control.is_cancelled() {
        thread::sleep(BETWEEN_LOOKS);
        let now = known.again();
        if now == before && now != known {
            return now;
        }
        before = now;
    }
    known
}
