//! `sums.bin`: see the format at the module above.

use std::path::Path;

use super::manifest::{SCHEMA, ShardManifest};
use crate::error::{Error, Result};
use crate::files;
use crate::files::cache::ContentHash;

/// Name of the file in its folder.
pub(super) const FILE_NAME: &str = "sums.bin";

const MAGIC: [u8; 8] = *b"NEPHSUMS";

/// Bytes before the lengths.
const FIXED_BYTES: u64 = 32;

/// Of the hash.
const HASH_BYTES: u64 = 8;

/// Where the sums of each pass lie.
#[derive(Clone, Debug)]
pub(super) struct SumsIndex {
    /// First byte and length.
    passes: Vec<(u64, u64)>,
}

/// The file's bytes.
pub(super) fn encode(manifest: &ShardManifest, passes: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = fixed(manifest, passes.len() as u32);
    for pass in passes {
        bytes.extend((pass.len() as u64).to_le_bytes());
    }
    bytes.extend(hash(&bytes).to_le_bytes());
    passes.iter().for_each(|pass| bytes.extend(pass));
    bytes
}

/// All before the lengths.
fn fixed(manifest: &ShardManifest, pass_count: u32) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    for word in [SCHEMA, manifest.shard.number, manifest.shard.count, pass_count] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(manifest.fingerprint().to_le_bytes());
    bytes
}

fn hash(bytes: &[u8]) -> u64 {
    let mut hash = ContentHash::default();
    bytes.iter().for_each(|&byte| hash.take(u64::from(byte)));
    hash.value()
}

impl SumsIndex {
    /// Reads and checks what the file begins with; nothing is taken on trust of its lengths.
    ///
    /// # Errors
    /// A file that is torn or not that of the manifest.
    pub(super) fn read(path: &Path, manifest: &ShardManifest) -> Result<Self> {
        let refused = |what: &str| Error::failure(path.display().to_string(), what, "bake this shard again");
        let length = files::file_bytes(path)?;
        if length < FIXED_BYTES + HASH_BYTES {
            return Err(refused("ends before it should"));
        }
        let start = files::read_part(path, 0, FIXED_BYTES)?;
        let word = |from: usize| {
            let bytes = start.get(from..from + 4).and_then(|bytes| bytes.try_into().ok());
            bytes.map_or(0, u32::from_le_bytes)
        };
        if !start.starts_with(&MAGIC) {
            return Err(refused("holds no sums of a shard"));
        }
        if start != fixed(manifest, word(20)) {
            return Err(refused("is not the file that the shard.json beside it speaks of"));
        }
        let head_bytes = FIXED_BYTES + 8 * u64::from(word(20)) + HASH_BYTES;
        if head_bytes > length {
            return Err(refused("ends before it should"));
        }
        let head = files::read_part(path, 0, head_bytes)?;
        let (hashed, stored) = head.split_at(head.len() - HASH_BYTES as usize);
        if stored != hash(hashed).to_le_bytes() {
            return Err(refused("is damaged where it begins"));
        }
        let mut passes = Vec::new();
        let mut from = head_bytes;
        for bytes in hashed[FIXED_BYTES as usize..].chunks_exact(8) {
            let bytes = bytes.try_into().map_or(0, u64::from_le_bytes);
            passes.push((from, bytes));
            from = from.saturating_add(bytes);
        }
        match from.cmp(&length) {
            std::cmp::Ordering::Greater => Err(refused("ends before it should")),
            std::cmp::Ordering::Less => Err(refused("is longer than it should be")),
            std::cmp::Ordering::Equal => Ok(Self { passes }),
        }
    }

    pub(super) fn pass_count(&self) -> usize {
        self.passes.len()
    }

    /// The sums of a pass.
    ///
    /// # Errors
    /// A file that has changed since, or cannot be read.
    pub(super) fn pass(&self, path: &Path, pass: usize) -> Result<Vec<u8>> {
        let (from, bytes) = self.passes[pass];
        files::read_part(path, from, bytes)
    }
}
