//! The scene that the user edits, with the history of everything that can be taken back.

use std::sync::Arc;

use super::filming::Film;
use super::history::{Change, History, Step};
use super::panel::Display;
use crate::error::Result;
use crate::scene::{Edit, Scene};
use crate::settings::BakeSettings;

/// A scene with its history, and that of the settings it is baked and shown with.
#[derive(Clone, Debug)]
pub struct EditedScene {
    loaded: Arc<Scene>,
    scene: Arc<Scene>,
    history: History,
}

/// What the panel is to be set to once a step was taken back or done again.
#[derive(Clone, Debug, PartialEq)]
pub enum Restored {
    /// Nothing: the scene was changed.
    Scene,
    /// These settings.
    Settings(Box<BakeSettings>),
    /// This path of the camera.
    Film(Box<Film>),
    /// Whether changes are baked by themselves.
    Automatic(bool),
    /// What differs between both, to what it is in the second.
    Display(Display, Display),
}

impl EditedScene {
    /// Nothing is edited yet.
    pub fn new(scene: Arc<Scene>) -> Self {
        Self {
            loaded: Arc::clone(&scene),
            scene,
            history: History::default(),
        }
    }

    /// As it is now.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// As it was before every edit.
    pub fn loaded(&self) -> &Arc<Scene> {
        &self.loaded
    }

    /// What can be taken back and done again.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// Edits the scene. Edits of one target while the mouse is down are taken back together.
    ///
    /// # Errors
    /// As [`Edit::apply`]: the scene stays.
    pub fn edit(&mut self, edit: &Edit) -> Result<()> {
        let (scene, inverse) = edit.apply(&self.scene)?;
        self.scene = Arc::new(scene);
        self.history.record(Step::of_edit(edit, inverse, &self.scene));
        Ok(())
    }

    /// Notes that settings were changed in the panel.
    pub fn note_settings(&mut self, before: &BakeSettings, after: &BakeSettings) {
        if let Some(step) = Step::of_settings(before, after) {
            self.history.record(step);
        }
    }

    /// Notes that the maps are shown otherwise.
    pub fn note_display(&mut self, before: Display, after: Display) {
        if let Some(step) = Step::of_display(before, after) {
            self.history.record(step);
        }
    }

    /// Notes that the camera's path is another one.
    pub fn note_film(&mut self, before: &Film, after: &Film) {
        self.history.record(Step::of_film(before, after));
    }

    /// Notes that changes are baked by themselves from now on, or no longer.
    pub fn note_automatic(&mut self, after: bool) {
        self.history.record(Step::of_automatic(after));
    }

    /// The mouse is up: the next edit is one of its own.
    pub fn release(&mut self) {
        self.history.release();
    }

    /// Takes the last step back; `None` where there was none. With its name and what is left to be restored.
    ///
    /// # Errors
    /// As [`Edit::apply`].
    pub fn undo(&mut self) -> Result<Option<(String, Restored)>> {
        let Some(step) = self.history.take_done() else {
            return Ok(None);
        };
        let (step, restored) = self.turn(step, true)?;
        let text = step.text.clone();
        self.history.put_undone(step);
        Ok(Some((text, restored)))
    }

    /// Does again what was taken back last; `None` where there was nothing. As [`undo`](Self::undo).
    ///
    /// # Errors
    /// As [`Edit::apply`].
    pub fn redo(&mut self) -> Result<Option<(String, Restored)>> {
        let Some(step) = self.history.take_undone() else {
            return Ok(None);
        };
        let (step, restored) = self.turn(step, false)?;
        let text = step.text.clone();
        self.history.put_done(step);
        Ok(Some((text, restored)))
    }

    /// Goes a step back or forth; gives the step for the other way.
    fn turn(&mut self, step: Step, is_back: bool) -> Result<(Step, Restored)> {
        let (change, restored) = match step.change {
            Change::Scene { target, inverse } => {
                let (scene, inverse) = inverse.apply(&self.scene)?;
                self.scene = Arc::new(scene);
                (Change::Scene { target, inverse }, Restored::Scene)
            }
            Change::Settings { before, after } => {
                let to = if is_back { before.clone() } else { after.clone() };
                (Change::Settings { before, after }, Restored::Settings(to))
            }
            Change::Film { before, after } => {
                let to = if is_back { before.clone() } else { after.clone() };
                (Change::Film { before, after }, Restored::Film(to))
            }
            Change::Automatic { after } => {
                (Change::Automatic { after }, Restored::Automatic(after != is_back))
            }
            Change::Display { before, after } => {
                let (from, to) = if is_back { (after, before) } else { (before, after) };
                (Change::Display { before, after }, Restored::Display(from, to))
            }
        };
        let text = step.text;
        Ok((Step { text, change }, restored))
    }
}
