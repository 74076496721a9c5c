//! Reads a scene on a thread of its own, so that the window goes on.

use std::fmt;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use crate::error::{Error, Result};
use crate::scene::{self, LoadOptions, Scene};

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

struct Coming {
    source: String,
    purpose: Purpose,
    outcome: Receiver<Result<Scene>>,
}

/// Reads one scene at a time: who asks for another gives up the one before.
pub struct Loader {
    wake: Arc<dyn Fn() + Send + Sync>,
    coming: Option<Coming>,
}

impl fmt::Debug for Loader {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Loader {{ loading: {:?} }}", self.loading())
    }
}

impl Loader {
    /// Nothing is asked for yet; `wake` is called from another thread when a scene is there.
    pub fn new(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        Self { wake, coming: None }
    }

    /// Reads a scene from now on.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(&mut self, source: &str, purpose: Purpose, options: &LoadOptions) -> Result<()> {
        let (give, take) = channel();
        let (named, options, wake) = (source.to_owned(), options.clone(), Arc::clone(&self.wake));
        let read = move || {
            // Nobody waits any more where another scene was asked for.
            let _ = give.send(scene::load(&named, &options));
            wake();
        };
        thread::Builder::new()
            .name("loader".into())
            .spawn(read)
            .map_err(|error| {
                Error::failure(
                    source,
                    format!("the system gives no thread to read it on ({error})"),
                    "close other programs and try again",
                )
            })?;
        self.coming = Some(Coming {
            source: source.to_owned(),
            purpose,
            outcome: take,
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
        let outcome = match coming.outcome.try_recv() {
            Ok(outcome) => outcome,
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Err(Error::failure(
                &coming.source,
                "reading it broke off",
                "check the file and try again",
            )),
        };
        let Coming { source, purpose, .. } = self.coming.take()?;
        Some(Loaded {
            source,
            purpose,
            outcome,
        })
    }
}
