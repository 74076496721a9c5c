//! Scenes that are opened, dropped, reloaded or saved while the window is open.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::App;
use crate::error::{Error, Result};
use crate::scene::load::{skies_beside, was_dark};
use crate::viewer::exporting;
use crate::viewer::exposure::AutoExposure;
use crate::viewer::files::{Choice, LoadPurpose, NO_DIALOG, free_names, working_folder};
use crate::viewer::model::Model;
use crate::viewer::panel::Quantity;

/// Notice for a file without light.
pub(super) fn dark_notice(model: &Model) -> Option<String> {
    let loaded = model.edits().loaded();
    was_dark(loaded).then(|| {
        let mut notice =
            "The scene has no light: a sun and a clear sky were added. Section Scene adds lamps and changes these."
                .to_owned();
        if let Some(option) = skies_beside(&loaded.source).first() {
            notice += &format!(" The sky beside the file lights it with {option}.");
        }
        notice
    })
}

impl App {
    /// Handles chosen, loaded and saved files since the last frame.
    pub(super) fn poll_files(&mut self) {
        match self.dialog.take() {
            Some((Choice::Open, Some(path))) => self.model.open(&path.display().to_string()),
            Some((Choice::SaveScene, Some(path))) => self.save_scene_as(path),
            Some((Choice::Open, None)) => self.model.files.refusal = Some(NO_DIALOG.to_owned()),
            // Saved next to the original, where it is easily found; the notice names the path.
            Some((Choice::SaveScene, None)) => {
                let original = self.original();
                let stem = original.file_stem().unwrap_or_default().to_string_lossy();
                let folder = original.parent().unwrap_or(Path::new(""));
                match free_names(folder, |number| [format!("{stem}-edited-{number}.glb")]) {
                    Ok([path]) => self.save_scene_as(path),
                    Err(error) => self.tell_unsaved(&error.to_string()),
                }
            }
            None => {}
        }
        if let Some(purpose) = self.model.poll_files() {
            self.begin_scene(purpose);
        }
        if let Some(saved) = self.model.files.take_saved() {
            self.tell_saved(saved.map(|path| vec![path]));
        }
    }

    /// Opens the system's file dialog.
    pub(super) fn ask_for_file(&mut self, choice: Choice) {
        let original = self.original();
        if let Some(graphics) = &self.graphics {
            self.dialog.ask(choice, graphics.window(), &original);
        }
    }

    pub(super) fn drop_file(&mut self, path: &Path) {
        self.notice = None;
        self.model.open(&path.display().to_string());
        self.request_redraw();
    }

    /// Path of the present scene.
    fn original(&self) -> PathBuf {
        PathBuf::from(&self.model.edits().loaded().source)
    }

    fn save_scene_as(&mut self, mut path: PathBuf) {
        if path.extension().is_none() {
            path.set_extension("glb");
        }
        if let Err(error) = self.model.save_scene(path) {
            self.tell_unsaved(&error.to_string());
        }
    }

    fn tell_saved(&mut self, saved: Result<Vec<PathBuf>>) {
        match saved {
            Ok(files) => {
                self.model.log.write("saved", json!({"files": files}));
                self.notice = Some(exporting::saved_in_words(&files));
            }
            Err(error) => self.tell_unsaved(&error.to_string()),
        }
    }

    fn tell_unsaved(&mut self, sentence: &str) {
        self.model.log.write("not_saved", json!({"sentence": sentence}));
        self.notice = Some(sentence.to_owned());
    }

    /// Updates the window after another scene was loaded or the same one reloaded.
    fn begin_scene(&mut self, purpose: LoadPurpose) {
        if purpose == LoadPurpose::Open {
            self.notice = dark_notice(&self.model);
            self.exposure = AutoExposure::new(!self.model.exposure_is_kept);
        }
        if let Some(graphics) = &self.graphics {
            let name = &self.model.scene().name;
            graphics.window().set_title(&format!("Nephroid – {name}"));
        }
    }

    /// Writes the picture to files in the working folder, and shows their paths.
    pub(super) fn save_picture(&mut self) {
        let saved = self.written_picture();
        self.tell_saved(saved);
        self.request_redraw();
    }

    fn written_picture(&mut self) -> Result<Vec<PathBuf>> {
        let white_balance = self.white_balance();
        let (Some(view), Some(graphics)) = (self.view(), &mut self.graphics) else {
            return Err(Error::failure(
                "picture",
                "the window has no room for it",
                "make the window larger",
            ));
        };
        let picture = graphics.radiance(&view)?;
        let folder = working_folder();
        // False colours are not radiance.
        let has_radiance = self.model.quantity() == Quantity::Light;
        let scene = &self.model.scene().name;
        exporting::save_picture(&folder, scene, &picture, &view, &white_balance, has_radiance)
    }
}
