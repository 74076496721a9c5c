//! Maps and frames as files, written by a thread: the window goes on.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::JoinHandle;

use super::background::Wake;
use super::files::free_names;
use super::filming::Shooting;
use super::worker::BakedLevel;
use crate::error::{Error, Result};
use crate::export::map_folder::{self, MapFolder};
use crate::files;
use crate::progress::{Control, Progress, Stage};

/// Which maps are to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Export {
    /// One of the maps that are shown, to a file of its own in the working folder.
    Map(usize),
    /// All of them with their manifest, to a folder of their own.
    All(PathBuf),
}

/// How the last export got on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum ExportState {
    /// Nothing was exported yet.
    #[default]
    Idle,
    /// The thread writes maps.
    Writing,
    /// The thread draws and writes frames.
    Filming {
        /// Frames that are written.
        done: u64,
        /// Frames that there will be.
        total: u64,
    },
    /// Where the maps or frames are: a file or a folder.
    Done(PathBuf),
    /// One sentence: what failed, where, what to do.
    Failed(String),
}

impl ExportState {
    /// Whether the thread is at work.
    pub fn is_running(&self) -> bool {
        matches!(self, Self::Writing | Self::Filming { .. })
    }
}

/// Where the thread tells how it gets on.
struct Told {
    states: Sender<ExportState>,
    wake: Wake,
}

impl Told {
    fn tell(&self, state: ExportState) {
        // Nobody listens any more only where the window is gone.
        let _ = self.states.send(state);
        (self.wake.0)();
    }
}

impl Progress for Told {
    fn advance(&self, _: Stage, done: u64, total: u64) {
        self.tell(ExportState::Filming { done, total });
    }
}

/// The thread, while there is one. Dropping it stops what is filmed and waits until files are whole.
#[derive(Debug)]
pub struct Exporter {
    /// How the last export got on, as of the last [`poll`](Self::poll).
    pub state: ExportState,
    running: Option<(JoinHandle<()>, Receiver<ExportState>)>,
    control: Arc<Control>,
    wake: Wake,
}

impl Exporter {
    /// Nothing is written yet. `wake` is called from the thread when it is done.
    pub fn new(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        Self {
            state: ExportState::Idle,
            running: None,
            control: Arc::default(),
            wake: Wake(wake),
        }
    }

    /// Writes maps into a working folder. Does nothing while anything is written.
    pub fn start(&mut self, export: Export, level: Arc<BakedLevel>, folder: PathBuf) {
        self.run(ExportState::Writing, move |_, _| write(&export, &level, &folder));
    }

    /// Draws frames and writes them into a folder within a working folder. Does nothing while anything is written.
    pub fn film(&mut self, shooting: Shooting, folder: PathBuf) {
        let total = shooting.cameras.len() as u64;
        let begun = ExportState::Filming { done: 0, total };
        self.run(begun, move |told, control| shooting.shoot(&folder, told, control));
    }

    /// Stops what is being filmed after the present frame; those that are written stay.
    pub fn stop(&self) {
        self.control.cancel();
    }

    fn run(
        &mut self,
        begun: ExportState,
        write: impl FnOnce(&Told, &Control) -> Result<PathBuf> + Send + 'static,
    ) {
        if self.running.is_some() {
            return;
        }
        let (sender, receiver) = channel();
        self.control = Arc::default();
        let control = Arc::clone(&self.control);
        let told = Told {
            states: sender,
            wake: self.wake.clone(),
        };
        let work = move || {
            told.tell(match write(&told, &control) {
                Ok(path) => ExportState::Done(path),
                Err(error) => ExportState::Failed(error.to_string()),
            });
        };
        match std::thread::Builder::new().name("export".into()).spawn(work) {
            Ok(thread) => {
                self.running = Some((thread, receiver));
                self.state = begun;
            }
            Err(error) => {
                self.state = ExportState::Failed(format!("export: the system gives no thread: {error}"))
            }
        }
    }

    /// Looks what the thread did; tells whether it ended since the last call.
    pub fn poll(&mut self) -> bool {
        let Some((_, receiver)) = &self.running else {
            return false;
        };
        loop {
            match receiver.try_recv() {
                Ok(state) => self.state = state,
                Err(TryRecvError::Empty) if self.state.is_running() => return false,
                // What it told last stays.
                Err(_) if !self.state.is_running() => break,
                Err(_) => {
                    self.state = ExportState::Failed("export: it ended early; report this".into());
                    break;
                }
            }
        }
        self.running = None;
        true
    }
}

impl Drop for Exporter {
    fn drop(&mut self) {
        self.stop();
        if let Some((thread, _)) = self.running.take()
            && thread.join().is_err()
        {
            log::error!("the exporting thread panicked");
        }
    }
}

fn write(export: &Export, level: &BakedLevel, folder: &Path) -> Result<PathBuf> {
    let (scene, settings) = (&level.request.scene, &level.request.settings);
    match export {
        Export::All(path) => {
            // One that is there already belongs to others unless a bake wrote it.
            let path = folder.join(path);
            MapFolder::open(&path, false)?.write(scene, settings, &level.result)?;
            Ok(path)
        }
        Export::Map(index) => {
            let gone = || Error::failure("export", "the map is not there any more", "export it again");
            let map = level.result.maps.get(*index).ok_or_else(gone)?;
            let stem = format!(
                "nephroid-{}-{}",
                files::slug(&scene.name, "scene"),
                map_folder::stem(scene, map)
            );
            let [path] = free_names(folder, |number| [format!("{stem}-{number}.exr")])?;
            map_folder::write_map(&path, scene, settings, map, &level.result)?;
            Ok(path)
        }
    }
}

/// The folder that all maps of a scene go to unless another is named.
pub fn folder_name(scene: &str) -> String {
    format!("nephroid-{}-maps", files::slug(scene, "scene"))
}
