//! `shard.json`: identifies a shard and its bake, and describes the sums beside it.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::bake::{ShardSums, Timings};
use crate::error::{Error, Result};
use crate::files;
use crate::files::cache::ContentHash;
use crate::light_pass::shard_index::ShardIndex;
use crate::scene::Scene;
use crate::settings::BakeSettings;

/// Version of the format of both files.
const SCHEMA: u32 = 4;

/// Name of the file in its folder.
pub(super) const FILE_NAME: &str = "shard.json";

/// Maximum size of the file [bytes].
const MAX_BYTES: u64 = 64 << 20;

/// The scene as the user named it, and how it was loaded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneOrigin {
    /// Path as the user gave it, or `builtin:NAME`.
    pub source: String,
    /// Whether a scene without light gets a sun.
    pub default_light: bool,
    /// Whether closed transmissive meshes without a volume count as solid glass.
    pub solid_glass: bool,
    /// Environment image.
    pub environment: Option<PathBuf>,
}

/// Number of a shard among all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShardNumber {
    /// Counted from 1.
    pub number: u32,
    /// Number of shards.
    pub count: u32,
}

/// The sums of one pass in `sums.bin`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredPass {
    /// Length [bytes].
    pub bytes: u64,
    /// Hash of these bytes.
    pub hash: String,
}

impl StoredPass {
    /// Length and hash of some sums.
    pub(super) fn of(sums: &[u8]) -> Self {
        let mut hash = ContentHash::default();
        sums.iter().for_each(|&byte| hash.take(u64::from(byte)));
        Self {
            bytes: sums.len() as u64,
            hash: format!("{:016x}", hash.value()),
        }
    }
}

/// Everything in `shard.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShardManifest {
    /// Version of the format.
    pub shard_schema: u32,
    /// Version of the program that wrote it.
    pub program_version: String,
    /// Which shard it is.
    pub shard: ShardNumber,
    /// Settings of the whole bake.
    pub settings: BakeSettings,
    /// Scene of the bake.
    pub scene: SceneOrigin,
    /// Hash of everything in the scene that light depends on.
    pub scene_hash: String,
    /// In the order of the bake.
    pub passes: Vec<StoredPass>,
    /// Wall-clock seconds.
    pub timings_s: Timings,
    /// CPU seconds of the process.
    pub cpu_s: Timings,
}

impl ShardManifest {
    /// Manifest of a shard of a bake.
    pub fn new(
        scene: &Scene,
        origin: SceneOrigin,
        settings: &BakeSettings,
        share: ShardIndex,
        sums: &ShardSums,
    ) -> Self {
        Self {
            shard_schema: SCHEMA,
            program_version: env!("CARGO_PKG_VERSION").into(),
            shard: ShardNumber {
                number: share.number(),
                count: share.count(),
            },
            settings: settings.clone(),
            scene: origin,
            scene_hash: hash_of(scene),
            passes: sums.passes.iter().map(|pass| StoredPass::of(pass)).collect(),
            timings_s: sums.timings_s,
            cpu_s: sums.cpu_s,
        }
    }

    /// Reads the manifest in a folder.
    ///
    /// # Errors
    /// No such file; one of another kind or version.
    pub(super) fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(FILE_NAME);
        if folder.is_dir() && !path.exists() {
            return Err(Error::failure(
                folder.display().to_string(),
                "the folder holds no shard",
                "name folders that `nephroid bake --shard` wrote",
            ));
        }
        let bytes = files::read_file(&path, MAX_BYTES)?;
        let refused =
            |what: String| Error::failure(path.display().to_string(), what, "bake this shard again");
        let document: serde_json::Value =
            serde_json::from_slice(&bytes).map_err(|error| refused(format!("is damaged ({error})")))?;
        match document.get("shard_schema").and_then(serde_json::Value::as_u64) {
            Some(schema) if schema == u64::from(SCHEMA) => {}
            Some(schema) => {
                return Err(refused(format!(
                    "is of format {schema}, and this program reads format {SCHEMA}"
                )));
            }
            None => return Err(refused("is not a shard's manifest".into())),
        }
        serde_json::from_value(document).map_err(|error| refused(format!("is damaged ({error})")))
    }

    /// How this shard's bake differs from another one's; `None` if both are of the same bake.
    pub(super) fn difference(&self, other: &Self) -> Option<String> {
        let differs = |what: &str, own: &str, others: &str| Some(format!("{what} {own} and not {others}"));
        if self.program_version != other.program_version {
            return differs(
                "it was baked by version",
                &self.program_version,
                &other.program_version,
            );
        }
        if self.shard.count != other.shard.count {
            let [own, others] = [self, other].map(|shard| shard.shard.count.to_string());
            return differs("it is a part of", &format!("{own} shards"), &others);
        }
        if self.scene_hash != other.scene_hash {
            return Some("it is of another scene".into());
        }
        let [own, others] = [self, other].map(|shard| common_settings(&shard.settings));
        let fields = own.as_object()?;
        fields.iter().find_map(|(name, own)| {
            let others = &others[name];
            let name = name.replace('_', " ");
            (own != others).then(|| format!("its {name} is {own} and not {others}"))
        })
    }
}

/// Hash of a scene as text.
pub(super) fn hash_of(scene: &Scene) -> String {
    format!("{:016x}", scene.content_hash())
}

/// The settings that all shards have to share.
fn common_settings(settings: &BakeSettings) -> serde_json::Value {
    let common = BakeSettings {
        threads: 0,
        ..settings.clone()
    };
    // Cannot fail: settings are numbers, names and lists.
    serde_json::to_value(common).unwrap_or_default()
}
