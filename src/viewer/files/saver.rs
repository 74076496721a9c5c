//! Writes the edited scene on a thread of its own.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use crate::error::{Error, Result};
use crate::scene::{LoadOptions, Scene, load};

/// Names that are tried beside the original.
const NUMBERS: std::ops::RangeInclusive<u32> = 1..=9999;

/// Writes one scene at a time.
pub struct Saver {
    wake: Arc<dyn Fn() + Send + Sync>,
    coming: Option<(PathBuf, Receiver<Result<()>>)>,
}

impl fmt::Debug for Saver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Saver {{ saving: {} }}", self.coming.is_some())
    }
}

impl Saver {
    /// Nothing is written yet; `wake` is called from another thread when something was.
    pub fn new(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        Self { wake, coming: None }
    }

    /// Writes a scene as [`load::save`], unless one is being written.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(
        &mut self,
        target: PathBuf,
        loaded: Arc<Scene>,
        edited: Arc<Scene>,
        options: LoadOptions,
    ) -> Result<()> {
        if self.coming.is_some() {
            return Ok(());
        }
        let (give, take) = channel();
        let (path, wake) = (target.clone(), Arc::clone(&self.wake));
        let write = move || {
            // The window may be closed by then; the file is whole or not there.
            let _ = give.send(load::save(&path, &loaded, &edited, &options));
            wake();
        };
        thread::Builder::new()
            .name("saver".into())
            .spawn(write)
            .map_err(|error| {
                Error::failure(
                    target.display().to_string(),
                    format!("the system gives no thread to write it on ({error})"),
                    "close other programs and try again",
                )
            })?;
        self.coming = Some((target, take));
        Ok(())
    }

    /// What was written, or why not, once.
    pub fn take(&mut self) -> Option<Result<PathBuf>> {
        let (target, outcome) = self.coming.as_ref()?;
        let outcome = match outcome.try_recv() {
            Err(TryRecvError::Empty) => return None,
            Ok(outcome) => outcome.map(|()| target.clone()),
            Err(TryRecvError::Disconnected) => Err(Error::failure(
                target.display().to_string(),
                "writing it broke off",
                "try again, or choose another place",
            )),
        };
        self.coming = None;
        Some(outcome)
    }
}

/// A name beside the original that is not taken, for who cannot be asked for one: `NAME-edited-0001.glb`.
pub fn free_name(original: &Path) -> Option<PathBuf> {
    let stem = original.file_stem()?.to_string_lossy();
    let named = |number: u32| original.with_file_name(format!("{stem}-edited-{number:04}.glb"));
    NUMBERS.map(named).find(|name| !name.exists())
}
