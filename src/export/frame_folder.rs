//! Frames of a camera's way as pictures in a folder.

use std::path::{Path, PathBuf};

use super::picture::encode;
use crate::error::{Error, Result};
use crate::files::{self, OutputFolder};

/// A folder that holds nothing but frames, `frame-00001.png` and on.
#[derive(Debug)]
pub struct FrameFolder(OutputFolder);

impl FrameFolder {
    /// Makes the folder where there is none.
    ///
    /// # Errors
    /// It cannot be made or read; it holds files and no first frame of an earlier time, which would be replaced.
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

    /// Where a frame, counted from 0 on, is written.
    pub fn file(&self, frame: usize) -> PathBuf {
        self.0.path().join(file_name(frame))
    }

    /// Writes a frame, counted from 0 on: encoded RGBA, row 0 at the top.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, frame: usize, (width, height): (u32, u32), rgba: Vec<u8>) -> Result<()> {
        let file = self.file(frame);
        let bytes = encode(width, height, rgba, &file.display().to_string())?;
        files::write_atomically(&file, |writer| writer.write_all(&bytes))
    }
}

/// From 1 on, as people count.
fn file_name(frame: usize) -> String {
    format!("frame-{:05}.png", frame + 1)
}
