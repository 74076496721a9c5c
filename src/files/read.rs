//! Reading whole files of limited size.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::error::{Error, Result};

/// The whole of a file of at most `max_bytes`. Only as much memory is taken as the file really holds.
///
/// # Errors
/// No such file; a folder, device or pipe of that name; a larger file; a file that cannot be read.
pub fn read_file(path: &Path, max_bytes: u64) -> Result<Vec<u8>> {
    // Asked before opening, since opening a pipe waits for its other end.
    let metadata = std::fs::metadata(path).map_err(|error| unreadable(path, &error))?;
    if !metadata.is_file() {
        let what = if metadata.is_dir() {
            "is a folder"
        } else {
            "is not a regular file"
        };
        return Err(Error::failure(path.display().to_string(), what, "name a file"));
    }
    let file = File::open(path).map_err(|error| unreadable(path, &error))?;
    let mut bytes = Vec::new();
    // One byte more than allowed tells a file that is too large, even where its stated size is wrong.
    file.take(max_bytes.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(|error| unreadable(path, &error))?;
    if bytes.len() as u64 > max_bytes {
        return Err(Error::failure(
            path.display().to_string(),
            format!(
                "is larger than {} MB, the most that is read of such a file",
                max_bytes / 1_000_000
            ),
            "use a smaller file",
        ));
    }
    Ok(bytes)
}

/// Why a file cannot be read, in the user's terms.
pub(super) fn unreadable(path: &Path, error: &io::Error) -> Error {
    let (what, remedy) = match error.kind() {
        io::ErrorKind::NotFound => ("there is no such file".into(), "check the path"),
        io::ErrorKind::NotADirectory => (
            "part of the path is a file, not a folder".into(),
            "check the path",
        ),
        io::ErrorKind::PermissionDenied => ("may not be read".into(), "change its permissions"),
        io::ErrorKind::OutOfMemory => ("does not fit into memory".into(), "use a smaller file"),
        _ => (format!("cannot be read ({error})"), "check the path and the disk"),
    };
    Error::failure(path.display().to_string(), what, remedy)
}
