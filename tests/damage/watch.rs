//! Watches what becomes of input: no panic, in time, within memory, and a sentence where it fails.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use cpu_time::ProcessTime;
use nephroid::error::{Error, ErrorKind, Result};

use crate::MEMORY;
use crate::support::evidence::keep_bytes;

/// CPU time, far more than any input here needs: a test for endless loops, not for speed.
const PATIENCE: Duration = Duration::from_secs(20);

/// Held by a test from its first line to its last: memory is counted over the whole process.
pub fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// How many inputs were tried, and how they ended.
#[derive(Debug, Default)]
pub struct Tally {
    pub taken: Cell<u32>,
    pub refused: Cell<u32>,
}

impl Tally {
    /// Tries one input, called `name`, which `work` is to take or refuse.
    ///
    /// # Panics
    /// A panic, a sentence that is none, more time than anybody has, more than `most_bytes` of memory; the input is
    /// kept.
    #[track_caller]
    pub fn watch<T>(
        &self,
        (name, input): (&str, &[u8]),
        most_bytes: usize,
        work: impl FnOnce() -> Result<T>,
    ) -> Option<T> {
        match watched(most_bytes, work) {
            Ok(Ok(taken)) => {
                self.taken.set(self.taken.get() + 1);
                Some(taken)
            }
            Ok(Err(_)) => {
                self.refused.set(self.refused.get() + 1);
                None
            }
            Err(fault) => panic!("{name}: {fault}; {}", keep_bytes(name, input)),
        }
    }

    /// Inputs so far.
    pub fn count(&self) -> u32 {
        self.taken.get() + self.refused.get()
    }
}

/// What came of `work`, or what was wrong with how it went.
pub fn watched<T>(
    most_bytes: usize,
    work: impl FnOnce() -> Result<T>,
) -> std::result::Result<Result<T>, String> {
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    let start = ProcessTime::now();
    let outcome = catch_unwind(AssertUnwindSafe(work)).map_err(|_| "it panicked".to_owned())?;
    let (took, bytes) = (start.elapsed(), MEMORY.peak_usage().saturating_sub(before));
    if took > PATIENCE {
        return Err(format!("it took {took:?}"));
    }
    if bytes > most_bytes {
        return Err(format!(
            "it took {bytes} bytes of memory, {most_bytes} at most are fair"
        ));
    }
    match &outcome {
        Err(error) => sentence_fault(error).map_or(Ok(outcome), Err),
        Ok(_) => Ok(outcome),
    }
}

/// What is wrong with an error's sentence, if anything is.
fn sentence_fault(error: &Error) -> Option<String> {
    let parts = [&error.location, &error.what, &error.remedy];
    let sentence = error.to_string();
    // What is said where a panic was caught on the way.
    let caught = sentence.contains("its contents cannot be understood");
    let is_one = parts.iter().all(|part| !part.trim().is_empty()) && sentence.len() < 2000;
    (caught || !is_one || error.kind == ErrorKind::Cancelled)
        .then(|| format!("it is refused with {sentence:?}"))
}

#[test]
fn what_goes_wrong_is_noticed() {
    let _alone = alone();
    let refused = |what: &str| Err::<(), Error>(Error::failure("a.glb", what, "export it again"));
    assert!(watched(1 << 20, || Ok(())).is_ok());
    assert!(watched(1 << 20, || refused("is broken")).is_ok());
    fn fault<T>(outcome: std::result::Result<Result<T>, String>) -> String {
        outcome.map(|_| ()).expect_err("it went wrong")
    }
    assert!(fault(watched(1 << 20, || refused(" "))).contains("refused with"));
    assert!(
        fault(watched(1 << 20, || refused("its contents cannot be understood"))).contains("refused with")
    );
    assert!(fault(watched(1 << 20, || Err::<(), _>(Error::cancelled("bake")))).contains("refused with"));
    let greedy = || Ok(std::hint::black_box(vec![1_u8; 2 << 20]).len());
    assert!(fault(watched(1 << 20, greedy)).contains("bytes of memory"));
    let panicking = || {
        if std::hint::black_box(true) {
            panic!("as it should")
        } else {
            Ok(())
        }
    };
    assert!(fault(watched(1 << 20, panicking)).contains("panicked"));
}
