//! Looks whether files change, on a thread of its own.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, SystemTime};

use crate::error::Result;
use crate::viewer::background::no_thread;

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

/// What both threads look at.
#[derive(Debug, Default)]
struct Shared {
    ends: AtomicBool,
    has_changed: AtomicBool,
}

/// Watches files until it is dropped.
#[derive(Debug)]
pub struct Watch {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    /// Watches files that were as `stamps` say; `wake` is called from another thread when they changed.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(stamps: Stamps, wake: Arc<dyn Fn() + Send + Sync>) -> Result<Self> {
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        let thread = thread::Builder::new()
            .name("watch".into())
            .spawn(move || look(&of_thread, stamps, &*wake))
            .map_err(|error| no_thread("watch", &error))?;
        Ok(Self {
            shared,
            thread: Some(thread),
        })
    }

    /// Whether they changed since it was asked last.
    pub fn take_change(&self) -> bool {
        self.shared.has_changed.swap(false, Ordering::AcqRel)
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // It can only have ended.
            let _ = thread.join();
        }
    }
}

fn look(shared: &Shared, mut known: Stamps, wake: &dyn Fn()) {
    let mut before = known.clone();
    loop {
        thread::park_timeout(BETWEEN_LOOKS);
        if shared.ends.load(Ordering::Acquire) {
            return;
        }
        let now = known.again();
        if now == before && now != known {
            known = now.clone();
            shared.has_changed.store(true, Ordering::Release);
            wake();
        }
        before = now;
    }
}
