//! Exports maps, frames and pictures on a thread of its own, while the window goes on.

use super::background::{Background, Task, Wake};
use super::files::free_names;
use super::filming::FilmJob;
use super::worker::BakedLevel;
use crate::error::{Error, Result};
use crate::export::map_folder::{self, MapFolder};
use crate::export::picture::{display_png, radiance_exr};
use crate::eye_pass::{Picture, View};
use crate::files;
use crate::optics::spectrum::xyz::Matrix3;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Which maps to export.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Export {
    /// One of the maps shown, by index, to a new file in the working folder.
    Map(usize),
    /// All maps with their manifest, to this folder in the working folder.
    All(PathBuf),
}

/// State of the last export.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum ExportState {
    /// Nothing has been exported yet.
    #[default]
    Idle,
    /// Maps are being written.
    Writing,
    /// Frames are being drawn and written.
    Filming {
        /// Frames written.
        done: u64,
        /// Frames in all.
        total: u64,
    },
    /// File or folder of the exported maps or frames.
    Done(PathBuf),
    /// One sentence: what failed, where, what to do.
    Failed(String),
}

impl ExportState {
    /// Whether an export is running.
    pub fn is_running(&self) -> bool {
        matches!(self, Self::Writing | Self::Filming { .. })
    }
}

/// Exports on a thread. Dropping it stops filming and waits until the files are complete.
#[derive(Debug)]
pub struct Exporter {
    /// State as of the last [`poll`](Self::poll).
    pub state: ExportState,
    work: Background<(), Result<PathBuf>>,
}

impl Exporter {
    /// An idle exporter. `wake` is called on progress and at the end of an export.
    pub fn new(wake: &Wake) -> Self {
        Self {
            state: ExportState::Idle,
            work: Background::new("export", wake),
        }
    }

    /// Starts to write maps into a working folder. Does nothing while another export runs.
    pub fn start(&mut self, export: Export, level: Arc<BakedLevel>, folder: PathBuf) {
        self.run(ExportState::Writing, move |_| write(&export, &level, &folder));
    }

    /// Starts to draw frames and write them into a new folder within a working folder. Does nothing while another
    /// export runs.
    pub fn film(&mut self, shooting: FilmJob, folder: PathBuf) {
        let total = shooting.cameras.len() as u64;
        let begun = ExportState::Filming { done: 0, total };
        self.run(begun, move |task| shooting.shoot(&folder, task, &task.control));
    }

    /// Stops filming after the present frame; frames already written stay.
    pub fn stop(&self) {
        self.work.cancel();
    }

    fn run(&mut self, begun: ExportState, write: impl FnOnce(&Task) -> Result<PathBuf> + Send + 'static) {
        if self.work.of().is_none() {
            self.state = match self.work.start((), write) {
                Ok(()) => begun,
                Err(error) => ExportState::Failed(error.to_string()),
            };
        }
    }

    /// Updates the state; returns whether an export ended since the last call.
    pub fn poll(&mut self) -> bool {
        if let (ExportState::Filming { .. }, Some((done, total))) = (&self.state, self.work.progress()) {
            self.state = ExportState::Filming { done, total };
        }
        let Some(((), outcome)) = self.work.take() else {
            return false;
        };
        self.state = match outcome {
            Some(Ok(path)) => ExportState::Done(path),
            Some(Err(error)) => ExportState::Failed(error.to_string()),
            None => ExportState::Failed("export: it ended early; report this".into()),
        };
        true
    }
}

impl Drop for Exporter {
    fn drop(&mut self) {
        self.stop();
        self.work.wait();
    }
}

fn write(export: &Export, level: &BakedLevel, folder: &Path) -> Result<PathBuf> {
    let (scene, settings) = (&level.request.scene, &level.request.settings);
    match export {
        Export::All(path) => {
            // An existing folder is overwritten only if a bake wrote it.
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

/// Default name of the folder for all maps of a scene.
pub fn folder_name(scene: &str) -> String {
    format!("nephroid-{}-maps", files::slug(scene, "scene"))
}

/// Writes `nephroid-SCENE-NNNN.png`: `picture` with the exposure and tone map of `view` and this white balance. With
/// `has_radiance`, also writes the radiance [W/(m² sr)] to `.exr`. NNNN is the first number for which neither file
/// exists. Returns the paths.
///
/// # Errors
/// The folder cannot be written; the disk is full; no number is free. No file is left behind then.
pub fn save_picture(
    folder: &Path,
    scene: &str,
    picture: &Picture,
    view: &View,
    white_balance: &Matrix3,
    has_radiance: bool,
) -> Result<Vec<PathBuf>> {
    let stem = format!("nephroid-{}", files::slug(scene, "scene"));
    let names = |number: &str| ["png", "exr"].map(|extension| format!("{stem}-{number}.{extension}"));
    let [png, exr] = free_names(folder, names)?;
    let location = png.display().to_string();
    let shown = display_png(&picture.clone().white_balanced(white_balance), view, &location)?;
    if !has_radiance {
        files::write_atomically(&png, |writer| writer.write_all(&shown))?;
        return Ok(vec![png]);
    }
    let radiance = radiance_exr(picture, &exr.display().to_string())?;
    files::write_atomically(&exr, |writer| writer.write_all(&radiance))?;
    if let Err(error) = files::write_atomically(&png, |writer| writer.write_all(&shown)) {
        // Half a pair would occupy its number. An error while removing it matters less than the first one.
        let _ = files::remove_file(&exr);
        return Err(error);
    }
    Ok(vec![png, exr])
}

/// Message about written files.
pub fn saved_in_words(files: &[PathBuf]) -> String {
    let names: Vec<_> = files.iter().map(|file| file.display().to_string()).collect();
    format!("Saved {}.", names.join(" and "))
}
