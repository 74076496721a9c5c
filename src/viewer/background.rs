//! Work on threads of their own, whose outcome is asked for from time to time.

use std::fmt;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use crate::error::{Error, Result};
use crate::progress::Control;

/// Wakes the window from another thread.
#[derive(Clone)]
pub struct Wake(pub(super) Arc<dyn Fn() + Send + Sync>);

impl fmt::Debug for Wake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Wake")
    }
}

/// Work of one kind, one piece at a time, each with what it is for.
#[derive(Debug)]
pub struct Background<K, T> {
    name: &'static str,
    wake: Wake,
    running: Option<Running<K, T>>,
}

/// A piece under way; dropping it asks it to stop.
#[derive(Debug)]
struct Running<K, T> {
    of: K,
    outcome: Receiver<T>,
    control: Arc<Control>,
}

impl<K, T> Drop for Running<K, T> {
    fn drop(&mut self) {
        self.control.cancel();
    }
}

impl<K: Clone, T: Send + 'static> Background<K, T> {
    /// Nothing is under way; `wake` is called from another thread when something is done.
    pub(super) fn new(name: &'static str, wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        Self {
            name,
            wake: Wake(wake),
            running: None,
        }
    }

    /// Starts a piece of work in the place of one that is still under way.
    ///
    /// # Errors
    /// The system gives no thread.
    pub(super) fn start(&mut self, of: K, work: impl FnOnce(&Control) -> T + Send + 'static) -> Result<()> {
        let (give, outcome) = channel();
        let (control, Wake(wake)) = (Arc::<Control>::default(), self.wake.clone());
        let of_work = Arc::clone(&control);
        self.running = None;
        let thread = thread::Builder::new().name(self.name.into()).spawn(move || {
            // Nobody waits any more where something else was asked for, or the window was closed.
            let _ = give.send(work(&of_work));
            wake();
        });
        thread.map_err(|error| no_thread(self.name, &error))?;
        self.running = Some(Running { of, outcome, control });
        Ok(())
    }

    /// What the piece under way is for.
    pub(super) fn of(&self) -> Option<&K> {
        self.running.as_ref().map(|running| &running.of)
    }

    /// Stops it.
    pub(super) fn stop(&mut self) {
        self.running = None;
    }

    /// What came of it, once it is done: `None` for an outcome where it broke off.
    pub(super) fn take(&mut self) -> Option<(K, Option<T>)> {
        let running = self.running.as_ref()?;
        let outcome = match running.outcome.try_recv() {
            Ok(outcome) => Some(outcome),
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => None,
        };
        let of = running.of.clone();
        self.running = None;
        Some((of, outcome))
    }
}

/// Says that the system gives no thread.
pub(super) fn no_thread(location: &str, error: &std::io::Error) -> Error {
    Error::failure(
        location,
        format!("the system gives no thread for it ({error})"),
        "close other programs and try again",
    )
}
