//! Seeded damage to bytes, text, JSON and binary glTF, and a watch on what becomes of input: no panic, in time, within
//! memory, and a sentence where it fails.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::Command;
use std::time::Duration;

use cpu_time::ProcessTime;
use nephroid::error::{Error, ErrorKind, Result};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use support::glb::{self, assembled};
use support::keep_bytes;
use support::prelude::*;

/// Damage by a seed: the same for the same one.
#[derive(Debug)]
pub struct Damage(Pcg64Mcg);

/// How many times as much is tried as usual.
pub fn effort() -> usize {
    let asked = std::env::var("NEPHROID_MUTATIONS").ok();
    asked.map_or(1, |times| times.parse().expect("NEPHROID_MUTATIONS is a factor"))
}

/// Numbers as text that programs stumble over.
const NUMBERS: &str = "0 -0 -1 1 2 255 65536 2147483648 4294967295 4294967296 9007199254740993 18446744073709551615 \
    18446744073709551616 1e-320 1e-45 1e38 3.5e38 1e308 -1e308 1e999 nan inf";

fn stumbling_number(damage: &mut Damage) -> &'static str {
    let numbers: Vec<&str> = NUMBERS.split(' ').collect();
    numbers[damage.below(numbers.len())]
}

/// The same as little-endian words, the last four of them NaN, infinity, the largest and the least single.
const WORDS: [u32; 12] = [
    0,
    1,
    0x7f,
    0xff,
    0xffff,
    0x7fffffff,
    0x80000000,
    0xffffffff,
    0x7fc00000,
    0x7f800000,
    0x7f7fffff,
    1 << 23,
];

impl Damage {
    /// Seeded by a name and a number, so that another file's damage stays as it is.
    pub fn to(name: &str, number: usize) -> Self {
        let hash = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        let seed = name.bytes().fold(0xcbf2_9ce4_8422_2325, hash) ^ (number as u64) << 32;
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// A number below another one, > 0.
    pub fn below(&mut self, count: usize) -> usize {
        (self.0.next_u64() % count as u64) as usize
    }

    pub fn one_of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        let index = self.below(all.len());
        &all[index]
    }

    /// Changes one to four places of a file.
    pub fn bytes(&mut self, file: &[u8]) -> Vec<u8> {
        let mut bytes = file.to_vec();
        for _ in 0..=self.below(4) {
            if bytes.is_empty() {
                break;
            }
            let at = self.below(bytes.len());
            let end = (at + 1 + self.below(16)).min(bytes.len());
            match self.below(8) {
                0 => bytes[at] ^= 1 << self.below(8),
                1 => bytes[at] = self.below(256) as u8,
                2 => drop(bytes.drain(at..end)),
                3 => bytes.truncate(at),
                4 => {
                    let piece = bytes[at..end].to_vec();
                    bytes.splice(at..at, piece);
                }
                5 => bytes[at..end].reverse(),
                _ => {
                    let word = self.one_of(&WORDS).to_le_bytes();
                    let aligned = at & !3;
                    let room = bytes.len().min(aligned + 4) - aligned;
                    bytes[aligned..aligned + room].copy_from_slice(&word[..room]);
                }
            }
        }
        bytes
    }

    /// The same, every other time at the beginning: most of what can be wrong stands there.
    pub fn head(&mut self, file: &[u8]) -> Vec<u8> {
        let end = file.len().min(*self.one_of(&[100, 400, usize::MAX, usize::MAX]));
        [self.bytes(&file[..end]), file[end..].to_vec()].concat()
    }

    /// Changes a number of a text to one of those that programs stumble over, or damages its bytes.
    pub fn text(&mut self, file: &[u8]) -> Vec<u8> {
        let is_part = |byte: &u8| byte.is_ascii_digit() || b"+-.eE".contains(byte);
        let numbers: Vec<&[u8]> = file
            .chunk_by(|a, b| is_part(a) && is_part(b))
            .filter(|part| part.iter().any(u8::is_ascii_digit))
            .collect();
        if numbers.is_empty() || self.below(3) == 0 {
            return self.bytes(file);
        }
        let hit = *self.one_of(&numbers);
        let start = hit.as_ptr() as usize - file.as_ptr() as usize;
        [
            &file[..start],
            stumbling_number(self).as_bytes(),
            &file[start + hit.len()..],
        ]
        .concat()
    }

    /// Changes one to three places of a JSON document, now and then its bytes. What maps are read by is a small part of
    /// it, and hit as often as the rest.
    pub fn document(&mut self, file: &[u8]) -> Vec<u8> {
        let mut document: Value = serde_json::from_slice(file).expect("it is JSON");
        match self.below(8) {
            0 | 1 => return self.bytes(file),
            2..=4 if document.get("maps").is_some() => self.json(&mut document["maps"]),
            _ => self.json(&mut document),
        }
        document.to_string().into_bytes()
    }

