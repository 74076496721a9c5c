//! Undo and redo: the user's changes of the scene and of the settings, step by step.

use std::sync::Arc;

use serde::Deserialize;
use serde_json::Value;

use super::command::Choices;
use crate::error::Result;
use crate::scene::{Edit, EditState, Scene};

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

/// Parts of the choices whose changes are undone, each by steps of its own.
const PARTS: [&str; 4] = ["settings", "display", "film", "automatic"];

/// The thing that a step changes, as it was before or after the step.
#[derive(Clone, Debug)]
enum End {
    Scene(Arc<EditState>),
    /// Fields of the choices by their JSON pointers.
    Choices(Vec<(String, Value)>),
}

#[derive(Clone, Debug)]
struct Step {
    /// What was changed, in the panel's words.
    text: String,
    /// The edited part of the scene, or the part of the choices.
    target: String,
    before: End,
    after: End,
}

impl Step {
    /// Whether `next` continues the same drag.
    fn goes_on_in(&self, next: &Self) -> bool {
        let is_whole = ["LightList", "automatic"].contains(&self.target.as_str());
        self.text == next.text && self.target == next.target && !is_whole
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
            target: edit.target(),
            before: End::Scene(before),
            after: End::Scene(after),
        });
        self.scene = Arc::new(scene);
        Ok(())
    }

    /// Records what differs between two choices.
    pub fn note(&mut self, before: &Choices, after: &Choices) {
        let [before, after] = [before, after].map(to_json);
        for part in PARTS.into_iter().filter(|part| before[part] != after[part]) {
            let mut changed: Vec<String> = match &after[part] {
                Value::Object(fields) => fields.keys().map(|name| format!("/{part}/{name}")).collect(),
                _ => vec![format!("/{part}")],
            };
            changed.retain(|path| before.pointer(path) != after.pointer(path));
            let end = |choices: &Value| {
                let value = |path: &String| choices.pointer(path).cloned().unwrap_or_default();
                End::Choices(changed.iter().map(|path| (path.clone(), value(path))).collect())
            };
            self.history.record(Step {
                text: in_words(part, &changed),
                target: part.into(),
                before: end(&before),
                after: end(&after),
            });
        }
    }

    /// Closes the newest step: the next change is a step of its own.
    pub fn release(&mut self) {
        self.history.is_open = false;
    }

    /// Undoes the newest step, or redoes the last undone one, in the scene or in the choices. Fields of the choices that
    /// the step did not change stay as they are. Returns its name.
    pub fn step(&mut self, is_back: bool, choices: &mut Choices) -> Option<String> {
        let History {
            done,
            undone,
            is_open,
        } = &mut self.history;
        *is_open = false;
        let (from, to) = if is_back { (done, undone) } else { (undone, done) };
        let step = from.pop()?;
        let end = if is_back { &step.before } else { &step.after };
        match end {
            End::Scene(state) => {
                self.scene = match Arc::ptr_eq(state, &self.states[0]) {
                    true => Arc::clone(&self.loaded),
                    false => Arc::new(state.set(&self.scene)),
                };
                self.states[1] = Arc::clone(state);
            }
            End::Choices(fields) => set(choices, fields),
        }
        let text = step.text.clone();
        to.push(step);
        Some(text)
    }
}

fn to_json(choices: &Choices) -> Value {
    serde_json::to_value(choices).unwrap_or_default()
}

fn set(choices: &mut Choices, fields: &[(String, Value)]) {
    let mut json = to_json(choices);
    for (path, value) in fields {
        if let Some(field) = json.pointer_mut(path) {
            field.clone_from(value);
        }
    }
    match Choices::deserialize(json) {
        Ok(set) => {
            *choices = Choices {
                settings: set.settings,
                display: set.display,
                film: set.film,
                automatic: set.automatic,
                ..*choices
            };
        }
        Err(error) => log::warn!("the history cannot be followed: {error}"),
    }
}

/// Names of changed fields of a part, without their units.
fn in_words(part: &str, changed: &[String]) -> String {
    if part == "film" {
        let has_keys = changed.iter().any(|path| path == "/film/keys");
        return format!(
            "{} of the camera's path",
            if has_keys { "keys" } else { "frames" }
        );
    }
    let name = |path: &String| match path.rsplit('/').next().unwrap_or_default() {
        "density_per_sr" => "ray density".into(),
        "max_time_s" => "max time".into(),
        "map_resolution" => "map size".into(),
        "branch_threshold" => "weakest branch".into(),
        "exposure_stops" => "exposure".into(),
        "layer" => "light shown".into(),
        "quantity" => "map shown".into(),
        name => name.replace('_', " "),
    };
    changed.iter().map(name).collect::<Vec<String>>().join(", ")
}
