//! Files that were opened before.

use std::path::{Path, PathBuf};

/// Most that are remembered.
pub const MOST: usize = 10;

/// Files that were opened, the newest first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recent {
    paths: Vec<PathBuf>,
}

impl Recent {
    /// Those of a list that are still there; each once, at most [`MOST`].
    pub fn of(paths: impl IntoIterator<Item = PathBuf>) -> Self {
        let mut recent = Self::default();
        for path in paths {
            if recent.paths.len() < MOST && path.is_file() && !recent.paths.contains(&path) {
                recent.paths.push(path);
            }
        }
        recent
    }

    /// The newest first.
    pub fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// A file was opened: it comes first, and what is gone is left out. Built-in scenes are no files.
    pub fn opened(&mut self, source: &str) {
        if source.starts_with("builtin:") {
            return;
        }
        // Found again from whatever folder the program is started in.
        let Ok(path) = Path::new(source).canonicalize() else {
            return;
        };
        let before = std::mem::take(&mut self.paths);
        *self = Self::of(std::iter::once(path).chain(before));
    }
}
