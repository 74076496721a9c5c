//! The system's own window to choose a file in, where there is one; it runs on a thread of its own.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rfd::FileDialog;
use winit::window::Window;

use crate::progress::Control;
use crate::viewer::background::Background;

/// Nobody sees a dialog and closes it in so short a time: there was none.
const NO_DIALOG_WITHIN: Duration = Duration::from_millis(400);

/// Told where no dialog can be had.
const NONE: &str =
    "This system offers no dialog to choose a file in: type its path, or drop the file on the window.";

/// What a file is chosen for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// A scene to be opened.
    Open,
    /// The edited scene to be saved.
    SaveScene,
}

/// What came of a dialog.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Chosen {
    /// This file, for that.
    File(Choice, PathBuf),
    /// The user thought better of it.
    Nothing,
    /// There is no dialog to choose it in: one sentence.
    NoDialog(Choice, &'static str),
}

/// A dialog, open or not.
#[derive(Debug)]
pub struct Dialog {
    open: Background<(Choice, Instant), Option<PathBuf>>,
    /// Asked for where the system gives no thread.
    refused: Option<Choice>,
}

impl Dialog {
    /// None is open; `wake` is called from another thread when a file was chosen.
    pub fn new(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
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
        let ask = move |_: &Control| match choice {
            Choice::Open => dialog.pick_file(),
            Choice::SaveScene => dialog.save_file(),
        };
        let is_refused = self.open.start((choice, Instant::now()), ask).is_err();
        self.refused = is_refused.then_some(choice);
    }

    /// What was chosen, once.
    pub fn take(&mut self) -> Option<Chosen> {
        if let Some(choice) = self.refused.take() {
            return Some(Chosen::NoDialog(choice, NONE));
        }
        let ((choice, since), answer) = self.open.take()?;
        Some(match answer {
            Some(Some(path)) => Chosen::File(choice, path),
            Some(None) if since.elapsed() >= NO_DIALOG_WITHIN => Chosen::Nothing,
            Some(None) | None => Chosen::NoDialog(choice, NONE),
        })
    }
}
