//! What is saved of a scene's camera, settings and edits, and how it is restored.

use std::sync::Arc;
use std::time::Instant;

use serde_json::Value;

use super::Model;
use crate::scene::changes::Change;
use crate::settings::BakeSettings;
use crate::viewer::files::autosaver::Snapshot;
use crate::viewer::files::config::SavedState;
use crate::viewer::files::config::full_source;
use serde_json::json;

/// Which parts of a saved state are restored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RestoredParts {
    pub settings: bool,
    /// Bookmarks are always restored.
    pub camera: bool,
    pub exposure: bool,
    pub edits: bool,
}

/// Saved state that was not restored. It is saved again until the user changes it, so that a look at other maps loses
/// no edits.
#[derive(Debug, Default)]
pub(super) struct IgnoredState {
    changes: Vec<Change>,
    /// The settings given on the command line, and the saved settings that they override.
    settings: Option<(BakeSettings, Value)>,
}

impl RestoredParts {
    pub(super) const ALL: Self = Self {
        settings: true,
        camera: true,
        exposure: true,
        edits: true,
    };
}

impl Model {
    /// The state to save.
    fn snapshot(&self) -> Snapshot {
        Snapshot {
            kept: SavedState {
                source: self.full_source.clone(),
                views: self.navigator.views(),
                settings: self.settings_to_keep(),
                display: self.choices.display,
                film: self.choices.film.clone(),
                automatic: Some(self.choices.automatic),
                watch: self.choices.watches,
                changes: self.left_alone.changes.clone(),
            },
            loaded: Arc::clone(self.edits.loaded()),
            edited: Arc::clone(self.edits.scene()),
        }
    }

    /// The panel's settings. If the command line overrode saved settings and they have not been changed since, the
    /// saved ones.
    fn settings_to_keep(&self) -> Value {
        match &self.left_alone.settings {
            Some((given, kept)) if *given == self.choices.settings => kept.clone(),
            _ => serde_json::to_value(&self.choices.settings).unwrap_or_default(),
        }
    }

    /// Hands the present state to the autosaver.
    pub(super) fn keep(&mut self, now: Instant) {
        if self.files.autosaver.is_some() {
            let snapshot = self.snapshot();
            if let Some(autosaver) = &mut self.files.autosaver {
                autosaver.look(snapshot, now);
            }
        }
    }

    /// Restores the saved state of the scene, as far as wanted; returns whether there was one.
    pub(super) fn restore_saved_state(&mut self, what: Option<RestoredParts>) -> bool {
        self.full_source = full_source(&self.edits.loaded().source);
        let (kept, warning) = match what {
            Some(_) => self.files.read_back(&self.full_source),
            None => (None, None),
        };
        if let Some(sentence) = &warning {
            log::warn!("{sentence}");
            self.files.warning = warning;
        }
        self.left_alone = IgnoredState::default();
        if let (Some(kept), Some(what)) = (&kept, what) {
            self.restore(kept, what);
            if !what.edits {
                self.left_alone.changes.clone_from(&kept.changes);
            }
            if !what.settings {
                self.left_alone.settings = Some((self.choices.settings.clone(), kept.settings.clone()));
            }
            self.log.write("found_again", json!({"source": self.full_source}));
        }
        let snapshot = self.snapshot();
        if let Some(autosaver) = &mut self.files.autosaver {
            autosaver.begin(snapshot);
        }
        kept.is_some()
    }

    fn restore(&mut self, kept: &SavedState, what: RestoredParts) {
        if what.settings {
            self.choices.settings = kept.settings_or(&self.choices.settings);
            self.choices.automatic = kept.automatic.unwrap_or(true);
        }
        self.navigator.restore(&kept.views, what.camera);
        self.choices.watches |= kept.watch;
        let exposure_stops = self.choices.display.exposure_stops;
        self.choices.display = kept.display;
        self.choices.film = kept.film.clone();
        if !what.exposure {
            self.choices.display.exposure_stops = exposure_stops;
        }
        if what.edits {
            self.edit_again(&kept.changes);
        }
    }

    /// Applies saved edits again, each as an undo step of its own; warns about edits whose target the file no longer
    /// has.
    pub(super) fn edit_again(&mut self, changes: &[Change]) {
        let mut lost = Vec::new();
        let loaded = Arc::clone(self.edits.loaded());
        for change in changes.iter().filter(|change| !change.is_done_in(&loaded)) {
            let edit = change.for_scene(&loaded);
            let is_done = edit.is_some_and(|edit| self.edits.edit(&edit).is_ok());
            self.edits.release();
            if !is_done && !lost.contains(&change.of) {
                lost.push(change.of.clone());
            }
        }
        if !lost.is_empty() {
            let names = lost.join("`, `");
            self.files.warning = Some(format!(
                "What was edited of `{names}` is left out, since the file is another one now."
            ));
        }
    }
}
