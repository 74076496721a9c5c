//! Places to write to, tried before the long work.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// A folder that can be written. One that was made for it is removed again unless something was written into it.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    made: Vec<PathBuf>,
}

impl OutputFolder {
    /// Makes the folder, with its parents, where it is missing, and tries to write into it.
    ///
    /// # Errors
    /// Something else of that name; a place that cannot be written.
    pub fn open(path: &Path) -> Result<Self> {
        let mut made = Vec::new();
        let mut missing: Vec<&Path> = path
            .ancestors()
            .take_while(|ancestor| !ancestor.as_os_str().is_empty() && !ancestor.exists())
            .collect();
        while let Some(folder) = missing.pop() {
            let result = fs::create_dir(folder);
            if let Err(error) = result {
                remove_empty(&made);
                return Err(unwritable(path, &error));
            }
            made.push(folder.to_path_buf());
        }
        let folder = Self {
            path: path.to_path_buf(),
            made,
        };
        match tempfile::tempfile_in(path) {
            Ok(_) => Ok(folder),
            Err(error) => Err(unwritable(path, &error)),
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether nothing is in it.
    ///
    /// # Errors
    /// A folder that cannot be listed.
    pub fn is_empty(&self) -> Result<bool> {
        let mut entries = fs::read_dir(&self.path).map_err(|error| {
            Error::failure(
                self.path.display().to_string(),
                format!("its files cannot be listed ({error})"),
                "choose another folder",
            )
        })?;
        Ok(entries.next().is_none())
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        remove_empty(&self.made);
    }
}

/// Removes those folders that are empty, the innermost first; the others stay.
fn remove_empty(made: &[PathBuf]) {
    for folder in made.iter().rev() {
        let _ = fs::remove_dir(folder);
    }
}

/// Refuses a file that could not be written, before the work that would fill it.
///
/// # Errors
/// No such folder, a folder or a device of that name, a place that cannot be written.
pub fn check_output_file(path: &Path) -> Result<()> {
    let location = path.display().to_string();
    let parent = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if !parent.is_dir() {
        return Err(Error::failure(
            location,
            format!("there is no folder {}", parent.display()),
            "make it first or choose another place",
        ));
    }
    if let Ok(metadata) = fs::metadata(path)
        && !metadata.is_file()
    {
        return Err(Error::failure(
            location,
            "something that is no file has this name",
            "choose another name",
        ));
    }
    match tempfile::tempfile_in(parent) {
        Ok(_) => Ok(()),
        Err(error) => Err(unwritable(path, &error)),
    }
}

/// Removes a file that is of no more use; one that is gone already is as good.
///
/// # Errors
/// A file that the system does not let go.
pub fn remove_file(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Error::failure(
            path.display().to_string(),
            format!("the outdated file cannot be removed ({error})"),
            "remove it yourself",
        )),
        _ => Ok(()),
    }
}

fn unwritable(path: &Path, error: &io::Error) -> Error {
    Error::failure(
        path.display().to_string(),
        format!("nothing can be written there ({error})"),
        "choose another place or change its permissions",
    )
}
