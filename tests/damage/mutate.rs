//! Seeded damage to bytes, text, JSON and binary glTF.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use serde_json::{Value, json};

/// Damage by a seed: the same for the same one.
#[derive(Debug)]
pub struct Damage(Pcg64Mcg);

/// How many times as much is tried as usual.
pub fn effort() -> usize {
    let asked = std::env::var("NEPHROID_MUTATIONS").ok();
    asked.map_or(1, |times| times.parse().expect("NEPHROID_MUTATIONS is a factor"))
}

/// Numbers as text that programs stumble over.
const NUMBERS: [&str; 22] = [
    "0",
    "-0",
    "-1",
    "1",
    "2",
    "255",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "18446744073709551615",
    "18446744073709551616",
    "1e-320",
    "1e-45",
    "1e38",
    "3.5e38",
    "1e308",
    "-1e308",
    "1e999",
    "nan",
    "inf",
];

/// The same as little-endian words.
const WORDS: [u32; 12] = [
    0,
    1,
    0x7f,
    0xff,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    // NaN, infinity, the largest and the least single.
    0x7fc0_0000,
    0x7f80_0000,
    0x7f7f_ffff,
    1 << 23,
];

impl Damage {
    pub fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// Seeded by a name and a number, so that another file's damage stays as it is.
    pub fn to(name: &str, number: usize) -> Self {
        let hash = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        Self::new(name.bytes().fold(0xcbf2_9ce4_8422_2325, hash) ^ (number as u64) << 32)
    }

    /// A number below another one, > 0.
    pub fn below(&mut self, count: usize) -> usize {
        (self.0.next_u64() % count as u64) as usize
    }

    pub fn one_of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        let index = self.below(all.len());
        &all[index]
    }

    /// Changes one to four places.
    pub fn bytes(&mut self, bytes: &mut Vec<u8>) {
        for _ in 0..=self.below(4) {
            if bytes.is_empty() {
                return;
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
    }

    /// Changes a number of a text to one of those that programs stumble over, or damages its bytes.
    pub fn text(&mut self, text: &str) -> Vec<u8> {
        let numbers: Vec<(usize, usize)> = numbers_in(text);
        if numbers.is_empty() || self.below(3) == 0 {
            let mut bytes = text.as_bytes().to_vec();
            self.bytes(&mut bytes);
            return bytes;
        }
        let (start, end) = *self.one_of(&numbers);
        let number = *self.one_of(&NUMBERS);
        [&text[..start], number, &text[end..]].concat().into_bytes()
    }

    /// Changes one to three places of a document: another value, another type, gone, doubled, or swapped.
    pub fn json(&mut self, document: &mut Value) {
        for _ in 0..=self.below(3) {
            let place = self.place(document);
            self.change(place);
        }
    }

    /// Any value within the document.
    fn place<'a>(&mut self, value: &'a mut Value) -> &'a mut Value {
        let count = match value {
            Value::Array(items) => items.len(),
            Value::Object(fields) => fields.len(),
            _ => 0,
        };
        if count == 0 || self.below(8) == 0 {
            return value;
        }
        let index = self.below(count);
        let below = match value {
            Value::Array(items) => items.get_mut(index),
            Value::Object(fields) => fields.values_mut().nth(index),
            _ => None,
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
                    .expect("it is below their number")
                    .clone();
                fields.remove(&key);
            }
            (_, value) => *value = self.stumbling_block(value),
        }
    }

    /// Something that programs stumble over, of the same type more often than not.
    fn stumbling_block(&mut self, instead_of: &Value) -> Value {
        if let (Value::Number(number), true) = (instead_of, self.below(4) > 0) {
            let known = number.as_f64().unwrap_or(0.0);
            let text = *self.one_of(&NUMBERS);
            let numbers = [
                json!(known + 1.0),
                json!(-known),
                json!(known * 1e6),
                json!(number.as_u64().map_or(7, |n| n.wrapping_sub(1))),
                serde_json::from_str(text).unwrap_or(json!(f64::MAX)),
            ];
            return self.one_of(&numbers).clone();
        }
        let others = [
            Value::Null,
            json!(true),
            json!(-1),
            json!(0),
            json!(1e308),
            json!(u64::MAX),
            json!(""),
            json!("\u{0}\n\u{202e}"),
            json!("../../x"),
            json!("x".repeat(5000)),
            json!([]),
            json!({}),
            json!([[[[[[[[0]]]]]]]]),
            json!([0.0, 1e38, -1.0]),
        ];
        self.one_of(&others).clone()
    }

    /// Damages a scene's file where it hurts: its JSON as a document, its binary part, or any of its bytes.
    pub fn scene(&mut self, file: &[u8]) -> Vec<u8> {
        let is_raw = self.below(5) == 0;
        let parts = parts_of(file).filter(|_| !is_raw);
        let Some((mut document, mut binary)) = parts else {
            let mut bytes = file.to_vec();
            self.bytes(&mut bytes);
            return bytes;
        };
        match &mut binary {
            Some(binary) if self.below(4) == 0 => self.bytes(binary),
            _ => self.json(&mut document),
        }
        match binary {
            Some(binary) => assembled(&document, &binary),
            None => document.to_string().into_bytes(),
        }
    }
}

/// Where numbers stand in a text, as ranges of bytes.
fn numbers_in(text: &str) -> Vec<(usize, usize)> {
    let is_part = |byte: u8| byte.is_ascii_digit() || b"+-.eE".contains(&byte);
    let bytes = text.as_bytes();
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let start = at;
        while at < bytes.len() && is_part(bytes[at]) {
            at += 1;
        }
        if bytes[start..at].iter().any(u8::is_ascii_digit) {
            found.push((start, at));
        }
        at = at.max(start + 1);
    }
    found
}

/// The document of a scene's file, and its binary part where it has one.
fn parts_of(file: &[u8]) -> Option<(Value, Option<Vec<u8>>)> {
    if !file.starts_with(b"glTF") {
        return Some((serde_json::from_slice(file).ok()?, None));
    }
    let word = |at: usize| Some(u32::from_le_bytes(file.get(at..at + 4)?.try_into().ok()?) as usize);
    let json_end = 20 + word(12)?;
    let document = serde_json::from_slice(file.get(20..json_end)?).ok()?;
    let binary = file.get(json_end + 8..).unwrap_or_default().to_vec();
    Some((document, Some(binary)))
}

/// A binary file with lengths that fit, so that what is within is looked at.
fn assembled(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + text.len() as u32 + binary.len() as u32).to_le_bytes());
    for (kind, part) in [(b"JSON", &text), (b"BIN\0", &binary)] {
        bytes.extend((part.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(part);
    }
    bytes
}

#[test]
fn damage_is_done_and_the_same_every_time() {
    let _alone = crate::watch::alone();
    let whole = crate::glb::Glb::tetrahedron().bytes();
    let damaged = |number| Damage::to("a.glb", number).scene(&whole);
    let different = (0..100).filter(|&number| damaged(number) != whole).count();
    assert!(different >= 95, "{different} of 100 are damaged");
    assert!((0..100).all(|number| damaged(number) == damaged(number)));
    let kinds: std::collections::HashSet<Vec<u8>> = (0..100).map(damaged).collect();
    assert!(kinds.len() >= 90, "{} kinds of damage", kinds.len());
    // Whole but for its values: what is in it can be read.
    let readable = (0..100)
        .filter(|&number| parts_of(&damaged(number)).is_some())
        .count();
    assert!((50..100).contains(&readable), "{readable} of 100 are documents");
}
