//! Reading and writing files: reads are bounded, writes are atomic. No other module opens files, except for the event
//! log of the window, which grows line by line.

use std::fs::File;
use std::io::{self, BufWriter, Cursor, Read, Seek, SeekFrom, Write};
use std::path::Path;

use image::{EncodableLayout, ImageBuffer, ImageFormat, PixelWithColorType};
use serde::Serialize;
use tempfile::{Builder, NamedTempFile};

use crate::error::{Error, Result};

pub mod cache;
mod folder;

pub use folder::StagedFolder;
pub use folder::{OutputFolder, check_output_file, remove_file, remove_outdated};

/// Length of a file [bytes].
///
/// # Errors
/// No such file; a folder, device or pipe of that name.
pub fn file_bytes(path: &Path) -> Result<u64> {
    // Checked before opening, since opening a pipe waits for its other end.
    let metadata = std::fs::metadata(path).map_err(|error| unreadable(path, &error))?;
    if !metadata.is_file() {
        let what = if metadata.is_dir() {
            "is a folder"
        } else {
            "is not a regular file"
        };
        return Err(Error::failure(path.display().to_string(), what, "name a file"));
    }
    Ok(metadata.len())
}

/// Reads a part of a file, starting at `from`. Allocates no more than the file holds.
///
/// # Errors
/// Those of [`file_bytes`]; a file that is too short; a file that cannot be read.
pub fn read_part(path: &Path, from: u64, bytes: u64) -> Result<Vec<u8>> {
    let length = file_bytes(path)?;
    if from.checked_add(bytes).is_none_or(|end| end > length) {
        return Err(Error::failure(
            path.display().to_string(),
            "ends too early",
            "write it again",
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

/// Reads a whole file of at most `max_bytes`. Allocates no more than the file holds.
///
/// # Errors
/// No such file; a folder, device or pipe of that name; a larger file; a file that cannot be read.
pub fn read_file(path: &Path, max_bytes: u64) -> Result<Vec<u8>> {
    file_bytes(path)?;
    let file = File::open(path).map_err(|error| unreadable(path, &error))?;
    let mut bytes = Vec::new();
    // Reading one byte more than allowed detects a file that is too large, even if its stated size is wrong.
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

/// Says why a file cannot be read, in the user's terms.
fn unreadable(path: &Path, error: &io::Error) -> Error {
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

/// Writes a temporary file in the same folder, flushes it to disk and renames it, so that readers find the old file or
/// the new one, but never a partial one. On failure nothing is left behind.
///
/// # Errors
/// No such folder, no permission, a full disk, a folder of that name; errors of `write`.
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

/// A temporary file with an unused name, removed unless it is renamed.
fn create_aside(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(".nephroid-").suffix(".part");
    // Temporary files are private to their owner by default; a result has the permissions of any new file.
    #[cfg(unix)]
    let permissions = <std::fs::Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666);
    #[cfg(unix)]
    builder.permissions(permissions);
    builder.tempfile_in(folder)
}

/// Says why a file cannot be written, in the user's terms.
fn unwritable(path: &Path, error: &io::Error) -> Error {
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

/// Serialises a value as readable JSON; `location` is named in errors.
///
/// # Errors
/// A value that JSON cannot represent.
pub fn to_json(value: &impl Serialize, location: &str) -> Result<Vec<u8>> {
    serde_json::to_vec_pretty(value)
        .map_err(|error| Error::failure(location, format!("is not valid JSON ({error})"), "report this"))
}

/// Maximum number of characters of a slug.
const MAX_SLUG: usize = 40;

/// Makes a name fit for file names: lower-case ASCII letters, digits and hyphens; `otherwise` if nothing is left.
pub fn slug(name: &str, otherwise: &str) -> String {
    let mut slug = String::new();
    for character in name.chars() {
        if character.is_ascii_alphanumeric() {
            slug.push(character.to_ascii_lowercase());
        } else if !slug.is_empty() && !slug.ends_with('-') {
            slug.push('-');
        }
        if slug.len() == MAX_SLUG {
            break;
        }
    }
    let slug = slug.trim_end_matches('-');
    if slug.is_empty() {
        otherwise.into()
    } else {
        slug.into()
    }
}

/// Whether a name holds only letters, digits and `_-.`, without a dot in front: it leads nowhere else.
pub fn is_plain_name(name: &str) -> bool {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"_-.".contains(&byte);
    !name.is_empty() && !name.starts_with('.') && name.bytes().all(is_plain)
}

/// Encodes pixels as PNG, row by row. The error is a clause, for a size that is wrong or too large.
pub fn png<P>(width: u32, height: u32, codes: Vec<P::Subpixel>) -> std::result::Result<Vec<u8>, String>
where
    P: PixelWithColorType,
    [P::Subpixel]: EncodableLayout,
{
    let image = ImageBuffer::<P, _>::from_raw(width, height, codes);
    let image = image.ok_or_else(|| format!("{width}x{height} is not its size"))?;
    let mut bytes = Cursor::new(Vec::new());
    let written = image.write_to(&mut bytes, ImageFormat::Png);
    written.map_err(|error| error.to_string())?;
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_forms_a_path() {
        for (name, expected) in [
            ("Floor", "floor"),
            ("../../etc/passwd", "etc-passwd"),
            ("", "surface"),
            ("床", "surface"),
            ("a  b\0c", "a-b-c"),
            ("C:\\x", "c-x"),
        ] {
            assert_eq!(slug(name, "surface"), expected);
        }
        assert_eq!(slug(&"x".repeat(500), "surface").len(), MAX_SLUG);
    }
}
