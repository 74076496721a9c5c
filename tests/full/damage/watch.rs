//! Watches what becomes of input: no panic, in time, within memory, and a sentence where it fails.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::Command;
use std::time::Duration;

use cpu_time::ProcessTime;
use nephroid::error::{Error, ErrorKind, Result};

use super::mutate::{Damage, effort};
use support::evidence::keep_bytes;

/// Counts the bytes that are allocated, on all threads: bakes have several.
#[global_allocator]
static MEMORY: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;

/// CPU time, far more than any input here needs: a test for endless loops, not for speed.
const PATIENCE: Duration = Duration::from_secs(20);

/// Set where a test runs in a process of its own.
const ALONE: &str = "NEPHROID_DAMAGE_ALONE";

/// Does a test's work in a process of its own: memory and time are counted over the whole process, and other tests take
/// theirs beside it.
#[track_caller]
pub fn alone(work: impl FnOnce()) {
    if std::env::var_os(ALONE).is_some() {
        return work();
    }
    let thread = std::thread::current();
    let test = thread.name().expect("a test's thread has its name");
    let program = std::env::current_exe().expect("the path of this test binary");
    let mut command = Command::new(program);
    command.args(["--exact", "--nocapture", test]).env(ALONE, "yes");
    let output = command.output().expect("it starts");
    let [told, errors] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    assert!(
        output.status.success() && told.contains("1 passed"),
        "{told}{errors}"
    );
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
        let (count, outcome) = match watched(most_bytes, work) {
            Ok(Ok(taken)) => (&self.taken, Some(taken)),
            Ok(Err(_)) => (&self.refused, None),
            Err(fault) => panic!("{name}: {fault}; {}", keep_bytes(name, input)),
        };
        count.set(count.get() + 1);
        outcome
    }

    /// Fails unless more were taken and more refused than that.
    #[track_caller]
    pub fn expect(&self, taken: u32, refused: u32) {
        assert!(
            self.taken.get() > taken && self.refused.get() > refused,
            "{self:?}"
        );
    }
}

/// A kind of damage to a file.
pub type Way = fn(&mut Damage, &[u8]) -> Vec<u8>;

/// What is damaged: a name, by which the damage is seeded, the whole file, and how.
pub type Subject<'a> = (&'a str, Vec<u8>, Way);

/// How often each subject is damaged, for `NEPHROID_MUTATIONS` = 1, and the memory that reading one may take [bytes].
pub type Bounds = (usize, usize);

/// Reads every subject damaged in every way; what is taken has to be without fault.
#[track_caller]
pub fn attack<T>(
    tally: &Tally,
    (times, most_bytes): Bounds,
    subjects: &[Subject<'_>],
    read: impl Fn(&[u8]) -> Result<T>,
    fault: impl Fn(T) -> Option<String>,
) {
    for (subject, whole, damage) in subjects {
        for number in 0..times * effort() {
            let bytes = damage(&mut Damage::to(subject, number), whole);
            let name = format!("{number}-{subject}");
            let taken = tally.watch((&name, &bytes), most_bytes, || read(&bytes));
            if let Some(fault) = taken.and_then(&fault) {
                panic!("{name}: {fault}; {}", keep_bytes(&name, &bytes));
            }
        }
    }
}

/// What came of `work`, or what was wrong with how it went.
fn watched<T>(most_bytes: usize, work: impl FnOnce() -> Result<T>) -> std::result::Result<Result<T>, String> {
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
    match outcome.as_ref().err().and_then(sentence_fault) {
        Some(fault) => Err(fault),
        None => Ok(outcome),
    }
}

/// What is wrong with an error's sentence, if anything is.
fn sentence_fault(error: &Error) -> Option<String> {
    let parts = [&error.location, &error.what, &error.remedy];
    let sentence = error.to_string();
    // What is said where a panic was caught on the way.
    let caught = sentence.contains("its contents cannot be understood");
    let is_one = parts.iter().all(|part| !part.trim().is_empty()) && sentence.len() < 2000;
    let is_fair = !caught && is_one && error.kind != ErrorKind::Cancelled;
    (!is_fair).then(|| format!("it is refused with {sentence:?}"))
}

/// The one test of these tests: all of them rest on this.
#[test]
fn what_goes_wrong_is_noticed() {
    alone(|| {
        let fault = |outcome: std::result::Result<Result<usize>, String>| outcome.err().unwrap_or_default();
        let refused = |what: &str| watched(1 << 20, || Err(Error::failure("a.glb", what, "export it again")));
        assert_eq!(fault(watched(1 << 20, || Ok(0))), "");
        assert_eq!(fault(refused("is broken")), "");
        assert!(fault(refused(" ")).contains("refused with"));
        assert!(fault(refused("its contents cannot be understood")).contains("refused with"));
        let cancelled = || Err(Error::cancelled("bake"));
        assert!(fault(watched(1 << 20, cancelled)).contains("refused with"));
        let greedy = || {
            Ok(
                std::thread::spawn(|| std::hint::black_box(vec![1_u8; 2 << 20]).len())
                    .join()
                    .unwrap_or(0),
            )
        };
        assert!(fault(watched(1 << 20, greedy)).contains("bytes of memory"));
        assert!(fault(watched(1 << 20, || panic!("as it should"))).contains("panicked"));
    });
}
