//! The folder of an export: textures beside their index, replaced together.

use std::path::Path;

use serde::Deserialize;

use super::index::{self, TextureEntry, TextureIndex};
use crate::error::{Error, Result};
use crate::files::{self, OutputFolder, StagedFolder};

/// Largest index that is read [bytes].
const MAX_INDEX_BYTES: u64 = 64 << 20;

/// A folder that textures may be written to.
#[derive(Debug)]
pub struct TextureFolder {
    staged: StagedFolder,
    /// Files of the export that is replaced.
    previous: Vec<String>,
}

impl TextureFolder {
    /// Opens, or makes, the folder and tries to write there. One of ours is replaced; another one that is not empty is
    /// taken only with `force`.
    ///
    /// # Errors
    /// A place that cannot be written; other people's files in it.
    pub fn open(path: &Path, force: bool) -> Result<Self> {
        let root = OutputFolder::open(path)?;
        let previous = files_of_ours(path);
        if previous.is_none() && !force && !root.is_empty()? {
            return Err(Error::failure(
                path.display().to_string(),
                "the folder holds files that are not from an export of textures",
                "choose another folder or add --force",
            ));
        }
        Ok(Self {
            staged: StagedFolder::new(root)?,
            previous: previous.unwrap_or_default(),
        })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.staged.path()
    }

    /// Writes a file aside.
    ///
    /// # Errors
    /// As [`StagedFolder::write`].
    pub(super) fn write(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        self.staged.write(name, bytes)
    }

    /// Gives all files their places and removes what the previous export had more.
    ///
    /// # Errors
    /// As [`StagedFolder::commit`]; outdated files that cannot be removed.
    pub(super) fn commit(self, index: &TextureIndex) -> Result<()> {
        let path = self.path().to_path_buf();
        self.staged.commit()?;
        for outdated in &self.previous {
            if !index.files().any(|file| file == outdated) {
                files::remove_file(&path.join(outdated))?;
            }
        }
        Ok(())
    }
}

/// The parts of an index that tell what belongs to it.
#[derive(Deserialize)]
struct Known {
    kind: String,
    textures: Vec<TextureEntry>,
}

/// Files of the export that lies in a folder; `None` where none of ours does.
fn files_of_ours(path: &Path) -> Option<Vec<String>> {
    let bytes = files::read_file(&path.join(index::FILE_NAME), MAX_INDEX_BYTES).ok()?;
    let known: Known = serde_json::from_slice(&bytes).ok()?;
    if known.kind != index::KIND {
        return None;
    }
    let of_texture = |texture: TextureEntry| {
        let uvs = texture.maps.into_iter().filter_map(|map| map.uv_file);
        std::iter::once(texture.file).chain(uvs)
    };
    let files = known.textures.into_iter().flat_map(of_texture);
    Some(files.filter(|file| is_texture_file(file)).collect())
}

/// Whether a name in an index is one that an export writes, with nothing that leads elsewhere.
fn is_texture_file(name: &str) -> bool {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"_-.".contains(&byte);
    let ends = [".exr", ".png", ".hdr", ".ktx2", ".uv"];
    !name.starts_with('.') && name.bytes().all(is_plain) && ends.iter().any(|end| name.ends_with(end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_lead_elsewhere_are_none_of_ours() {
        for name in [
            "0001_floor.exr",
            "0001_floor_lamp-2.ktx2",
            "atlas-1.png",
            "0001_floor.uv",
        ] {
            assert!(is_texture_file(name), "{name}");
        }
        for name in [
            "",
            ".exr",
            "../a.exr",
            "a/b.exr",
            "a\\b.exr",
            "/a.exr",
            "a.txt",
            ".hidden.png",
        ] {
            assert!(!is_texture_file(name), "{name}");
        }
    }
}
