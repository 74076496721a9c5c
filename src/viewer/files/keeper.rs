//! Writes what is kept on a thread of its own, soon after it changed and at the end.

use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::config::ConfigFolder;
use super::kept::Kept;
use super::recent::Recent;
use crate::scene::Scene;
use crate::scene::changes::Changes;

/// Longest that a change waits: a program that is killed loses no more than this.
pub const SOON: Duration = Duration::from_secs(1);

/// What is to be written of a scene.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// All but the edits; of those, what was kept before and not taken over.
    pub kept: Kept,
    /// As it was loaded.
    pub loaded: Arc<Scene>,
    /// As it is edited.
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
pub struct Keeper {
    folder: ConfigFolder,
    /// As it was handed over last, or read back.
    known: Option<Snapshot>,
    /// What is another one since some time.
    waiting: Option<(Instant, Snapshot)>,
    /// What is being written.
    writing: Option<JoinHandle<()>>,
}

impl Keeper {
    /// Keeps nothing yet.
    pub fn new(folder: ConfigFolder) -> Self {
        Self {
            folder,
            known: None,
            waiting: None,
            writing: None,
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
        self.wait();
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
        self.wait();
        match thread::Builder::new().name("keeper".into()).spawn(work) {
            Ok(writing) => self.writing = Some(writing),
            Err(error) => log::warn!("what is kept cannot be written: {error}"),
        }
    }

    fn wait(&mut self) {
        if let Some(writing) = self.writing.take()
            && writing.join().is_err()
        {
            log::error!("the thread that keeps settings panicked");
        }
    }
}

impl Drop for Keeper {
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
        let changes = Changes::between(&loaded, &edited);
        for lost in changes.lost {
            log::warn!("{lost}, which is not kept");
        }
        kept.changes = changes.changes;
    }
    if let Err(error) = folder.write_scene(&kept) {
        log::warn!("{error}");
    }
}
