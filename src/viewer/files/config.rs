//! The user's configuration folder: one file for each scene, and a list of recent ones.

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;

use super::Recent;
use crate::error::{Error, Result};
use crate::files::cache::ContentHash;
use crate::files::{read_file, slug, to_json, write_atomically};
use crate::scene::Camera;
use crate::scene::changes::Change;
use crate::settings::BakeSettings;
use crate::viewer::filming::Film;
use crate::viewer::navigation::{BOOKMARKS, NavigationMode};
use crate::viewer::panel::Display;

/// Limit of the size of a file [bytes], far above that of any valid one.
const MAX_BYTES: u64 = 16 << 20;
/// Numbers tried when a broken file is renamed.
const NUMBERS: std::ops::RangeInclusive<u32> = 1..=99;

/// The user's configuration folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConfigFolder {
    path: PathBuf,
}

/// The value, if there is one, and a warning if a broken file was renamed.
pub type ReadBack<T> = (Option<T>, Option<String>);

impl ConfigFolder {
    /// The folder is created on first write.
    pub fn new(path: PathBuf) -> Self {
        Self { path }
    }

    /// The user's folder: `$NEPHROID_CONFIG_DIR`, else `nephroid` in `$XDG_CONFIG_HOME`, `%APPDATA%` or `~/.config`;
    /// `None` if none of these variables is set.
    pub fn of_user() -> Option<Self> {
        let variable = |name: &str| {
            let value = std::env::var_os(name).filter(|value| !value.is_empty())?;
            Some(PathBuf::from(value))
        };
        let path = variable("NEPHROID_CONFIG_DIR")
            .or_else(|| Some(variable("XDG_CONFIG_HOME")?.join("nephroid")))
            .or_else(|| Some(variable("APPDATA")?.join("nephroid")))
            .or_else(|| Some(variable("HOME")?.join(".config/nephroid")))?;
        Some(Self::new(path))
    }

    /// Path of a scene's saved state.
    pub fn scene_file(&self, source: &str) -> PathBuf {
        let full = full_source(source);
        let mut hash = ContentHash::default();
        full.bytes().for_each(|byte| hash.take(u64::from(byte)));
        let stem = Path::new(&full).file_stem().unwrap_or_default().to_string_lossy();
        let stem = stem.strip_prefix("builtin:").unwrap_or(&stem);
        let name = format!("{}-{:016x}.json", slug(stem, "scene"), hash.value());
        self.path.join("scenes").join(name)
    }

    /// Reads the saved state of a scene.
    pub fn read_scene(&self, source: &str) -> ReadBack<SavedState> {
        read(&self.scene_file(source))
    }

    /// Writes the saved state of a scene.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_scene(&self, kept: &SavedState) -> Result<PathBuf> {
        let path = self.scene_file(&kept.source);
        write(&path, kept)?;
        Ok(path)
    }

    fn recent_file(&self) -> PathBuf {
        self.path.join("recent.json")
    }

    /// Reads the list of recent files.
    pub fn read_recent(&self) -> ReadBack<Recent> {
        let (paths, warning) = read::<Vec<PathBuf>>(&self.recent_file());
        (paths.map(Recent::of), warning)
    }

    /// Writes the list of recent files.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_recent(&self, recent: &Recent) -> Result<()> {
        write(&self.recent_file(), &recent.paths())
    }
}

/// Canonical path of a scene, so that its saved state is found from any working folder; the source itself if it is
/// built in or does not exist.
pub fn full_source(source: &str) -> String {
    if source.starts_with("builtin:") {
        return source.to_owned();
    }
    let full = Path::new(source).canonicalize();
    full.map_or_else(|_| source.to_owned(), |path| path.display().to_string())
}

/// Reads a file; nothing if it does not exist. An unreadable file is renamed and kept.
fn read<T: DeserializeOwned>(path: &Path) -> ReadBack<T> {
    if !path.exists() {
        return (None, None);
    }
    let read = read_file(path, MAX_BYTES).map_err(|error| error.to_string());
    let parsed = read.and_then(|bytes| serde_json::from_slice(&bytes).map_err(|error| error.to_string()));
    match parsed {
        Ok(value) => (Some(value), None),
        Err(why) => (None, Some(set_aside(path, &why))),
    }
}

/// Renames a broken file and returns a message about it.
fn set_aside(path: &Path, why: &str) -> String {
    let named = |number: u32| path.with_extension(format!("broken-{number}.json"));
    let free = NUMBERS.map(named).find(|name| !name.exists());
    let moved = free.filter(|name| std::fs::rename(path, name).is_ok());
    match moved {
        Some(name) => format!(
            "{} cannot be understood ({why}): it was renamed to {}, and the scene starts afresh.",
            path.display(),
            name.display()
        ),
        None => format!(
            "{} cannot be understood ({why}) nor renamed: the scene starts afresh.",
            path.display()
        ),
    }
}

fn write<T: Serialize>(path: &Path, value: &T) -> Result<()> {
    let location = path.display().to_string();
    let unwritable = |what: String| Error::failure(&location, what, "check the folder's permissions");
    let mut text = to_json(value, &location)?;
    text.push(b'\n');
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)
            .map_err(|error| unwritable(format!("its folder cannot be made ({error})")))?;
    }
    write_atomically(path, |writer| writer.write_all(&text))
}

/// Camera, mode and bookmarks.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct KeptViews {
    /// `None` takes the scene's first camera.
    pub camera: Option<Camera>,
    pub travel: NavigationMode,
    pub bookmarks: [Option<Camera>; BOOKMARKS],
}

/// Saved state of a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedState {
    /// Canonical path, or `builtin:NAME`; for people who read the folder.
    pub source: String,
    pub views: KeptViews,
    /// Bake settings by name, as JSON: another version may have more or other settings.
    pub settings: Value,
    pub display: Display,
    pub film: Film,
    /// Whether changes are baked automatically.
    pub automatic: Option<bool>,
    /// Whether the scene is reloaded when its files change.
    pub watch: bool,
    /// Edits of the loaded scene; edits that this version does not know are dropped.
    #[serde(deserialize_with = "known")]
    pub changes: Vec<Change>,
}

fn known<'a, D: Deserializer<'a>>(source: D) -> std::result::Result<Vec<Change>, D::Error> {
    let changes = Vec::<Value>::deserialize(source)?;
    Ok(changes
        .into_iter()
        .filter_map(|change| serde_json::from_value(change).ok())
        .collect())
}

impl SavedState {
    /// The saved settings. Settings that this version does not know or cannot parse are taken from `otherwise`; if
    /// the result is out of range, all are.
    pub fn settings_or(&self, otherwise: &BakeSettings) -> BakeSettings {
        let (Value::Object(kept), Ok(mut known)) = (&self.settings, serde_json::to_value(otherwise)) else {
            return otherwise.clone();
        };
        for (name, value) in kept {
            let Some(place) = known.get_mut(name) else {
                continue;
            };
            let before = std::mem::replace(place, value.clone());
            let is_read = BakeSettings::deserialize(&known).is_ok();
            if !is_read && let Some(place) = known.get_mut(name) {
                *place = before;
            }
        }
        let settings = BakeSettings::deserialize(&known).ok();
        settings
            .filter(|settings| settings.validate().is_ok())
            .unwrap_or_else(|| otherwise.clone())
    }
}
