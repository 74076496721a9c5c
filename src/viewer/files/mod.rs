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

/// What a scene is read for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoadPurpose {
    /// To take the place of the one in the window.
    Open,
    /// Its files have changed.
    Reload,
}

/// How scenes are opened in the window.
#[derive(Clone, Debug, Default)]
pub struct FilesOptions {
    /// How they are read, the first and every other.
    pub load: LoadOptions,
    /// Whether the scene is read again when its files change.
    pub watch: bool,
    /// Where the user's settings are kept; `None` keeps nothing.
    pub config: Option<ConfigFolder>,
    /// Whether what was kept of the first scene is left alone until something changes.
    pub fresh: bool,
    /// Whether the bake's settings are those that the user asked for, and kept ones give way.
    pub settings_given: bool,
}

/// What the window knows of files.
#[derive(Debug)]
pub struct Files {
    /// How scenes are read.
    pub load: LoadOptions,
    loader: Background<(String, LoadPurpose), Result<Scene>>,
    saver: Background<PathBuf, Result<()>>,
    /// What was opened before.
    pub recent: Recent,
    /// Why the last scene could not be opened.
    pub refusal: Option<String>,
    /// What was found of what was kept, and could not be taken over.
    pub warning: Option<String>,
    /// Watches the files of the scene in the window.
    watch: Background<(), Stamps>,
    /// Keeps what the user does.
    pub autosaver: Option<Autosaver>,
    config: Option<ConfigFolder>,
}

impl Files {
    /// Nothing was opened yet; the window is woken when there is news.
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

    /// A scene was opened.
    pub fn opened(&mut self, source: &str) {
        self.recent.opened(source);
        if let Some(autosaver) = &mut self.autosaver {
            autosaver.keep_recent(&self.recent);
        }
    }

    /// Reads a scene; one that is still being read is forgotten.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn read(&mut self, source: &str, purpose: LoadPurpose) -> Result<()> {
        let (named, options) = (source.to_owned(), self.load.clone());
        self.loader.start((source.to_owned(), purpose), move |_| {
            Scene::load(&named, &options)
        })
    }

    /// The scene that was read, once, with where it comes from and what it was read for.
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

    /// Writes an edited scene, unless one is being written.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn save(&mut self, target: PathBuf, loaded: Arc<Scene>, edited: Arc<Scene>) -> Result<()> {
        if self.saver.of().is_some() {
            return Ok(());
        }
        let (path, options) = (target.clone(), self.load.clone());
        self.saver
            .start(target, move |_| load::save(&path, &loaded, &edited, &options))
    }

    /// Where the scene was written, once, or why it was not.
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

    /// What was kept of a scene by its full path, and a sentence where that cannot be understood.
    pub fn read_back(&self, full_source: &str) -> ReadBack<SavedState> {
        let config = self.config.as_ref();
        config.map_or((None, None), |config| config.read_scene(full_source))
    }

    /// Whether files are watched.
    pub fn is_watching(&self) -> bool {
        self.watch.of().is_some()
    }

    /// Watches files that were as `stamps` say.
    pub fn start_watch(&mut self, stamps: Stamps) {
        if let Err(error) = self.watch.start((), |task| changed(stamps, task)) {
            self.refusal = Some(error.to_string());
        }
    }

    /// Watches them no longer.
    pub fn stop_watch(&mut self) {
        self.watch.stop();
    }

    /// Whether they changed since this was called last.
    pub fn have_changed(&mut self) -> bool {
        let stamps = self.watch.take().and_then(|(_, stamps)| stamps);
        let has_changed = stamps.is_some();
        stamps.into_iter().for_each(|stamps| self.start_watch(stamps));
        has_changed
    }

    /// The scene that is being read.
    pub fn loading(&self) -> Option<&str> {
        self.loader.of().map(|(source, _)| source.as_str())
    }
}

/// A typed or pasted path, without surrounding space or quotation marks, `~/` expanded.
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

/// Where pictures, maps, paths and frames go. Said in full where the system knows it: the window does not show where it was
/// started.
pub fn working_folder() -> PathBuf {
    std::env::current_dir().unwrap_or_else(|_| PathBuf::from("."))
}

const NUMBERS: std::ops::RangeInclusive<u32> = 1..=9999;

/// Names for files of one number, none of which there is yet.
///
/// # Errors
/// All numbers are taken.
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

/// Told where no dialog can be had.
pub const NO_DIALOG: &str =
    "This system offers no dialog to choose a file in: type its path, or drop the file on the window.";

/// What a file is chosen for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// A scene to be opened.
    Open,
    /// The edited scene to be saved.
    SaveScene,
}

/// A dialog, open or not.
#[derive(Debug)]
pub struct Dialog {
    open: Background<(Choice, Instant), Option<PathBuf>>,
    /// Asked for where the system gives no thread.
    refused: Option<Choice>,
}

impl Dialog {
    /// None is open; the window is woken when a file was chosen.
    pub fn new(wake: &Wake) -> Self {
        Self {
            open: Background::new("dialog", wake),
            refused: None,
        }
    }

    /// Asks for a file, unless a dialog is open already. It begins in the folder of the file that is in the window.
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

    /// What was chosen, once, and for what; `None` for the file where there is no dialog to choose it in.
    pub fn take(&mut self) -> Option<(Choice, Option<PathBuf>)> {
        if let Some(choice) = self.refused.take() {
            return Some((choice, None));
        }
        let ((choice, since), answer) = self.open.take()?;
        let file = answer.flatten();
        // The user thought better of it.
        let is_closed = file.is_none() && since.elapsed() >= NO_DIALOG_WITHIN;
        (!is_closed).then_some((choice, file))
    }
}

/// Most that are remembered.
pub const MAX_RECENT: usize = 10;

/// Files that were opened, the newest first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recent {
    paths: Vec<PathBuf>,
}

impl Recent {
    /// Those of a list that are still there; each once, at most [`MAX_RECENT`].
    pub fn of(paths: impl IntoIterator<Item = PathBuf>) -> Self {
        let mut recent = Self::default();
        for path in paths {
            if recent.paths.len() < MAX_RECENT && path.is_file() && !recent.paths.contains(&path) {
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