    /// Another value, another type, gone, doubled, or swapped.
    fn json(&mut self, document: &mut Value) {
        for _ in 0..=self.below(3) {
            let place = self.place(document);
            self.change(place);
        }
    }

    /// Any value within the document.
    fn place<'a>(&mut self, value: &'a mut Value) -> &'a mut Value {
        let count = value
            .as_array()
            .map(Vec::len)
            .or(value.as_object().map(|fields| fields.len()));
        let Some(count @ 1..) = count.filter(|_| self.below(8) > 0) else {
            return value;
        };
        let index = self.below(count);
        let below = match value {
            Value::Object(fields) => fields.values_mut().nth(index),
            value => value.get_mut(index),
        };
        self.place(below.expect("it is below their number"))
    }

    fn change(&mut self, value: &mut Value) {
        match (self.below(5), value) {
            (0, Value::Array(items)) if !items.is_empty() => {
                let index = self.below(items.len());
                items.remove(index);
            }
            (1, Value::Array(items)) if !items.is_empty() => {
                let item = self.one_of(items).clone();
                items.push(item);
            }
            (2, Value::Array(items)) if !items.is_empty() => {
                let index = self.below(items.len());
                items.swap(0, index);
            }
            (0, Value::Object(fields)) if !fields.is_empty() => {
                let index = self.below(fields.len());
                let key = fields
                    .keys()
                    .nth(index)
                    .cloned()
                    .expect("it is below their number");
                fields.remove(&key);
            }
            (_, value) => *value = self.stumbling_block(value),
        }
    }

    /// Something that programs stumble over, of the same type more often than not.
    fn stumbling_block(&mut self, instead_of: &Value) -> Value {
        let others = if let (Value::Number(number), true) = (instead_of, self.below(4) > 0) {
            let known = number.as_f64().unwrap_or(0.0);
            let less = number.as_u64().map_or(7, |n| n.wrapping_sub(1));
            let other = serde_json::from_str(stumbling_number(self)).unwrap_or(json!(f64::MAX));
            json!([known + 1.0, -known, known * 1e6, less, other])
        } else {
            json!([
                null,
                true,
                -1,
                0,
                1e308,
                u64::MAX,
                "",
                "\u{0}\n\u{202e}",
                "../../x",
                "x".repeat(5000),
                [],
                {},
                [[[[[[[[0]]]]]]]],
                [0.0, 1e38, -1.0],
            ])
        };
        self.one_of(others.as_array().expect("it is a list")).clone()
    }

    /// Damages a scene's file where it hurts: its JSON as a document, its binary part, or any of its bytes.
    pub fn scene(&mut self, file: &[u8]) -> Vec<u8> {
        let is_raw = self.below(5) == 0;
        let Some((mut document, mut binary)) = parts_of(file).filter(|_| !is_raw) else {
            return self.bytes(file);
        };
        match &mut binary {
            Some(binary) if self.below(4) == 0 => *binary = self.bytes(binary),
            _ => self.json(&mut document),
        }
        match binary {
            Some(binary) => assembled(document.to_string().into_bytes(), binary),
            None => document.to_string().into_bytes(),
        }
    }
}

impl Damage {
    /// Damages the binary part of a scene's file.
    pub fn binary(&mut self, file: &[u8]) -> Vec<u8> {
        match parts_of(file) {
            Some((document, Some(binary))) => {
                // What is longer or shorter is refused before it is looked at.
                let mut damaged = self.bytes(&binary);
                damaged.resize(binary.len(), 0);
                assembled(document.to_string().into_bytes(), damaged)
            }
            _ => self.bytes(file),
        }
    }
}

/// The document of a scene's file, and its binary part where it has one.
fn parts_of(file: &[u8]) -> Option<(Value, Option<Vec<u8>>)> {
    if !file.starts_with(b"glTF") {
        return Some((serde_json::from_slice(file).ok()?, None));
    }
    let (text, binary) = glb::parts_of(file)?;
    Some((serde_json::from_slice(text).ok()?, Some(binary.to_vec())))
}

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

/// The same in a process of its own; more have to be taken and refused than these.
#[track_caller]
pub fn attack_alone<T>(
    bounds: Bounds,
    subjects: &[Subject<'_>],
    read: impl Fn(&[u8]) -> Result<T>,
    fault: impl Fn(T) -> Option<String>,
    (taken, refused): (u32, u32),
) {
    alone(|| {
        let tally = Tally::default();
        attack(&tally, bounds, subjects, read, fault);
        tally.expect(taken, refused);
    });
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
