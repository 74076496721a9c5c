//! The system's own window to choose a file in, where there is one; it runs on a thread of its own.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;
use std::time::{Duration, Instant};

use rfd::FileDialog;
use winit::window::Window;

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
pub struct Dialog {
    wake: Arc<dyn Fn() + Send + Sync>,
    open: Option<Open>,
}

struct Open {
    choice: Choice,
    since: Instant,
    answer: Receiver<Option<PathBuf>>,
}

impl fmt::Debug for Dialog {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Dialog {{ open: {} }}", self.open.is_some())
    }
}

impl Dialog {
    /// None is open; `wake` is called from another thread when a file was chosen.
    pub fn new(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        Self { wake, open: None }
    }

    /// Asks for a file, unless a dialog is open already. It begins in the folder of the file that is in the window.
    pub fn ask(&mut self, choice: Choice, window: &Window, present: &Path) {
        if self.open.is_some() {
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
        let (give, take) = channel();
        let wake = Arc::clone(&self.wake);
        let ask = move || {
            let chosen = match choice {
                Choice::Open => dialog.pick_file(),
                Choice::SaveScene => dialog.save_file(),
            };
            // The window may be closed by then.
            let _ = give.send(chosen);
            wake();
        };
        // Without a thread the answer is missing at once, which says that there is no dialog.
        let _ = thread::Builder::new().name("dialog".into()).spawn(ask);
        self.open = Some(Open {
            choice,
            since: Instant::now(),
            answer: take,
        });
    }

    /// What was chosen, once.
    pub fn take(&mut self) -> Option<Chosen> {
        let open = self.open.as_ref()?;
        let chosen = match open.answer.try_recv() {
            Err(TryRecvError::Empty) => return None,
            Ok(Some(path)) => Chosen::File(open.choice, path),
            Ok(None) if open.since.elapsed() >= NO_DIALOG_WITHIN => Chosen::Nothing,
            Ok(None) | Err(TryRecvError::Disconnected) => Chosen::NoDialog(open.choice, NONE),
        };
        self.open = None;
        Some(chosen)
    }
}
