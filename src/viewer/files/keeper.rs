//! Writes what is kept on a thread of its own, soon after it changed and at the end.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
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

#[derive(Debug, Default)]
struct Slot {
    snapshots: Vec<Snapshot>,
    recent: Option<Recent>,
    is_writing: bool,
    ends: bool,
}

#[derive(Debug, Default)]
struct Shared {
    slot: Mutex<Slot>,
    news: Condvar,
}

impl Shared {
    /// No code that can panic runs under the lock, so a poisoned one still holds a valid slot.
    fn lock(&self) -> MutexGuard<'_, Slot> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Keeps scenes in a folder; dropping it writes what is still to be written.
#[derive(Debug)]
pub struct Keeper {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    /// As it was handed over last, or read back.
    known: Option<Snapshot>,
    /// What is another one since some time.
    waiting: Option<(Instant, Snapshot)>,
}

impl Keeper {
    /// Starts the thread; `None` where the system gives none: nothing is kept then.
    pub fn start(folder: ConfigFolder) -> Option<Self> {
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        let thread = thread::Builder::new().name("keeper".into());
        let thread = thread.spawn(move || serve(&of_thread, &folder)).ok()?;
        Some(Self {
            shared,
            thread: Some(thread),
            known: None,
            waiting: None,
        })
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
    pub fn keep_recent(&self, recent: &Recent) {
        self.shared.lock().recent = Some(recent.clone());
        self.shared.news.notify_all();
    }

    /// Writes what waits, and comes back when it is on the disk: for who reads it back at once.
    pub fn settle(&mut self) {
        self.flush();
        let mut slot = self.shared.lock();
        while slot.is_writing || !slot.snapshots.is_empty() {
            slot = self
                .shared
                .news
                .wait(slot)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Hands over what waits.
    fn flush(&mut self) {
        if let Some((_, snapshot)) = self.waiting.take() {
            self.known = Some(snapshot.clone());
            let mut slot = self.shared.lock();
            slot.snapshots
                .retain(|other| other.kept.source != snapshot.kept.source);
            slot.snapshots.push(snapshot);
            drop(slot);
            self.shared.news.notify_all();
        }
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        self.flush();
        self.shared.lock().ends = true;
        self.shared.news.notify_all();
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            log::error!("the thread that keeps settings panicked");
        }
    }
}

/// The thread's life.
fn serve(shared: &Shared, folder: &ConfigFolder) {
    loop {
        let (snapshots, recent) = {
            let mut slot = shared.lock();
            while slot.snapshots.is_empty() && slot.recent.is_none() {
                if slot.ends {
                    return;
                }
                slot = shared.news.wait(slot).unwrap_or_else(PoisonError::into_inner);
            }
            slot.is_writing = true;
            (std::mem::take(&mut slot.snapshots), slot.recent.take())
        };
        for snapshot in snapshots {
            write(folder, snapshot);
        }
        if let Some(Err(error)) = recent.map(|recent| folder.write_recent(&recent)) {
            log::warn!("{error}");
        }
        shared.lock().is_writing = false;
        shared.news.notify_all();
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
