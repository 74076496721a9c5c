//! Writing files that are either whole or not there.

use std::io::{self, BufWriter, Write};
use std::path::Path;

use tempfile::{Builder, NamedTempFile};

use serde::Serialize;

use crate::error::{Error, Result};

/// Writes a file aside in the same folder, brings it to the disk and then gives it its name, so that a reader finds
/// the old file or the new one and never a part, whatever happens in between. On failure nothing is left behind.
///
/// # Errors
/// No such folder, no permission, a full disk, a folder of that name; whatever `write` returns.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    if path.is_dir() {
        return Err(Error::failure(
            path.display().to_string(),
            "is a folder, where a file is to be written",
            "choose another name or remove the folder",
        ));
    }
    write_and_rename(path, write).map_err(|error| unwritable(path, &error))
}

fn write_and_rename(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let aside = create_aside(folder)?;
    let mut writer = BufWriter::new(aside);
    write(&mut writer)?;
    let aside = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
    aside.as_file().sync_all()?;
    aside.persist(path).map_err(|failure| failure.error)?;
    Ok(())
}

/// A file of a name that is not taken, removed again unless it is renamed.
fn create_aside(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(".nephroid-").suffix(".part");
    // Temporary files are private to their owner by default; a result is as public as any new file of the user.
    #[cfg(unix)]
    let permissions = <std::fs::Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666);
    #[cfg(unix)]
    builder.permissions(permissions);
    builder.tempfile_in(folder)
}

/// Why a file cannot be written, in the user's terms.
pub(super) fn unwritable(path: &Path, error: &io::Error) -> Error {
    let (what, remedy) = match error.kind() {
        io::ErrorKind::NotFound => (
            "its folder does not exist".into(),
            "make the folder or choose another place",
        ),
        io::ErrorKind::NotADirectory => (
            "part of the path is a file, not a folder".into(),
            "choose another place",
        ),
        io::ErrorKind::PermissionDenied => (
            "may not be written".into(),
            "change the folder's permissions or choose another place",
        ),
        io::ErrorKind::ReadOnlyFilesystem => ("lies on a read-only disk".into(), "choose another place"),
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => (
            "does not fit on the disk".into(),
            "free some space or choose another place",
        ),
        io::ErrorKind::FileTooLarge => (
            "is larger than files may be there".into(),
            "raise the limit (ulimit -f) or choose another place",
        ),
        _ => (
            format!("cannot be written ({error})"),
            "choose another place or check the disk",
        ),
    };
    Error::failure(path.display().to_string(), what, remedy)
}

/// A value as JSON for people to read; `location` is named in errors.
///
/// # Errors
/// A value that JSON cannot hold.
pub fn to_json(value: &impl Serialize, location: &str) -> Result<Vec<u8>> {
    serde_json::to_vec_pretty(value)
        .map_err(|error| Error::failure(location, format!("is not valid JSON ({error})"), "report this"))
}
