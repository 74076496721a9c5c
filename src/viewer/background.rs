//! Background work on threads of its own.

use std::fmt;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use thread_priority::{ThreadPriority, ThreadPriorityValue, set_current_thread_priority};

use crate::error::{Error, Result};
use crate::progress::{Control, Progress, Stage};

/// Wakes the window from another thread.
#[derive(Clone)]
pub struct Wake(Arc<dyn Fn() + Send + Sync>);

impl Wake {
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

/// Priority of threads that give way to the window, from 0 to 99: niceness 4 on Unix, where the window then gets 70 % of a
/// core that both want. Much nicer threads would wait for every other program as well.
const BEHIND_WINDOW: u8 = 37;

/// Lets the window, and what draws its pictures, go before this thread wherever both want a core.
pub fn give_way() {
    let priority = ThreadPriorityValue::try_from(BEHIND_WINDOW).expect("it is below 100");
    if let Err(error) = set_current_thread_priority(ThreadPriority::Crossplatform(priority)) {
        log::debug!("a thread keeps its priority: {error}");
    }
}

/// Cancellation and progress of a task.
#[derive(Debug)]
pub struct Task {
    /// Cancelled when the result is no longer needed.
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

/// Runs tasks of one kind on a thread, one at a time, each with a key. Dropping it cancels the running task.
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
    /// No task is running. `wake` is called on progress and when a task ends.
    pub(super) fn new(name: &'static str, wake: &Wake) -> Self {
        Self {
            name,
            wake: wake.clone(),
            running: None,
        }
    }

    /// Key of the running task.
    pub(super) fn of(&self) -> Option<&K> {
        self.running.as_ref().map(|running| &running.of)
    }

    /// Last reported progress: done and total.
    pub(super) fn progress(&self) -> Option<(u64, u64)> {
        let task = &self.running.as_ref()?.task;
        *task.done.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Cancels the running task; its outcome can still be taken.
    pub(super) fn cancel(&self) {
        if let Some(running) = &self.running {
            running.task.control.cancel();
        }
    }

    /// Cancels the running task and discards its outcome.
    pub(super) fn stop(&mut self) {
        self.cancel();
        self.running = None;
    }

    /// Waits until the running task ends and discards its outcome.
    pub(super) fn wait(&mut self) {
        if let Some(running) = self.running.take()
            && running.thread.join().is_err()
        {
            log::error!("the thread `{}` panicked", self.name);
        }
    }
}

impl<K, T: Send + 'static> Background<K, T> {
    /// Starts a task; a running one is stopped.
    ///
    /// # Errors
    /// The system cannot create a thread.
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

    /// Key and outcome of a task that has ended; the outcome is `None` if the task panicked.
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

/// The newest result of work that depends on a key, kept until that of another key is there.
#[derive(Debug)]
pub struct Latest<K, T> {
    made: Option<(K, Arc<T>)>,
    coming: Background<K, T>,
}

impl<K: Clone, T: Send + Sync + 'static> Latest<K, T> {
    /// Nothing is made yet. `wake` is called when something is.
    pub(super) fn new(name: &'static str, wake: &Wake) -> Self {
        Self {
            made: None,
            coming: Background::new(name, wake),
        }
    }

    /// The newest result and its key.
    pub(super) fn made(&self) -> Option<&(K, Arc<T>)> {
        self.made.as_ref()
    }

    /// Drops the result and stops the work.
    pub(super) fn forget(&mut self) {
        self.made = None;
        self.coming.stop();
    }

    /// Starts to make the result of a key, from the one before, unless it is there or another one is being made.
    /// Returns whether a result has come.
    pub(super) fn follow(
        &mut self,
        key: &K,
        is_same: impl Fn(&K, &K) -> bool,
        make: impl FnOnce(Option<Arc<T>>, &Task) -> T + Send + 'static,
    ) -> bool {
        let mut is_new = false;
        if let Some((of, Some(made))) = self.coming.take() {
            self.made = Some((of, Arc::new(made)));
            is_new = true;
        }
        let is_there = self.made.as_ref().is_some_and(|(of, _)| is_same(of, key));
        if !is_there && self.coming.of().is_none() {
            let before = self.made.as_ref().map(|(_, made)| Arc::clone(made));
            if let Err(error) = self.coming.start(key.clone(), move |task| make(before, task)) {
                log::warn!("{error}");
            }
        }
        is_new
    }
}

/// Error for a thread that the system cannot create.
pub(super) fn no_thread(location: &str, error: &std::io::Error) -> Error {
    Error::failure(
        location,
        format!("the system refuses a thread for it ({error})"),
        "close other programs and try again",
    )
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    /// Niceness of this thread: the seventeenth field after the name, which may contain spaces.
    fn niceness() -> i32 {
        let stat = std::fs::read_to_string("/proc/thread-self/stat").expect("Linux tells");
        let (_, fields) = stat.rsplit_once(')').expect("the name is in brackets");
        fields
            .split_whitespace()
            .nth(16)
            .and_then(|nice| nice.parse().ok())
            .expect("it is a number")
    }

    #[test]
    fn threads_that_give_way_are_nicer_than_others() {
        let nicer = thread::spawn(|| {
            give_way();
            niceness()
        });
        let nicer = nicer.join().expect("it ends");
        assert!(nicer >= 4, "niceness {nicer}");
    }
}
