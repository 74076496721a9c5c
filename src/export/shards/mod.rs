//! Shards of a bake as folders: `shard.json` identifies the bake, and `sums.bin` holds the raw sums, one checksummed
//! Zstandard frame per pass. `shard.json` has their lengths and hashes.

mod manifest;
mod set;

pub use manifest::{SceneOrigin, ShardManifest};
pub use set::{ShardFolder, ShardSet};
