//! The difference between an edited scene and its file, as edits that can be saved and applied again.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{Edit, LightEdit, MaterialEdit, Scene};

/// One edit, with the name of its target: the index may differ once the file is exported again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// Name of the light, material or object.
    pub of: String,
    /// The edit itself.
    pub edit: Edit,
}

impl Change {
    /// Edits since loading, in the order of lights, removals of lights, materials and objects. Removals come after the
    /// other edits of lights and from the last index down, so that all indices stay valid.
    pub fn diff(loaded: &Scene, edited: &Scene) -> Vec<Self> {
        let mut changes = Vec::new();
        let mut push = |of: &str, edit| changes.push(Self { of: of.into(), edit });
        for (index, now) in edited.lights.iter().enumerate() {
            match edited.original_light_index(index) {
                Some(place) => {
                    for edit in LightEdit::diff(&loaded.lights[place], now) {
                        push(&now.name, Edit::Light(place, edit));
                    }
                }
                None => push(&now.name, Edit::AddLight(Arc::new(now.clone()))),
            }
        }
        for &light in edited.light_list.removed.iter().rev() {
            push(&loaded.lights[light].name, Edit::RemoveLight(light));
        }
        for (index, (was, now)) in loaded.materials.iter().zip(&edited.materials).enumerate() {
            for edit in MaterialEdit::diff(was, now) {
                push(&now.name, Edit::Material(index, edit));
            }
        }
        let mut done = None;
        for (index, (was, now)) in loaded.objects.iter().zip(&edited.objects).enumerate() {
            // Parts of a node move together and are adjacent.
            if was.motion() != now.motion() && done.replace(now.node) != Some(now.node) {
                push(&now.name, Edit::Place(index, *now.motion()));
            }
        }
        changes
    }

    /// Whether a loaded scene contains the change already, because the edited scene was saved over its file: the light
    /// to add is there, or the light to remove is not.
    pub fn is_done_in(&self, scene: &Scene) -> bool {
        let has_light = || scene.lights.iter().any(|light| light.name == self.of);
        match self.edit {
            Edit::AddLight(_) => has_light(),
            Edit::RemoveLight(_) => !has_light(),
            _ => false,
        }
    }

    /// The edit with its index adapted to `scene`: unchanged if the name at that index matches, else the only item of
    /// that name; `None` if none or several have it.
    pub fn for_scene(&self, scene: &Scene) -> Option<Edit> {
        let mut edit = self.edit.clone();
        let lights = || scene.lights.iter().map(|light| light.name.as_str());
        match &mut edit {
            Edit::AddLight(_) => {}
            Edit::Light(index, _) | Edit::RemoveLight(index) => *index = self.place(*index, lights())?,
            Edit::Material(index, _) => {
                let materials = scene.materials.iter();
                *index = self.place(*index, materials.map(|material| material.name.as_str()))?;
            }
            Edit::Place(index, _) => {
                let objects = scene.objects.iter();
                *index = self.place(*index, objects.map(|object| object.name.as_str()))?;
            }
        }
        Some(edit)
    }

    fn place<'a>(&self, index: usize, mut names: impl Iterator<Item = &'a str> + Clone) -> Option<usize> {
        if names.clone().nth(index) == Some(&self.of) {
            return Some(index);
        }
        let found = names.position(|name| name == self.of)?;
        // `position` has consumed the first match; a second one makes the name ambiguous.
        (!names.any(|name| name == self.of)).then_some(found)
    }
}
