//! Background work on threads of its own.

use std::fmt;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use crate::error::{Error, Result};
use crate::progress::{Control, Progress, Stage};

/// Wakes the window from another thread.
#[derive(Clone)]
pub struct Wake(Arc<dyn Fn() + Send + Sync>);

impl Wake {
    /// By this.
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self(Arc::new(wake))
    }

    pub(super) fn wake(&self) {
        (self.0)();
    }
}

impl fmt::Debug for Wake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Wake")
    }
}

/// What a piece of work is stopped by, and tells its progress to.
#[derive(Debug)]
pub struct Task {
    /// Cancelled once the result is not needed any more.
    pub control: Control,
    done: Mutex<Option<(u64, u64)>>,
    wake: Wake,
}

impl Progress for Task {
    fn advance(&self, _: Stage, done: u64, total: u64) {
        *self.done.lock().unwrap_or_else(PoisonError::into_inner) = Some((done, total));
        self.wake.wake();
    }
}

/// Work of one kind, one piece at a time, each with what it is for. Dropping it asks the present piece to stop.
#[derive(Debug)]
pub struct Background<K, T> {
    name: &'static str,
    wake: Wake,
    running: Option<Running<K, T>>,
}

#[derive(Debug)]
struct Running<K, T> {
    of: K,
    outcome: Receiver<T>,
    task: Arc<Task>,
    thread: JoinHandle<()>,
}

impl<K, T> Background<K, T> {
    /// Nothing is under way; the window is woken when something is done.
    pub(super) fn new(name: &'static str, wake: &Wake) -> Self {
        Self {
            name,
            wake: wake.clone(),
            running: None,
        }
    }

    /// What the piece under way is for.
    pub(super) fn of(&self) -> Option<&K> {
        self.running.as_ref().map(|running| &running.of)
    }

    /// How much of how much was done, as it told last.
    pub(super) fn progress(&self) -> Option<(u64, u64)> {
        let task = &self.running.as_ref()?.task;
        *task.done.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Asks it to stop; what comes of it is still taken.
    pub(super) fn cancel(&self) {
        if let Some(running) = &self.running {
            running.task.control.cancel();
        }
    }

    /// Stops it, and forgets it.
    pub(super) fn stop(&mut self) {
        self.cancel();
        self.running = None;
    }

    /// Waits for its end.
    pub(super) fn wait(&mut self) {
        if let Some(running) = self.running.take()
            && running.thread.join().is_err()
        {
            log::error!("the thread `{}` panicked", self.name);
        }
    }
}

impl<K, T: Send + 'static> Background<K, T> {
    /// Starts a piece of work in the place of one that is still under way.
    ///
    /// # Errors
    /// The system gives no thread.
    pub(super) fn start(&mut self, of: K, work: impl FnOnce(&Task) -> T + Send + 'static) -> Result<()> {
        self.stop();
        let (give, outcome) = channel();
        let task = Arc::new(Task {
            control: Control::default(),
            done: Mutex::default(),
            wake: self.wake.clone(),
        });
        let of_work = Arc::clone(&task);
        let work = move || {
            // The receiver is gone if a newer task replaced this one or the window was closed.
            let _ = give.send(work(&of_work));
            of_work.wake.wake();
        };
        let thread = thread::Builder::new().name(self.name.into()).spawn(work);
        let thread = thread.map_err(|error| no_thread(self.name, &error))?;
        self.running = Some(Running {
            of,
            outcome,
            task,
            thread,
        });
        Ok(())
    }

    /// What came of it, once it is done: `None` for an outcome where it broke off.
    pub(super) fn take(&mut self) -> Option<(K, Option<T>)> {
        let outcome = match self.running.as_ref()?.outcome.try_recv() {
            Ok(outcome) => Some(outcome),
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => None,
        };
        let running = self.running.take()?;
        Some((running.of, outcome))
    }
}

impl<K, T> Drop for Background<K, T> {
    fn drop(&mut self) {
        self.cancel();
    }
}

/// Says that the system gives no thread.
pub(super) fn no_thread(location: &str, error: &std::io::Error) -> Error {
    Error::failure(
        location,
        format!("the system refuses a thread for it ({error})"),
        "close other programs and try again",
    )
}
