//! Reading parts of files that are too large to be read at once.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use super::read::unreadable;
use crate::error::{Error, Result};

/// Length of a file [bytes].
///
/// # Errors
/// No such file; a folder, device or pipe of that name.
pub fn file_bytes(path: &Path) -> Result<u64> {
    // Asked before opening, since opening a pipe waits for its other end.
    let metadata = std::fs::metadata(path).map_err(|error| unreadable(path, &error))?;
    if !metadata.is_file() {
        return Err(Error::failure(
            path.display().to_string(),
            "is not a regular file",
            "name a file",
        ));
    }
    Ok(metadata.len())
}

/// Bytes of a file from a place on. No memory is taken for more than the file holds.
///
/// # Errors
/// As [`file_bytes`]; a file that ends before; one that cannot be read.
pub fn read_part(path: &Path, from: u64, bytes: u64) -> Result<Vec<u8>> {
    let length = file_bytes(path)?;
    if from.checked_add(bytes).is_none_or(|end| end > length) {
        return Err(Error::failure(
            path.display().to_string(),
            "ends before it should",
            "make it again",
        ));
    }
    let read = || {
        let mut file = File::open(path)?;
        file.seek(SeekFrom::Start(from))?;
        let mut part = Vec::new();
        file.take(bytes).read_to_end(&mut part)?;
        Ok(part)
    };
    read().map_err(|error| unreadable(path, &error))
}
