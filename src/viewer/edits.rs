//! Undo and redo: the user's changes of the scene and of the settings, step by step.

use std::mem::discriminant;
use std::sync::Arc;

use serde::Serialize;

use super::filming::Film;
use super::panel::Display;
use crate::error::Result;
use crate::scene::{Edit, EditState, Scene};
use crate::settings::BakeSettings;

/// Steps that can be taken back.
const MAX_STEPS: usize = 1000;

/// A scene with its history, and that of the settings it is baked and shown with.
#[derive(Clone, Debug)]
pub struct EditedScene {
    loaded: Arc<Scene>,
    scene: Arc<Scene>,
    /// Of the loaded scene, and of the edited one.
    states: [Arc<EditState>; 2],
    history: History,
}

/// One of the things that a step changes, as it was before the step or as it is since.
#[derive(Clone, Debug)]
pub enum EditedItem {
    Scene(Arc<EditState>),
    Settings(Box<BakeSettings>),
    /// The camera's path.
    Film(Box<Film>),
    /// Whether changes are baked by themselves.
    Automatic(bool),
    /// How the picture shows the maps.
    Display(Display),
}

#[derive(Clone, Debug)]
struct Step {
    /// What was changed, in the panel's words.
    text: String,
    /// What of the scene.
    target: Option<String>,
    before: EditedItem,
    after: EditedItem,
}

impl Step {
    /// Whether a drag that did this step goes on in the next one.
    fn goes_on_in(&self, next: &Self) -> bool {
        let is_of_same = discriminant(&self.after) == discriminant(&next.after)
            && self.text == next.text
            && self.target == next.target;
        is_of_same
            && !matches!(self.after, EditedItem::Automatic(_))
            && self.target.as_deref() != Some("LightList")
    }
}

/// Steps that were done, and steps that were taken back and can be done again.
#[derive(Clone, Debug, Default)]
pub struct History {
    done: Vec<Step>,
    undone: Vec<Step>,
    /// Whether the newest step still goes on: the mouse is down, or a number is being typed.
    is_open: bool,
}

impl History {
    /// Adds a step. Steps of the same while one goes on are taken back together; what was taken back is forgotten.
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

    /// Steps that can be taken back.
    pub fn undoable(&self) -> usize {
        self.done.len()
    }

    /// What would be taken back.
    pub fn next_undo(&self) -> Option<&str> {
        self.done.last().map(|step| step.text.as_str())
    }

    /// What would be done again.
    pub fn next_redo(&self) -> Option<&str> {
        self.undone.last().map(|step| step.text.as_str())
    }
}

impl EditedScene {
    /// Nothing is edited yet.
    pub fn new(scene: Arc<Scene>) -> Self {
        let state = Arc::new(EditState::of(&scene));
        Self {
            loaded: Arc::clone(&scene),
            scene,
            states: [Arc::clone(&state), state],
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
    /// What the edit is refused for; nothing is changed then.
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

    fn note(&mut self, text: String, before: EditedItem, after: EditedItem) {
        self.history.record(Step {
            text,
            target: None,
            before,
            after,
        });
    }

    /// Notes that settings were changed, if they were.
    pub fn note_settings(&mut self, before: &BakeSettings, after: &BakeSettings) {
        if before != after {
            let parts = [before, after].map(|settings| EditedItem::Settings(Box::new(settings.clone())));
            let [from, to] = parts;
            self.note(changed(before, after), from, to);
        }
    }

    /// Notes that the maps are shown in another way, if they are.
    pub fn note_display(&mut self, before: Display, after: Display) {
        if before != after {
            self.note(
                changed(&before, &after),
                EditedItem::Display(before),
                EditedItem::Display(after),
            );
        }
    }

    /// Notes another path for the camera.
    pub fn note_film(&mut self, before: &Film, after: &Film) {
        let [from, to] = [before, after].map(|film| EditedItem::Film(Box::new(film.clone())));
        self.note(before.change_to(after).into(), from, to);
    }

    /// Notes that baking by itself was switched.
    pub fn note_automatic(&mut self, after: bool) {
        self.note(
            "automatic".into(),
            EditedItem::Automatic(!after),
            EditedItem::Automatic(after),
        );
    }

    /// The next step is one of its own.
    pub fn release(&mut self) {
        self.history.is_open = false;
    }

    /// Takes the newest step back, or does the one again that was taken back last: its name, and what was changed, from
    /// what to what. The scene is changed here.
    pub fn turn(&mut self, is_back: bool) -> Option<(String, [EditedItem; 2])> {
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

/// The names of fields that differ, without their units.
fn changed<T: Serialize>(before: &T, after: &T) -> String {
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
