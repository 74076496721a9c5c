//! Reads all shards of a bake. Nothing in them is trusted: they may be torn, of different bakes, or incomplete.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};

use super::manifest::{self, ShardManifest, ShardNumber, StoredPass, hash_of};
use crate::bake::{ShardSource, ShardSums, Timings};
use crate::error::{Error, Result};
use crate::files::{self, OutputFolder, StagedFolder};
use crate::light_pass::shard_index::ShardIndex;
use crate::scene::Scene;

/// Maximum number of missing shards that are named one by one.
const MAX_NAMED: usize = 8;

/// The folders of all shards of one bake.
#[derive(Debug)]
pub struct ShardSet {
    shards: Vec<Shard>,
}

/// Name of the file of sums in its folder.
const SUMS: &str = "sums.bin";

#[derive(Debug)]
struct Shard {
    folder: PathBuf,
    manifest: ShardManifest,
}

impl Shard {
    /// Opens a shard whose file is as long as its manifest states.
    fn open(folder: &Path) -> Result<Self> {
        let manifest = ShardManifest::read(folder)?;
        let path = folder.join(SUMS);
        let passes = manifest.passes.iter();
        let stated = passes.fold(0_u64, |sum, pass| sum.saturating_add(pass.bytes));
        let what = match stated.cmp(&files::file_bytes(&path)?) {
            Ordering::Equal => {
                return Ok(Self {
                    folder: folder.to_path_buf(),
                    manifest,
                });
            }
            Ordering::Greater => "ends before it should",
            Ordering::Less => "is longer than it should be",
        };
        Err(Error::failure(
            path.display().to_string(),
            what,
            "bake this shard again",
        ))
    }

    fn name(&self) -> String {
        self.folder.display().to_string()
    }
}

impl ShardSet {
    /// Reads the manifests of the shards, and checks that they are all the shards of one bake.
    ///
    /// # Errors
    /// A folder without a shard; a damaged shard; shards of different bakes or program versions, given twice, or
    /// missing.
    pub fn open(folders: &[PathBuf]) -> Result<Self> {
        // Each shard is checked by itself first: its manifest, and the length of its sums.
        let shards: Vec<Shard> = folders
            .iter()
            .map(|folder| Shard::open(folder))
            .collect::<Result<_>>()?;
        if shards.is_empty() {
            return Err(Error::usage(
                "merge",
                "no shard is named",
                "name the folders of all shards of a bake",
            ));
        }

        // The sums of another version may mean something else: only the version that baked them may merge.
        let set = Self { shards };
        let first = set.first();
        if first.manifest.program_version != env!("CARGO_PKG_VERSION") {
            return Err(Error::failure(
                first.name(),
                format!(
                    "it was baked by version {} and this program is version {}",
                    first.manifest.program_version,
                    env!("CARGO_PKG_VERSION")
                ),
                "merge with the version that baked",
            ));
        }

        // Sums add up only within one bake. The first shard stands for all others.
        for shard in &set.shards {
            if let Some(difference) = shard.manifest.difference(&first.manifest) {
                return Err(Error::failure(
                    shard.name(),
                    format!("{difference} as that of {}", first.name()),
                    "name the shards of one bake",
                ));
            }
        }
        set.refuse_gaps()?;
        Ok(set)
    }

    /// The first shard; there is at least one.
    fn first(&self) -> &Shard {
        &self.shards[0]
    }

    fn refuse_gaps(&self) -> Result<()> {
        // Sorted by number, a shard that is named twice stands beside itself.
        let first = self.first();
        let mut by_number: Vec<&Shard> = self.shards.iter().collect();
        by_number.sort_by_key(|shard| shard.manifest.shard.number);
        let number = |shard: &Shard| shard.manifest.shard.number;
        if let Some([one, other]) = by_number.array_windows().find(|[a, b]| number(a) == number(b)) {
            return Err(Error::failure(
                other.name(),
                format!("it is shard {}, and so is {}", number(other), one.name()),
                "name each shard once",
            ));
        }

        let count = first.manifest.shard.count;
        if let Some(beyond) = by_number.last().filter(|shard| number(shard) > count) {
            return Err(Error::failure(
                beyond.name(),
                format!("it says that it is shard {} of {count}", number(beyond)),
                "bake it again",
            ));
        }

        // Without one shard, every map would lack a part of its light.
        let mut present = by_number.iter().map(|shard| number(shard)).peekable();
        let is_missing = |wanted: &u32| present.next_if_eq(wanted).is_none();
        // One more than is named tells that there are more.
        let missing: Vec<u32> = (1..=count).filter(is_missing).take(MAX_NAMED + 1).collect();
        if missing.is_empty() {
            return Ok(());
        }

        let named: Vec<String> = missing.iter().take(MAX_NAMED).map(u32::to_string).collect();
        let more = if missing.len() > MAX_NAMED {
            " and more"
        } else {
            ""
        };
        Err(Error::failure(
            first.name(),
            format!(
                "these of the {count} shards of its bake are missing: {}{more}",
                named.join(", ")
            ),
            "bake them and name their folders too",
        ))
    }

