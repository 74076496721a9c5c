//! Files of the window: scenes to open, and the state that is saved with them.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rfd::FileDialog;
use winit::window::Window;

use self::autosaver::{Autosaver, Stamps, changed};
use self::config::{ConfigFolder, ReadBack, SavedState};
use crate::error::{Error, Result};
use crate::scene::{LoadOptions, Scene, load};
use crate::viewer::background::{Background, Task, Wake};

pub mod autosaver;
pub mod config;

/// Why a scene is loaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoadPurpose {
    /// To replace the present scene.
    Open,
    /// To update the present scene, whose files have changed.
    Reload,
}

/// Options for opening scenes in the window.
#[derive(Clone, Debug, Default)]
pub struct FilesOptions {
    /// How scenes are loaded.
    pub load: LoadOptions,
    /// Whether scenes are reloaded when their files change.
    pub watch: bool,
    /// The user's configuration folder; `None` saves nothing.
    pub config: Option<ConfigFolder>,
    /// Whether the saved state of the first scene is ignored until something changes.
    pub fresh: bool,
    /// Whether bake settings were given on the command line; they override saved ones.
    pub settings_given: bool,
}

/// Loads, saves and watches scene files, and keeps their saved state.
#[derive(Debug)]
pub struct Files {
    pub load: LoadOptions,
    loader: Background<(String, LoadPurpose), Result<Scene>>,
    saver: Background<PathBuf, Result<()>>,
    /// Files opened before.
    pub recent: Recent,
    pub refusal: Option<String>,
    /// What could not be restored of the saved state.
    pub warning: Option<String>,
    /// Watches the files of the present scene.
    watch: Background<(), Stamps>,
    /// `None` without a configuration folder.
    pub autosaver: Option<Autosaver>,
    config: Option<ConfigFolder>,
}

impl Files {
    /// Reads the list of recent files. `wake` is called when there is news.
    pub fn new(options: &FilesOptions, wake: &Wake) -> Self {
        let recent = options.config.as_ref().map(ConfigFolder::read_recent);
        let (recent, warning) = recent.unwrap_or_default();
        Self {
            load: options.load.clone(),
            loader: Background::new("loader", wake),
            saver: Background::new("saver", wake),
            recent: recent.unwrap_or_default(),
            refusal: None,
            warning,
            watch: Background::new("watch", wake),
            autosaver: options.config.clone().map(Autosaver::new),
            config: options.config.clone(),
        }
    }

    /// Records that a scene was opened.
    pub fn opened(&mut self, source: &str) {
        self.recent.opened(source);
        if let Some(autosaver) = &mut self.autosaver {
            autosaver.keep_recent(&self.recent);
        }
    }

    /// Starts to load a scene; cancels a load in progress.
    ///
    /// # Errors
    /// The system cannot create a thread.
    pub fn read(&mut self, source: &str, purpose: LoadPurpose) -> Result<()> {
        let (named, options) = (source.to_owned(), self.load.clone());
        self.loader.start((source.to_owned(), purpose), move |_| {
            Scene::load(&named, &options)
        })
    }

    /// Takes the loaded scene or the error, with its source and purpose.
    pub fn take_read(&mut self) -> Option<((String, LoadPurpose), Result<Scene>)> {
        let (of, outcome) = self.loader.take()?;
        let broken = || {
            Error::failure(
                &of.0,
                "it could not be read to the end",
                "check the file and try again",
            )
        };
        let outcome = outcome.unwrap_or_else(|| Err(broken()));
        Some((of, outcome))
    }

    /// Starts to write an edited scene, unless one is being written.
    ///
    /// # Errors
    /// The system cannot create a thread.
    pub fn save(&mut self, target: PathBuf, loaded: Arc<Scene>, edited: Arc<Scene>) -> Result<()> {
        if self.saver.of().is_some() {
            return Ok(());
        }
        let (path, options) = (target.clone(), self.load.clone());
        self.saver
            .start(target, move |_| load::save(&path, &loaded, &edited, &options))
    }

    /// Takes the path of the saved scene, or the error.
    pub fn take_saved(&mut self) -> Option<Result<PathBuf>> {
        let (target, outcome) = self.saver.take()?;
        let location = target.display().to_string();
        let broken = || {
            Error::failure(
                location,
                "it could not be written to the end",
                "try again, or choose another place",
            )
        };
        Some(outcome.unwrap_or_else(|| Err(broken())).map(|()| target))
    }

    /// Saved state of a scene, by its full path, and a warning if it cannot be read.
    pub fn read_back(&self, full_source: &str) -> ReadBack<SavedState> {
        let config = self.config.as_ref();
        config.map_or((None, None), |config| config.read_scene(full_source))
    }

    pub fn is_watching(&self) -> bool {
        self.watch.of().is_some()
    }

    /// Watches files for changes from the state in `stamps`.
    pub fn start_watch(&mut self, stamps: Stamps) {
        if let Err(error) = self.watch.start((), |task| changed(stamps, task)) {
            self.refusal = Some(error.to_string());
        }
    }

    pub fn stop_watch(&mut self) {
        self.watch.stop();
    }

    /// Whether the watched files have changed since the last call.
    pub fn have_changed(&mut self) -> bool {
        let stamps = self.watch.take().and_then(|(_, stamps)| stamps);
        let has_changed = stamps.is_some();
        stamps.into_iter().for_each(|stamps| self.start_watch(stamps));
        has_changed
    }

