//! What the user changed, step by step, in the order in which it is taken back.

use serde_json::Value;

use super::filming::Film;
use super::panel::Display;
use crate::scene::{Edit, EditTarget, Scene};
use crate::settings::BakeSettings;

/// Steps that can be taken back: the inverse of an edit is small, but a moved mesh is kept whole.
const MOST_STEPS: usize = 1000;

/// Something that was changed, with what takes it back.
#[derive(Clone, Debug)]
pub enum Change {
    /// Of the scene: the edit that takes it back, or does it again once it was taken back.
    Scene {
        /// What it sets.
        target: EditTarget,
        /// The way back.
        inverse: Edit,
    },
    /// Of the settings of a bake.
    Settings {
        /// As they were.
        before: Box<BakeSettings>,
        /// As they are since.
        after: Box<BakeSettings>,
    },
    /// Of the camera's path.
    Film {
        /// As it was.
        before: Box<Film>,
        /// As it is since.
        after: Box<Film>,
    },
    /// Of whether changes are baked by themselves.
    Automatic {
        /// Since then.
        after: bool,
    },
    /// Of how the picture shows the maps.
    Display {
        /// As it was.
        before: Display,
        /// As it is since.
        after: Display,
    },
}

/// A change with its name.
#[derive(Clone, Debug)]
pub struct Step {
    /// What was changed, in the panel's words.
    pub text: String,
    /// What takes it back.
    pub change: Change,
}

impl Step {
    /// An edit of the scene.
    pub fn of_edit(edit: &Edit, inverse: Edit, scene: &Scene) -> Self {
        let target = edit.target();
        let text = match (edit, &inverse) {
            (Edit::LightAdded { added, .. }, _) => format!("`{}`, a new light", added.name),
            (_, Edit::LightAdded { added, .. }) => format!("removal of `{}`", added.name),
            _ => name_of(&target, scene),
        };
        Self {
            text,
            change: Change::Scene { target, inverse },
        }
    }

    /// Other settings; `None` where they are the same.
    pub fn of_settings(before: &BakeSettings, after: &BakeSettings) -> Option<Self> {
        let text = changed_settings(before, after)?;
        let (before, after) = (Box::new(before.clone()), Box::new(after.clone()));
        Some(Self {
            text,
            change: Change::Settings { before, after },
        })
    }

    /// Another way to show the maps; `None` where it is the same.
    pub fn of_display(before: Display, after: Display) -> Option<Self> {
        (before != after).then(|| Self {
            text: changed_display(&before, &after).into(),
            change: Change::Display { before, after },
        })
    }

    /// Another path for the camera.
    pub fn of_film(before: &Film, after: &Film) -> Self {
        Self {
            text: before.change_to(after).into(),
            change: Change::Film {
                before: Box::new(before.clone()),
                after: Box::new(after.clone()),
            },
        }
    }

    /// Baking by itself was switched.
    pub fn of_automatic(after: bool) -> Self {
        Self {
            text: "automatic".into(),
            change: Change::Automatic { after },
        }
    }

    /// Whether both set the same.
    fn is_of_same(&self, other: &Self) -> bool {
        match (&self.change, &other.change) {
            (Change::Scene { target: a, .. }, Change::Scene { target: b, .. }) => {
                a == b && *a != EditTarget::LightList
            }
            (Change::Settings { .. }, Change::Settings { .. })
            | (Change::Film { .. }, Change::Film { .. })
            | (Change::Display { .. }, Change::Display { .. }) => self.text == other.text,
            _ => false,
        }
    }

