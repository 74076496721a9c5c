//! Writing the folder of a shard.

use std::path::{Path, PathBuf};

use super::manifest::{self, ShardManifest, ShardNumber};
use super::sums_file;
use crate::error::{Error, Result};
use crate::files::{self, OutputFolder, StagedFolder};
use crate::light_pass::share::Share;
use crate::session::ShardSums;

/// A folder that a shard may be written to.
#[derive(Debug)]
pub struct ShardFolder {
    root: OutputFolder,
    path: PathBuf,
    force: bool,
    number: ShardNumber,
}

impl ShardFolder {
    /// Opens, or makes, the folder and tries to write there. The same shard's folder is written anew; any other one that
    /// is not empty is taken only with `force`.
    ///
    /// # Errors
    /// A place that cannot be written; other files or another shard in it.
    pub fn open(path: &Path, share: Share, force: bool) -> Result<Self> {
        let folder = Self {
            root: OutputFolder::open(path)?,
            path: path.to_path_buf(),
            force,
            number: ShardNumber {
                number: share.number(),
                count: share.count(),
            },
        };
        let is_known = folder.refuse_another()?;
        if !is_known && !force && !folder.root.is_empty()? {
            return Err(Error::failure(
                path.display().to_string(),
                "the folder holds files that are not from this shard",
                "choose another folder or add --force",
            ));
        }
        Ok(folder)
    }

    /// Whether this very shard lies there; an error where another one does.
    fn refuse_another(&self) -> Result<bool> {
        match ShardManifest::known_in(&self.path) {
            Some(other) if other != self.number && !self.force => Err(Error::failure(
                self.path.display().to_string(),
                format!("the folder holds shard {} of {}", other.number, other.count),
                "give each shard a folder of its own or add --force",
            )),
            found => Ok(found.is_some()),
        }
    }

    /// Writes both files, or neither.
    ///
    /// # Errors
    /// A disk that is full, a place that cannot be written any more; another shard that was written there meanwhile.
    pub fn write(self, manifest: &ShardManifest, sums: &ShardSums) -> Result<()> {
        self.refuse_another()?;
        let json = files::to_json(manifest, &self.path.display().to_string())?;
        let mut staged = StagedFolder::new(self.root)?;
        staged.write(sums_file::FILE_NAME, &sums_file::encode(manifest, &sums.passes))?;
        staged.write(manifest::FILE_NAME, &json)?;
        staged.commit()
    }
}
