//! Reads a scene on a thread of its own, so that the window goes on.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::progress::Control;
use crate::scene::{self, LoadOptions, Scene};
use crate::viewer::background::{Background, Wake, no_thread};

/// Why a scene is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// To take the place of another.
    Open,
    /// Because its files changed.
    Reload,
}

/// A scene that was read, or not.
#[derive(Debug)]
pub struct Loaded {
    /// What was asked for: a path, or `builtin:NAME`.
    pub source: String,
    /// Why.
    pub purpose: Purpose,
    /// The scene, or what is wrong with it.
    pub outcome: Result<Scene>,
}

#[derive(Debug)]
struct Coming {
    source: String,
    purpose: Purpose,
    outcome: Background<Result<Scene>>,
}

/// Reads one scene at a time: who asks for another gives up the one before.
#[derive(Debug)]
pub struct Loader {
    wake: Wake,
    coming: Option<Coming>,
}

impl Loader {
    /// Nothing is asked for yet; `wake` is called from another thread when a scene is there.
    pub fn new(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        Self {
            wake: Wake(wake),
            coming: None,
        }
    }

    /// Reads a scene from now on.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(&mut self, source: &str, purpose: Purpose, options: &LoadOptions) -> Result<()> {
        let (named, options) = (source.to_owned(), options.clone());
        let read = move |_: &Control| scene::load(&named, &options);
        let outcome = Background::start("loader", &self.wake, read)
            .map_err(|error| no_thread(source, "read it", &error))?;
        self.coming = Some(Coming {
            source: source.to_owned(),
            purpose,
            outcome,
        });
        Ok(())
    }

    /// What is being read.
    pub fn loading(&self) -> Option<&str> {
        self.coming.as_ref().map(|coming| coming.source.as_str())
    }

    /// The scene that was asked for last, once it is there.
    pub fn take(&mut self) -> Option<Loaded> {
        let coming = self.coming.as_ref()?;
        let broken = || {
            Err(Error::failure(
                &coming.source,
                "reading it broke off",
                "check the file and try again",
            ))
        };
        let outcome = coming.outcome.poll()?.unwrap_or_else(broken);
        let Coming { source, purpose, .. } = self.coming.take()?;
        Some(Loaded {
            source,
            purpose,
            outcome,
        })
    }
}
