//! Frames of a film as pictures in a folder.

use std::path::{Path, PathBuf};

use super::picture::encode;
use crate::error::{Error, Result};
use crate::files::{self, OutputFolder};

/// A folder that holds only frames, `frame-00001.png` and on.
#[derive(Debug)]
pub struct FrameFolder(OutputFolder);

impl FrameFolder {
    /// Opens the folder, or creates it.
    ///
    /// # Errors
    /// A folder that cannot be created or read; one that holds files but no first frame of an earlier film, which would
    /// be replaced.
    pub fn open(path: &Path) -> Result<Self> {
        let folder = OutputFolder::open(path)?;
        if path.join(file_name(0)).is_file() || folder.is_empty()? {
            return Ok(Self(folder));
        }
        Err(Error::failure(
            path.display().to_string(),
            "the folder holds files that are not frames of a path",
            "choose another folder",
        ))
    }

    /// Path of a frame, counted from 0.
    pub fn file(&self, frame: usize) -> PathBuf {
        self.0.path().join(file_name(frame))
    }

    /// Writes a frame, counted from 0: encoded RGBA, row 0 at the top.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, frame: usize, (width, height): (u32, u32), rgba: Vec<u8>) -> Result<()> {
        let file = self.file(frame);
        let bytes = encode(width, height, rgba, &file.display().to_string())?;
        files::write_atomically(&file, |writer| writer.write_all(&bytes))
    }
}

/// Files are numbered from 1.
fn file_name(frame: usize) -> String {
    format!("frame-{:05}.png", frame + 1)
}