    /// Takes the step after this one into it: the way back leads to the same place as before.
    fn absorb(&mut self, next: Self) {
        match (&mut self.change, next.change) {
            (Change::Settings { after, .. }, Change::Settings { after: last, .. }) => *after = last,
            (Change::Display { after, .. }, Change::Display { after: last, .. }) => *after = last,
            (Change::Film { after, .. }, Change::Film { after: last, .. }) => *after = last,
            _ => {}
        }
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
    pub fn record(&mut self, step: Step) {
        self.undone.clear();
        match self.done.last_mut() {
            Some(last) if self.is_open && last.is_of_same(&step) => last.absorb(step),
            _ => {
                self.done.push(step);
                if self.done.len() > MOST_STEPS {
                    self.done.remove(0);
                }
            }
        }
        self.is_open = true;
    }

    /// The next step is one of its own.
    pub fn release(&mut self) {
        self.is_open = false;
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

    /// The newest step, to be taken back.
    pub fn take_done(&mut self) -> Option<Step> {
        self.is_open = false;
        self.done.pop()
    }

    /// The step that was taken back last, to be done again.
    pub fn take_undone(&mut self) -> Option<Step> {
        self.is_open = false;
        self.undone.pop()
    }

    /// A step was taken back.
    pub fn put_undone(&mut self, step: Step) {
        self.undone.push(step);
    }

    /// A step was done again.
    pub fn put_done(&mut self, step: Step) {
        self.done.push(step);
    }
}

/// "power of `lamp`".
fn name_of(target: &EditTarget, scene: &Scene) -> String {
    let light = |index: &usize| {
        scene
            .lights
            .get(*index)
            .map_or("light", |light| light.name.as_str())
    };
    let material = |index: &usize| {
        let found = scene.materials.get(*index);
        found.map_or("material", |material| material.name.as_str())
    };
    let object = |index: &usize| {
        let found = scene.objects.get(*index);
        found.map_or("object", |object| object.name.as_str())
    };
    let (what, whose) = match target {
        EditTarget::LightPower(index) => ("power", light(index)),
        EditTarget::LightSize(index) => ("size", light(index)),
        EditTarget::LightPosition(index) => ("position", light(index)),
        EditTarget::LightDirection(index) => ("direction", light(index)),
        EditTarget::LightColour(index) => ("colour", light(index)),
        EditTarget::MaterialIor(index) => ("refractive index", material(index)),
        EditTarget::MaterialTint(index) => ("base colour", material(index)),
        EditTarget::MaterialSubstance(index) => ("substance", material(index)),
        EditTarget::MaterialRoughness(index) => ("roughness", material(index)),
        EditTarget::MaterialWaves(index) => ("waves", material(index)),
        EditTarget::ObjectPlace(index) => ("place", object(index)),
        EditTarget::LightList => return "lights".into(),
        EditTarget::Several(targets) => {
            return targets
                .first()
                .map_or("nothing".into(), |first| name_of(first, scene));
        }
    };
    format!("{what} of `{whose}`")
}

/// The names of settings that differ; `None` where none do.
fn changed_settings(before: &BakeSettings, after: &BakeSettings) -> Option<String> {
    if before == after {
        return None;
    }
    let named = |settings| match serde_json::to_value(settings) {
        Ok(Value::Object(fields)) => fields,
        _ => serde_json::Map::new(),
    };
    let (before, after) = (named(before), named(after));
    let changed = after
        .iter()
        .filter(|(name, value)| before.get(*name) != Some(value));
    let names: Vec<String> = changed.map(|(name, _)| in_words(name)).collect();
    Some(names.join(", "))
}

/// The name of a setting without its unit.
fn in_words(name: &str) -> String {
    match name {
        "density_per_sr" => "ray density".into(),
        "max_time_s" => "max time".into(),
        "map_resolution" => "map size".into(),
        "branch_threshold" => "weakest branch".into(),
        _ => name.replace('_', " "),
    }
}

fn changed_display(before: &Display, after: &Display) -> &'static str {
    let changes = [
        (before.exposure_stops != after.exposure_stops, "exposure"),
        (before.white_balance != after.white_balance, "white balance"),
        (before.tone_map != after.tone_map, "tone map"),
        (before.layer != after.layer, "light shown"),
        (before.quantity != after.quantity, "map shown"),
    ];
    let changed = changes.into_iter().find(|(is_changed, _)| *is_changed);
    changed.map_or("display", |(_, name)| name)
}
