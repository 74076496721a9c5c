//! Cache of results that take long to compute and depend on files alone, in the user's cache folder, keyed by their
//! inputs. Off unless the program enables it at its start.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::SystemTime;

use super::{read_file, write_atomically};

/// Capacity [bytes]; beyond it, the oldest files are removed.
const CAPACITY_BYTES: u64 = 256 << 20;

/// The cache folder, if the cache is enabled.
static FOLDER: OnceLock<PathBuf> = OnceLock::new();

/// FNV-1a over 64-bit words (Fowler, Noll, Vo): the same on every machine and in every version.
#[derive(Clone, Copy, Debug)]
pub struct ContentHash(u64);

impl Default for ContentHash {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl ContentHash {
    /// Hashes one more word.
    pub fn take(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x0000_0100_0000_01b3);
    }

    /// The hash of all words so far.
    pub fn value(self) -> u64 {
        self.0
    }
}

/// Enables the cache in the user's cache folder, if there is one: `$XDG_CACHE_HOME/nephroid`, `%LOCALAPPDATA%\nephroid`
/// or `~/.cache/nephroid`.
pub fn enable() {
    let folder = |variable: &str, below: &str| {
        let base = std::env::var_os(variable).filter(|base| !base.is_empty())?;
        Some(PathBuf::from(base).join(below))
    };
    let found = folder("XDG_CACHE_HOME", "nephroid")
        .or_else(|| folder("LOCALAPPDATA", "nephroid"))
        .or_else(|| folder("HOME", ".cache/nephroid"));
    if let Some(found) = found {
        // The first call wins.
        let _ = FOLDER.set(found);
    }
}

/// A cached file of at most `most_bytes`; `None` if there is none.
pub fn load(name: &str, most_bytes: u64) -> Option<Vec<u8>> {
    read_file(&FOLDER.get()?.join(name), most_bytes).ok()
}

/// Stores a file if the cache is enabled. If that fails, its contents are computed again next time.
pub fn store(name: &str, bytes: &[u8]) {
    let Some(folder) = FOLDER.get() else { return };
    let path = folder.join(name);
    let written = std::fs::create_dir_all(folder).is_ok()
        && write_atomically(&path, |writer| writer.write_all(bytes)).is_ok();
    if written {
        drop_the_oldest(folder);
    } else {
        log::info!("{} could not be kept", path.display());
    }
}

fn drop_the_oldest(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return;
    };
    let mut files: Vec<(SystemTime, u64, PathBuf)> = entries
        .filter_map(|entry| {
            let entry = entry.ok()?;
            let data = entry.metadata().ok().filter(std::fs::Metadata::is_file)?;
            Some((data.modified().ok()?, data.len(), entry.path()))
        })
        .collect();
    files.sort();
    let mut bytes: u64 = files.iter().map(|(_, bytes, _)| bytes).sum();
    for (_, size, path) in files {
        if bytes <= CAPACITY_BYTES {
            break;
        }
        if std::fs::remove_file(path).is_ok() {
            bytes -= size;
        }
    }
}
