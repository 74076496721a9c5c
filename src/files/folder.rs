//! Output folders, tested for writing before any long work.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::{fs, io};

use tempfile::TempDir;

use super::write_atomically;
use crate::error::{Error, Result};

/// A folder that can be written. Folders created for it are removed again if they stay empty.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    made: Vec<PathBuf>,
}

impl OutputFolder {
    /// Creates the folder and its parents if they are missing, and checks that it can be written.
    ///
    /// # Errors
    /// Something else of that name; a folder that cannot be written.
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

    /// [`Self::open`] for a folder whose files are to be replaced. If it is not empty and not ours, it is accepted only
    /// with `force`. `whose` says in errors what its files should be from.
    ///
    /// # Errors
    /// Those of [`Self::open`]; foreign files in the folder.
    pub fn open_own(path: &Path, is_ours: bool, force: bool, whose: &str) -> Result<Self> {
        let folder = Self::open(path)?;
        if is_ours || force || folder.is_empty()? {
            return Ok(folder);
        }
        Err(Error::failure(
            path.display().to_string(),
            format!("the folder holds files that are not from {whose}"),
            "choose another folder or add --force",
        ))
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it has no entries.
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

/// Removes those folders that are empty, innermost first.
fn remove_empty(made: &[PathBuf]) {
    for folder in made.iter().rev() {
        let _ = fs::remove_dir(folder);
    }
}

/// Checks that a file can be written, before the work that produces it.
///
/// # Errors
/// No such folder; a folder or a device of that name; a folder that cannot be written.
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
            "something that is not a file has this name",
            "choose another name",
        ));
    }
    match tempfile::tempfile_in(parent) {
        Ok(_) => Ok(()),
        Err(error) => Err(unwritable(path, &error)),
    }
}

/// Removes a file that is obsolete; a missing file is no error.
///
/// # Errors
/// A file that cannot be removed.
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

/// Removes the files of an earlier run in a folder that were not written again.
///
/// # Errors
/// A file that cannot be removed.
pub fn remove_outdated<'a>(
    folder: &Path,
    previous: &[String],
    written: impl Iterator<Item = &'a str>,
) -> Result<()> {
    let written: HashSet<&str> = written.collect();
    let mut outdated = previous.iter().filter(|file| !written.contains(file.as_str()));
    outdated.try_for_each(|file| remove_file(&folder.join(file)))
}

fn unwritable(path: &Path, error: &io::Error) -> Error {
    Error::failure(
        path.display().to_string(),
        format!("nothing can be written there ({error})"),
        "choose another place or change its permissions",
    )
}

/// Files that are staged within the folder that they are for, and moved into place once all of them are on the disk: a
/// full disk or a cancelled run leaves the folder unchanged.
#[derive(Debug)]
pub struct StagedFolder {
    /// Dropped before `root`, so that a folder created for nothing is empty when it is removed.
    aside: TempDir,
    root: OutputFolder,
    names: Vec<String>,
}

impl StagedFolder {
    /// Stages files for a folder that can be written.
    ///
    /// # Errors
    /// A folder that can no longer be written.
    pub fn new(root: OutputFolder) -> Result<Self> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".nephroid-").suffix(".part");
        let aside = builder.tempdir_in(root.path());
        Ok(Self {
            aside: aside.map_err(|error| unwritable(root.path(), &error))?,
            root,
            names: Vec::new(),
        })
    }

    /// The folder that the files are for.
    pub fn path(&self) -> &Path {
        self.root.path()
    }

    /// Writes a file of a plain name aside, or of one in a folder within (`maps/a.exr`); one of the same name is replaced.
    ///
    /// # Errors
    /// A full disk; a folder where the file is to be.
    pub fn write(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        let place = self.root.path().join(name);
        if place.is_dir() {
            return Err(Error::failure(
                place.display().to_string(),
                "is a folder, where a file is to be written",
                "choose another place or remove the folder",
            ));
        }
        make_parent(&self.aside.path().join(name))?;
        let written = write_atomically(&self.aside.path().join(name), |writer| writer.write_all(bytes));
        // Errors name the path that the user knows.
        written.map_err(|error| Error {
            location: place.display().to_string(),
            ..error
        })?;
        if !self.names.iter().any(|known| known == name) {
            self.names.push(name.into());
        }
        Ok(())
    }

    /// Moves all files into place, in the order in which they were staged.
    ///
    /// # Errors
    /// A file that cannot be replaced.
    pub fn commit(self) -> Result<()> {
        for name in &self.names {
            let place = self.root.path().join(name);
            make_parent(&place)?;
            fs::rename(self.aside.path().join(name), &place).map_err(|error| unwritable(&place, &error))?;
        }
        sync(self.root.path()).map_err(|error| unwritable(self.root.path(), &error))
    }
}

/// Makes the folder that a file is to be in.
fn make_parent(file: &Path) -> Result<()> {
    let parent = file.parent().unwrap_or(file);
    fs::create_dir_all(parent).map_err(|error| unwritable(parent, &error))
}

/// Flushes a folder's entries to disk, where the system supports it.
fn sync(folder: &Path) -> io::Result<()> {
    if cfg!(unix) {
        return fs::File::open(folder)?.sync_all();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("it is there");
        let name = |entry: io::Result<fs::DirEntry>| entry.expect("it can be listed").file_name();
        let mut names: Vec<String> = entries
            .map(|entry| name(entry).to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn files_appear_together_or_not_at_all() {
        let around = tempfile::tempdir().expect("a temporary folder");
        let path = around.path().join("a/b");
        let open = || StagedFolder::new(OutputFolder::open(&path).expect("writable")).expect("writable");
        let mut staged = open();
        staged.write("one", b"1").expect("writable");
        assert!(!path.join("one").exists());
        drop(staged);
        assert_eq!(names(around.path()), [""; 0], "what was made for nothing is gone");

        let mut staged = open();
        staged.write("one", b"1").expect("writable");
        staged.write("two", b"2").expect("writable");
        staged.commit().expect("writable");
        assert_eq!(names(&path), ["one", "two"]);
        let mut staged = open();
        staged.write("one", b"3").expect("writable");
        assert_eq!(fs::read(path.join("one")).expect("there"), b"1");
        staged.commit().expect("writable");
        assert_eq!(fs::read(path.join("one")).expect("there"), b"3");
        fs::create_dir(path.join("three")).expect("it can be made");
        let refused = open().write("three", b"4").expect_err("a folder is there");
        assert!(refused.location.ends_with("three"), "{refused}");
    }
}
