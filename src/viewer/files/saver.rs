//! Writes the edited scene on a thread of its own.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::{Error, Result};
use crate::progress::Control;
use crate::scene::{LoadOptions, Scene, load};
use crate::viewer::background::{Background, Wake, no_thread};

/// Names that are tried beside the original.
const NUMBERS: std::ops::RangeInclusive<u32> = 1..=9999;

/// Writes one scene at a time.
#[derive(Debug)]
pub struct Saver {
    wake: Wake,
    coming: Option<(PathBuf, Background<Result<()>>)>,
}

impl Saver {
    /// Nothing is written yet; `wake` is called from another thread when something was.
    pub fn new(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        Self {
            wake: Wake(wake),
            coming: None,
        }
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
        let path = target.clone();
        let write = move |_: &Control| load::save(&path, &loaded, &edited, &options);
        let outcome = Background::start("saver", &self.wake, write)
            .map_err(|error| no_thread(&target.display().to_string(), "write it", &error))?;
        self.coming = Some((target, outcome));
        Ok(())
    }

    /// What was written, or why not, once.
    pub fn take(&mut self) -> Option<Result<PathBuf>> {
        let (target, outcome) = self.coming.as_ref()?;
        let broken = || {
            Err(Error::failure(
                target.display().to_string(),
                "writing it broke off",
                "try again, or choose another place",
            ))
        };
        let outcome = outcome.poll()?.unwrap_or_else(broken).map(|()| target.clone());
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
