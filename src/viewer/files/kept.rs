//! What is kept of a scene for the next time: how it was looked at, how it was baked, and what was edited.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::scene::Camera;
use crate::scene::changes::Change;
use crate::settings::BakeSettings;
use crate::viewer::filming::Film;
use crate::viewer::navigation::{BOOKMARKS, Travel};
use crate::viewer::panel::Display;

/// From where a scene is seen, and how the camera gets about.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct KeptViews {
    /// `None` for the file's first.
    pub camera: Option<Camera>,
    /// How it gets about.
    pub travel: Travel,
    /// Views under the numbers from 1 on.
    pub bookmarks: [Option<Camera>; BOOKMARKS],
}

/// All that is kept of a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Kept {
    /// The file by its full path, or `builtin:NAME`: for who reads the folder.
    pub source: String,
    /// Camera and bookmarks.
    pub views: KeptViews,
    /// Of the bake, by their names: a later version may have more of them, and others.
    pub settings: Value,
    /// Of the picture.
    pub display: Display,
    /// The camera's path.
    pub film: Film,
    /// Whether a change is baked by itself.
    pub automatic: Option<bool>,
    /// Whether the scene is read again when its files change.
    pub watch: bool,
    /// Edits of what was loaded.
    pub changes: Vec<Change>,
}

impl Kept {
    /// Settings as they were kept; those that this version does not know, or that are outside their ranges, are left as
    /// `otherwise` has them.
    pub fn settings_or(&self, otherwise: &BakeSettings) -> BakeSettings {
        let (Value::Object(kept), Ok(mut known)) = (&self.settings, serde_json::to_value(otherwise)) else {
            return otherwise.clone();
        };
        for (name, value) in kept {
            let Some(place) = known.get_mut(name) else {
                continue;
            };
            let before = std::mem::replace(place, value.clone());
            let is_read = BakeSettings::deserialize(&known).is_ok();
            if !is_read && let Some(place) = known.get_mut(name) {
                *place = before;
            }
        }
        let settings = BakeSettings::deserialize(&known).ok();
        settings
            .filter(|settings| settings.validate().is_ok())
            .unwrap_or_else(|| otherwise.clone())
    }
}
