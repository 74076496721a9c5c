//! One piece of work on a thread of its own, whose outcome is asked for from time to time.

use std::fmt;
use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use crate::error::Error;
use crate::progress::Control;

/// Wakes the window from another thread.
#[derive(Clone)]
pub(super) struct Wake(pub(super) Arc<dyn Fn() + Send + Sync>);

impl fmt::Debug for Wake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Wake")
    }
}

/// The work under way; dropping it asks it to stop.
#[derive(Debug)]
pub(super) struct Background<T> {
    outcome: Receiver<T>,
    control: Arc<Control>,
}

impl<T: Send + 'static> Background<T> {
    /// Starts the work; the window is woken when it is done.
    ///
    /// # Errors
    /// The system gives no thread.
    pub(super) fn start(
        name: &str,
        wake: &Wake,
        work: impl FnOnce(&Control) -> T + Send + 'static,
    ) -> io::Result<Self> {
        let (give, outcome) = channel();
        let (control, Wake(wake)) = (Arc::<Control>::default(), wake.clone());
        let of_work = Arc::clone(&control);
        thread::Builder::new().name(name.into()).spawn(move || {
            // Nobody waits any more where something else was asked for, or the window was closed.
            let _ = give.send(work(&of_work));
            wake();
        })?;
        Ok(Self { outcome, control })
    }

    /// What came of it, `Some(None)` where it broke off; `None` while it goes on.
    pub(super) fn poll(&self) -> Option<Option<T>> {
        match self.outcome.try_recv() {
            Ok(outcome) => Some(Some(outcome)),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(None),
        }
    }
}

impl<T> Drop for Background<T> {
    fn drop(&mut self) {
        self.control.cancel();
    }
}

/// Says that the system gives no thread.
pub(super) fn no_thread(location: &str, to: &str, error: &io::Error) -> Error {
    Error::failure(
        location,
        format!("the system gives no thread to {to} on ({error})"),
        "close other programs and try again",
    )
}
