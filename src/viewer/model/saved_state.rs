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

/// What of a kept scene is taken over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RestoredParts {
    /// Settings of the bake.
    pub settings: bool,
    /// The camera; bookmarks always are.
    pub camera: bool,
    pub exposure: bool,
    pub edits: bool,
}

/// What was kept and not taken over, to be kept on until it is changed: a look at other maps takes no edits away.
#[derive(Debug, Default)]
pub(super) struct IgnoredState {
    changes: Vec<Change>,
    /// What stood against them, and the settings.
    settings: Option<(BakeSettings, Value)>,
}

impl RestoredParts {
    /// Everything.
    pub(super) const ALL: Self = Self {
        settings: true,
        camera: true,
        exposure: true,
        edits: true,
    };
}

impl Model {
    /// What there is to be kept.
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

    /// The panel's settings; where the command line overrode a saved one and it has not changed since, the saved one.
    fn settings_to_keep(&self) -> Value {
        match &self.left_alone.settings {
            Some((given, kept)) if *given == self.choices.settings => kept.clone(),
            _ => serde_json::to_value(&self.choices.settings).unwrap_or_default(),
        }
    }

    /// Keeps what changed.
    pub(super) fn keep(&mut self, now: Instant) {
        if self.files.autosaver.is_some() {
            let snapshot = self.snapshot();
            if let Some(autosaver) = &mut self.files.autosaver {
                autosaver.look(snapshot, now);
            }
        }
    }

    /// Makes the scene in the window what it was last time, as far as that is wanted; tells whether there was such a time.
    pub(super) fn find_again(&mut self, what: Option<RestoredParts>) -> bool {
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

    /// Does edits of an earlier time again, each to be taken back by itself; says which of them the file has no place for.
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
