//! Scenes that are opened while the window is open.

pub mod config;
pub mod dialog;
pub mod keeper;
pub mod kept;
pub mod loader;
pub mod recent;
pub mod saver;
pub mod watch;

use std::path::PathBuf;
use std::sync::Arc;

use self::config::{ConfigFolder, ReadBack};
use self::keeper::Keeper;
use self::kept::Kept;
use self::loader::Loader;
use self::recent::Recent;
use self::saver::Saver;
use self::watch::{Stamps, Watch};
use crate::scene::LoadOptions;
use crate::viewer::background::Wake;

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
    /// Reads the scene that comes next.
    pub loader: Loader,
    /// Writes the edited scene.
    pub saver: Saver,
    /// What was opened before.
    pub recent: Recent,
    /// Why the last scene could not be opened.
    pub refusal: Option<String>,
    /// What was found of what was kept, and could not be taken over.
    pub warning: Option<String>,
    /// Watches the files of the scene in the window.
    pub watch: Option<Watch>,
    /// Keeps what the user does.
    pub keeper: Option<Keeper>,
    config: Option<ConfigFolder>,
    wake: Wake,
}

impl Files {
    /// Nothing was opened yet; `wake` is called from other threads when there is news.
    pub fn new(options: &FilesOptions, wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        let recent = options.config.as_ref().map(ConfigFolder::read_recent);
        let (recent, warning) = recent.unwrap_or_default();
        Self {
            load: options.load.clone(),
            loader: Loader::new(Arc::clone(&wake)),
            saver: Saver::new(Arc::clone(&wake)),
            recent: recent.unwrap_or_default(),
            refusal: None,
            warning,
            watch: None,
            keeper: options.config.clone().and_then(Keeper::start),
            config: options.config.clone(),
            wake: Wake(wake),
        }
    }

    /// A scene was opened.
    pub fn opened(&mut self, source: &str) {
        self.recent.opened(source);
        if let Some(keeper) = &self.keeper {
            keeper.keep_recent(&self.recent);
        }
    }

    /// What was kept of a scene by its full path, and a sentence where that cannot be understood.
    pub fn read_back(&self, full_source: &str) -> ReadBack<Kept> {
        let config = self.config.as_ref();
        config.map_or((None, None), |config| config.read_scene(full_source))
    }

    /// Watches files that were as `stamps` say.
    pub fn start_watch(&mut self, stamps: Stamps) {
        match Watch::start(stamps, Arc::clone(&self.wake.0)) {
            Ok(watch) => self.watch = Some(watch),
            Err(error) => self.refusal = Some(error.to_string()),
        }
    }

    /// What the panel tells of them.
    pub fn facts(&self) -> FileFacts<'_> {
        FileFacts {
            loading: self.loader.loading(),
            recent: self.recent.paths(),
            refusal: self.refusal.as_deref(),
            warning: self.warning.as_deref(),
        }
    }
}

/// What the panel tells of files.
#[derive(Clone, Copy, Debug, Default)]
pub struct FileFacts<'a> {
    /// The scene that is being read.
    pub loading: Option<&'a str>,
    /// Files that were opened before, the newest first.
    pub recent: &'a [PathBuf],
    /// Why the last scene could not be opened.
    pub refusal: Option<&'a str>,
    /// What of what was kept could not be taken over.
    pub warning: Option<&'a str>,
}

/// The path that somebody typed or pasted: without space or quotation marks around it, `~/` for the home folder.
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