    /// Source of the scene that is being loaded.
    pub fn loading(&self) -> Option<&str> {
        self.loader.of().map(|(source, _)| source.as_str())
    }
}

/// Cleans up a typed or pasted path: trims white space, removes quotation marks and expands `~/`.
pub fn typed(text: &str) -> String {
    let bare = text.trim();
    let quoted = ['"', '\''].iter().find_map(|mark| {
        let inner = bare.strip_prefix(*mark)?;
        inner.strip_suffix(*mark)
    });
    let bare = quoted.unwrap_or(bare);
    let home = std::env::var_os("HOME").filter(|home| !home.is_empty());
    match (bare.strip_prefix("~/"), home) {
        (Some(rest), Some(home)) => PathBuf::from(home).join(rest).display().to_string(),
        _ => bare.to_owned(),
    }
}

/// Folder for pictures, maps, paths and frames, as an absolute path if known, because the window does not show where
/// it was started.
pub fn working_folder() -> PathBuf {
    std::env::current_dir().unwrap_or_else(|_| PathBuf::from("."))
}

const NUMBERS: std::ops::RangeInclusive<u32> = 1..=9999;

/// Paths of `N` files with a common number for which no file exists yet.
///
/// # Errors
/// No number is free.
pub fn free_names<const N: usize>(
    folder: &Path,
    named: impl Fn(&str) -> [String; N],
) -> Result<[PathBuf; N]> {
    let paths = |number: u32| named(&format!("{number:04}")).map(|name| folder.join(name));
    let is_free = |paths: &[PathBuf; N]| !paths.iter().any(|path| path.exists());
    NUMBERS.map(paths).find(is_free).ok_or_else(|| {
        Error::failure(
            folder.display().to_string(),
            format!("it holds {} of these already", NUMBERS.end()),
            "move some of them elsewhere",
        )
    })
}

/// A dialog that closes sooner than this was never shown.
const NO_DIALOG_WITHIN: Duration = Duration::from_millis(400);

/// Message if the system has no file dialog.
pub const NO_DIALOG: &str =
    "This system offers no dialog to choose a file in: type its path, or drop the file on the window.";

/// Purpose of a file dialog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// Open a scene.
    Open,
    /// Save the edited scene.
    SaveScene,
}

/// A file dialog, open or not.
#[derive(Debug)]
pub struct Dialog {
    open: Background<(Choice, Instant), Option<PathBuf>>,
    /// Purpose of the last request if the system could not create a thread.
    refused: Option<Choice>,
}

impl Dialog {
    /// No dialog is open. `wake` is called when the user has chosen.
    pub fn new(wake: &Wake) -> Self {
        Self {
            open: Background::new("dialog", wake),
            refused: None,
        }
    }

    /// Opens the dialog in the folder of the present scene, unless one is open already.
    pub fn ask(&mut self, choice: Choice, window: &Window, present: &Path) {
        if self.open.of().is_some() {
            return;
        }
        let mut dialog = FileDialog::new()
            .set_parent(window)
            .add_filter("glTF scenes", &["glb", "gltf"]);
        if let Some(folder) = present.parent().filter(|folder| folder.is_dir()) {
            dialog = dialog.set_directory(folder);
        }
        if choice == Choice::SaveScene {
            let stem = present.file_stem().unwrap_or_default().to_string_lossy();
            dialog = dialog.set_file_name(format!("{stem}-edited.glb"));
        }
        let ask = move |_: &Task| match choice {
            Choice::Open => dialog.pick_file(),
            Choice::SaveScene => dialog.save_file(),
        };
        let is_refused = self.open.start((choice, Instant::now()), ask).is_err();
        self.refused = is_refused.then_some(choice);
    }

    /// Takes the user's choice; the path is `None` if the system has no dialog. Cancelled dialogs return nothing.
    pub fn take(&mut self) -> Option<(Choice, Option<PathBuf>)> {
        if let Some(choice) = self.refused.take() {
            return Some((choice, None));
        }
        let ((choice, since), answer) = self.open.take()?;
        let file = answer.flatten();
        // The user cancelled.
        let is_closed = file.is_none() && since.elapsed() >= NO_DIALOG_WITHIN;
        (!is_closed).then_some((choice, file))
    }
}

/// Maximum length of the list.
pub const MAX_RECENT: usize = 10;

/// Files opened before, newest first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recent {
    paths: Vec<PathBuf>,
}

impl Recent {
    /// The existing files of a list, without duplicates, at most [`MAX_RECENT`].
    pub fn of(paths: impl IntoIterator<Item = PathBuf>) -> Self {
        let mut recent = Self::default();
        for path in paths {
            if recent.paths.len() < MAX_RECENT && path.is_file() && !recent.paths.contains(&path) {
                recent.paths.push(path);
            }
        }
        recent
    }

    pub fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// Puts a file first and removes files that no longer exist. Ignores built-in scenes.
    pub fn opened(&mut self, source: &str) {
        if source.starts_with("builtin:") {
            return;
        }
        // An absolute path is valid from any working folder.
        let Ok(path) = Path::new(source).canonicalize() else {
            return;
        };
        let before = std::mem::take(&mut self.paths);
        *self = Self::of(std::iter::once(path).chain(before));
    }
}
