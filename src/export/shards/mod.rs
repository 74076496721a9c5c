//! Shards of a bake as folders: `shard.json`, which says what it is a shard of, and `sums.bin`, which holds its raw sums:
//! those of one pass after the other, each a Zstandard frame with a checksum. Their lengths and hashes stand in `shard.json`.

mod manifest;
mod set;

pub use manifest::{SceneOrigin, ShardManifest};
pub use set::{ShardFolder, ShardSet};
