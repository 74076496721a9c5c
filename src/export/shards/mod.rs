//! Shards of a bake as folders: `shard.json`, which says what it is a shard of, and `sums.bin`, which holds its raw sums.
//!
//! `sums.bin`, numbers with their least byte first: the eight bytes `NEPHSUMS`; version, number of the shard, number of
//! shards and number of passes (32 bits each); the fingerprint of the bake (64 bits); the length of each pass's sums
//! [bytes] (64 bits each); a hash of all that (64 bits); then the sums of one pass after the other, each a Zstandard frame
//! with a checksum.

mod manifest;
mod set;
mod sums_file;

pub use manifest::{SceneOrigin, ShardManifest};
pub use set::ShardFolder;
pub use set::ShardSet;
