//! Opening another scene in the same window, or reading the same one again.

use std::path::PathBuf;
use std::sync::Arc;

use super::Model;
use super::pending_tasks::PendingTasks;
use super::picking::DraggedLight;
use super::saved_state::RestoredParts;
use crate::error::Result;
use crate::scene::changes::Change;
use crate::scene::{Scene, load};
use crate::viewer::ViewerOptions;
use crate::viewer::edits::EditedScene;
use crate::viewer::files;
use crate::viewer::files::LoadPurpose;
use crate::viewer::files::autosaver::Stamps;
use crate::viewer::filming::Film;
use crate::viewer::navigation::Navigator;
use crate::viewer::panel::Selection;
use crate::viewer::playback::Playback;
use crate::viewer::worker::BakedLevel;
use serde_json::json;

impl Model {
    /// Restores the saved state of the first scene; the command line takes precedence.
    pub(super) fn begin(&mut self, options: &ViewerOptions) {
        self.choices.watches |= options.files.watch;
        let what = RestoredParts {
            settings: options.maps.is_none() && !options.files.settings_given,
            camera: options.camera.is_none(),
            exposure: options.exposure_stops.is_none(),
            edits: options.maps.is_none(),
        };
        let source = self.edits.loaded().source.clone();
        self.files.opened(&source);
        self.exposure_is_kept = self.restore_saved_state((!options.files.fresh).then_some(what));
    }

    /// Loads a scene (a path as typed, or `builtin:NAME`), which replaces the present one when it is ready. Cancels a
    /// load in progress.
    pub fn open(&mut self, source: &str) {
        let source = files::typed(source);
        if !source.is_empty() {
            self.read(&source, LoadPurpose::Open);
        }
    }

    /// Writes the edited scene to a `.glb` file on a thread. [`Files::take_saved`] returns the outcome.
    ///
    /// # Errors
    /// As [`Files::save`].
    ///
    /// [`Files::take_saved`]: crate::viewer::files::Files::take_saved
    /// [`Files::save`]: crate::viewer::files::Files::save
    pub fn save_scene(&mut self, target: PathBuf) -> Result<()> {
        let (loaded, edited) = (Arc::clone(self.edits.loaded()), Arc::clone(self.edits.scene()));
        self.files.save(target, loaded, edited)
    }

    /// Whether these maps are of the first bake of the present scene.
    pub fn is_first(&self, level: &BakedLevel) -> bool {
        level.serial == self.first_request
    }

    fn read(&mut self, source: &str, purpose: LoadPurpose) {
        self.files.refusal = None;
        self.log.write("opening", json!({"source": source}));
        if let Err(error) = self.files.read(source, purpose) {
            self.refuse(source, &error.to_string());
        }
    }

    fn refuse(&mut self, source: &str, sentence: &str) {
        let more = json!({"source": source, "sentence": sentence});
        self.log.write("not_opened", more);
        self.files.refusal = Some(sentence.to_owned());
    }

    /// Shows the scene being loaded once it is ready; returns the purpose of the load if the scene has changed. A
    /// scene that cannot be read leaves everything as it was.
    pub fn poll_files(&mut self) -> Option<LoadPurpose> {
        if self.files.have_changed() {
            let source = self.edits.loaded().source.clone();
            self.read(&source, LoadPurpose::Reload);
        }
        let ((source, purpose), outcome) = self.files.take_read()?;
        let scene = match outcome {
            Ok(scene) => scene,
            Err(error) => {
                self.refuse(&source, &error.to_string());
                return None;
            }
        };
        let again = purpose == LoadPurpose::Reload;
        let more = json!({"scene": scene.name, "source": source, "again": again});
        self.log.write("opened", more);
        match purpose {
            LoadPurpose::Open => self.show(scene),
            LoadPurpose::Reload => self.show_again(scene),
        }
        Some(purpose)
    }

    /// Replaces the present scene, with its maps, edits and views.
    fn show(&mut self, scene: Scene) {
        let scene = Arc::new(scene);
        if let Some(autosaver) = &mut self.files.autosaver {
            autosaver.settle();
        }
        self.files.opened(&scene.source);
        self.files.stop_watch();
        self.navigator = Navigator::new(&scene, None);
        self.choices.selection = Selection::default();
        self.choices.film = Film::default();
        self.player = None;
        self.placing = DraggedLight::default();
        self.pending_tasks = PendingTasks::default();
        self.choices.watches = false;
        self.edits = EditedScene::new(scene);
        self.playback = Playback::default();
        self.exposure_is_kept = self.restore_saved_state(Some(RestoredParts::ALL));
        self.forget_maps();
        self.bake_first();
    }

    /// Shows the reloaded scene; camera, settings and edits stay.
    fn show_again(&mut self, mut scene: Scene) {
        let loaded = Arc::clone(self.edits.loaded());
        let changes = Change::diff(&loaded, self.edits.scene());
        let is_same_shape = load::share(&loaded, &mut scene);
        self.edits = EditedScene::new(Arc::new(scene));
        self.files.warning = None;
        self.edit_again(&changes);
        self.stand_at_moment();
        self.navigator.stay_in(self.edits.scene());
        if !is_same_shape {
            self.forget_maps();
        }
        self.bake_first();
    }

    /// Discards all maps, the reference and the probe.
    fn forget_maps(&mut self) {
        self.last = None;
        self.given.clear();
        self.reference = None;
        self.probe(None);
    }

    /// Bakes a scene that has no usable maps.
    fn bake_first(&mut self) {
        self.maps_revision += 1;
        self.refusal = None;
        self.worth = None;
        self.settle();
        self.asked = None;
        self.rebake();
        // If a setting is out of range there is no request, and results of earlier requests must not arrive.
        self.first_request = match &self.asked {
            Some((serial, _)) => *serial,
            None => {
                self.worker.cancel();
                u64::MAX
            }
        };
    }

    /// Starts or stops watching the scene's files, as the panel says.
    pub(super) fn watch(&mut self) {
        let source = &self.edits.loaded().source;
        let wanted = self.choices.watches && !source.starts_with("builtin:");
        if !wanted {
            self.files.stop_watch();
        } else if !self.files.is_watching() {
            let stamps = Stamps::of(load::files_of(source, &self.files.load));
            self.files.start_watch(stamps);
        }
    }
}
