//! Undo and redo: the user's changes of the scene and of the settings, step by step.

use std::mem::discriminant;
use std::sync::Arc;

use serde::Serialize;

use super::filming::Film;
use super::panel::Display;
use crate::error::Result;
use crate::scene::{Edit, EditState, Scene};
use crate::settings::BakeSettings;

/// Limit of undo steps.
const MAX_STEPS: usize = 1000;

/// A scene with its undo history, which includes the settings it is baked and shown with.
#[derive(Clone, Debug)]
pub struct EditedScene {
    loaded: Arc<Scene>,
    scene: Arc<Scene>,
    /// Edit states of the loaded scene and of the edited one.
    states: [Arc<EditState>; 2],
    history: History,
}

/// State of one of the things that a step changes, before or after the step.
#[derive(Clone, Debug)]
pub enum EditedItem {
    Scene(Arc<EditState>),
    Settings(Box<BakeSettings>),
    Film(Box<Film>),
    /// Whether changes are baked automatically.
    Automatic(bool),
    Display(Display),
}

#[derive(Clone, Debug)]
struct Step {
    /// What was changed, in the panel's words.
    text: String,
    /// The edited part of the scene; `None` if the step changes none.
    target: Option<String>,
    before: EditedItem,
    after: EditedItem,
}

impl Step {
    /// Whether `next` continues the same drag.
    fn goes_on_in(&self, next: &Self) -> bool {
        let is_of_same = discriminant(&self.after) == discriminant(&next.after)
            && self.text == next.text
            && self.target == next.target;
        is_of_same
            && !matches!(self.after, EditedItem::Automatic(_))
            && self.target.as_deref() != Some("LightList")
    }
}

/// Undo and redo steps.
#[derive(Clone, Debug, Default)]
pub struct History {
    done: Vec<Step>,
    undone: Vec<Step>,
    /// Whether the newest step may still be extended: the mouse is down, or a number is being typed.
    is_open: bool,
}

impl History {
    /// Adds a step, or extends the newest one if that is still open and changes the same thing. Clears the redo
    /// steps.
    fn record(&mut self, step: Step) {
        self.undone.clear();
        match self.done.last_mut() {
            Some(last) if self.is_open && last.goes_on_in(&step) => last.after = step.after,
            _ => {
                self.done.push(step);
                if self.done.len() > MAX_STEPS {
                    self.done.remove(0);
                }
            }
        }
        self.is_open = true;
    }

    /// Number of steps that can be undone.
    pub fn undoable(&self) -> usize {
        self.done.len()
    }

    /// Name of the step that would be undone.
    pub fn next_undo(&self) -> Option<&str> {
        self.done.last().map(|step| step.text.as_str())
    }

    /// Name of the step that would be redone.
    pub fn next_redo(&self) -> Option<&str> {
        self.undone.last().map(|step| step.text.as_str())
    }
}

impl EditedScene {
    pub fn new(scene: Arc<Scene>) -> Self {
        let state = Arc::new(EditState::of(&scene));
        Self {
            loaded: Arc::clone(&scene),
            scene,
            states: [Arc::clone(&state), state],
            history: History::default(),
        }
    }

    /// The edited scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The scene as loaded.
    pub fn loaded(&self) -> &Arc<Scene> {
        &self.loaded
    }

    pub fn history(&self) -> &History {
        &self.history
    }

    /// Applies an edit. Edits of one target while the mouse is down form one undo step.
    ///
    /// # Errors
    /// As [`Edit::apply`]; nothing is changed then.
    pub fn edit(&mut self, edit: &Edit) -> Result<()> {
        let scene = edit.apply(&self.scene)?;
        let after = Arc::new(EditState::of(&scene));
        let before = std::mem::replace(&mut self.states[1], Arc::clone(&after));
        self.history.record(Step {
            text: edit.in_words(&self.scene),
            target: Some(edit.target()),
            before: EditedItem::Scene(before),
            after: EditedItem::Scene(after),
        });
        self.scene = Arc::new(scene);
        Ok(())
    }

    /// Records a change of a part of the choices, if there is one; `text` names it.
    pub fn note<T: Clone + PartialEq>(
        &mut self,
        [before, after]: [&T; 2],
        text: impl FnOnce(&T, &T) -> String,
        item: impl Fn(T) -> EditedItem,
    ) {
        if before != after {
            self.history.record(Step {
                text: text(before, after),
                target: None,
                before: item(before.clone()),
                after: item(after.clone()),
            });
        }
    }

    /// Records a change of the settings, if there is one.
    pub fn note_settings(&mut self, before: &BakeSettings, after: &BakeSettings) {
        self.note([before, after], changed, |settings| {
            EditedItem::Settings(Box::new(settings))
        });
    }

    /// Records a change of the camera path, if there is one.
    pub fn note_film(&mut self, before: &Film, after: &Film) {
        let text = |before: &Film, after: &Film| before.change_to(after).to_owned();
        self.note([before, after], text, |film| EditedItem::Film(Box::new(film)));
    }

    /// Closes the newest step: the next change is a step of its own.
    pub fn release(&mut self) {
        self.history.is_open = false;
    }

    /// Undoes the newest step, or redoes the last undone one. Returns its name and the state before and after; a
    /// change of the scene is already applied.
    pub fn step(&mut self, is_back: bool) -> Option<(String, [EditedItem; 2])> {
        let History {
            done,
            undone,
            is_open,
        } = &mut self.history;
        *is_open = false;
        let (from, to) = if is_back { (done, undone) } else { (undone, done) };
        let step = from.pop()?;
        let mut parts = [step.before.clone(), step.after.clone()];
        if is_back {
            parts.reverse();
        }
        if let EditedItem::Scene(state) = &parts[1] {
            self.scene = match Arc::ptr_eq(state, &self.states[0]) {
                true => Arc::clone(&self.loaded),
                false => Arc::new(state.set(&self.scene)),
            };
            self.states[1] = Arc::clone(state);
        }
        let text = step.text.clone();
        to.push(step);
        Some((text, parts))
    }
}

/// Names of the fields that differ, without their units.
pub fn changed<T: Serialize>(before: &T, after: &T) -> String {
    let [before, after] = [before, after].map(|part| serde_json::to_value(part).unwrap_or_default());
    let fields = after.as_object().into_iter().flatten();
    let changed = fields.filter(|(name, value)| before.get(name) != Some(value));
    let words = changed.map(|(name, _)| match name.as_str() {
        "density_per_sr" => "ray density".into(),
        "max_time_s" => "max time".into(),
        "map_resolution" => "map size".into(),
        "branch_threshold" => "weakest branch".into(),
        "exposure_stops" => "exposure".into(),
        "layer" => "light shown".into(),
        "quantity" => "map shown".into(),
        _ => name.replace('_', " "),
    });
    words.collect::<Vec<String>>().join(", ")
}