    /// What the shards have in common: the manifest of the first.
    pub fn manifest(&self) -> &ShardManifest {
        &self.first().manifest
    }

    /// Refuses a scene other than that of the shards.
    ///
    /// # Errors
    /// Another scene.
    pub fn check_scene(&self, scene: &Scene) -> Result<()> {
        let first = self.first();
        if first.manifest.scene_hash == hash_of(scene) {
            return Ok(());
        }
        Err(Error::failure(
            &scene.source,
            format!("it is not the scene that {} is a shard of", first.name()),
            "name that one with --scene, or bake all shards of this one",
        ))
    }

    /// Wall-clock seconds of the slowest shard, and CPU seconds of all.
    pub fn seconds(&self) -> (f64, f64) {
        let total = |pick: fn(&ShardManifest) -> &Timings| {
            let shards = self.shards.iter();
            shards.map(move |shard| pick(&shard.manifest).total)
        };
        let wall_s = total(|manifest| &manifest.timings_s).fold(0.0, f64::max);
        (wall_s, total(|manifest| &manifest.cpu_s).sum())
    }
}

impl ShardSource for ShardSet {
    fn shard_count(&self) -> usize {
        self.shards.len()
    }

    fn pass_count(&self, shard: usize) -> usize {
        self.shards[shard].manifest.passes.len()
    }

    fn pass(&self, shard: usize, pass: usize) -> Result<Vec<u8>> {
        let shard = &self.shards[shard];
        let passes = &shard.manifest.passes;
        let from = passes[..pass].iter().map(|pass| pass.bytes).sum();
        let sums = files::read_part(&shard.folder.join(SUMS), from, passes[pass].bytes)?;
        if StoredPass::of(&sums) == passes[pass] {
            return Ok(sums);
        }
        Err(Error::failure(
            shard.name(),
            "its sums are damaged, or do not match its shard.json",
            "bake this shard again",
        ))
    }

    fn name(&self, shard: usize) -> String {
        self.shards[shard].name()
    }
}

/// An output folder for a shard.
#[derive(Debug)]
pub struct ShardFolder {
    root: OutputFolder,
    force: bool,
    number: ShardNumber,
}

impl ShardFolder {
    /// Opens or creates the folder, and checks that it can be written. The same shard is replaced; a folder with other
    /// files is taken only with `force`.
    ///
    /// # Errors
    /// A place that cannot be written; other files or another shard in it.
    pub fn open(path: &Path, share: ShardIndex, force: bool) -> Result<Self> {
        let number = ShardNumber {
            number: share.number(),
            count: share.count(),
        };
        let is_ours = holds(path, number, force)?;
        let root = OutputFolder::open_own(path, is_ours, force, "this shard")?;
        Ok(Self { root, force, number })
    }

    /// Writes both files or neither.
    ///
    /// # Errors
    /// A full disk; a place that can no longer be written; another shard that was written there in the meantime.
    pub fn write(self, manifest: &ShardManifest, sums: &ShardSums) -> Result<()> {
        holds(self.root.path(), self.number, self.force)?;
        let json = files::to_json(manifest, &self.root.path().display().to_string())?;
        let mut staged = StagedFolder::new(self.root)?;
        staged.write(SUMS, &sums.passes.concat())?;
        staged.write(manifest::FILE_NAME, &json)?;
        staged.commit()
    }
}

/// Whether the folder holds this shard; an error if it holds another one, unless `force` is set.
fn holds(path: &Path, number: ShardNumber, force: bool) -> Result<bool> {
    match ShardManifest::read(path).map(|found| found.shard) {
        Ok(other) if other != number && !force => Err(Error::failure(
            path.display().to_string(),
            format!("the folder holds shard {} of {}", other.number, other.count),
            "give each shard a folder of its own or add --force",
        )),
        found => Ok(found.is_ok()),
    }
}
