//! The state of the window and its logic, independent of the window itself.

mod filming;
mod opening;
mod pending_tasks;
mod picking;
mod playing;
mod saved_state;
mod showing;

use std::sync::Arc;
use std::time::{Duration, Instant};

pub use self::showing::MapsShown;
use super::ViewerOptions;
use super::background::{self, Wake};
use super::command::{Choices, Command};
use super::comparison_view::SavedMaps;
use super::edits::EditedScene;
use super::event_log::{self, EventLog};
use super::exporting::{Export, Exporter};
use super::files::autosaver::Autosaver;
use super::files::{Files, working_folder};
use super::filming::Player;
use super::navigation::{NavigationMode, Navigator};
use super::playback::Playback;
use super::probe::{Probed, Prober};
use super::sketching::{self, PreviewTask};
use super::timing::FrameTimes;
use super::views::MapSurvey;
use super::walking::{Collider, CollisionScene};
use super::worker::{BakeRequest, BakeState, BakedLevel, EffectDifference, Worker};
use crate::bake::Baker;
use crate::error::Result;
use crate::geometry::Ray;
use crate::illumination::IlluminationMap;
use crate::light_pass::explain::Limits;
use crate::light_pass::sketch::{PathPreview, SketchLimits};
use crate::plan::EffectLine;
use crate::scene::{Edit, Scene};
use crate::transport::Tracer;
use serde_json::{Value, json};

/// Time without further changes after which a change is baked.
pub const QUIET: Duration = Duration::from_millis(150);
/// Limit of the rays that a probe traces per sample position of a light.
const MAX_PROBE_RAYS: u64 = 3_000_000;

/// Lattice cells of the path preview, per light.
const SKETCHED_CELLS: usize = 3000;
/// Smallest share of its light from which a branch is drawn in the path preview [1].
const SKETCHED_SHARE: f64 = 0.05;

/// State of the viewer, without window and device.
#[derive(Debug)]
pub struct Model {
    /// The edited scene, at rest, with its undo history.
    edits: EditedScene,
    playback: Playback,
    pub choices: Choices,
    pub navigator: Navigator,
    pub log: EventLog,
    /// The baking thread.
    pub worker: Worker,
    pub exporter: Exporter,
    surroundings: CollisionScene,
    /// State of the worker at the last [`poll`](Self::poll).
    pub state: BakeState,
    /// The maps that are shown; `None` before the first bake.
    pub last: Option<Arc<BakedLevel>>,
    /// Contribution of an effect to the maps shown, if it was asked for and found.
    pub worth: Option<EffectDifference>,
    /// Maps of an earlier bake that are shown until the first bake in the window.
    pub given: Vec<IlluminationMap>,
    /// When the pending change is baked, unless another one follows.
    bake_due: Option<Instant>,
    /// Counts changes of what a bake depends on.
    revision: u64,
    /// The revision that was last scheduled or baked.
    seen: u64,
    /// The last request and its number. Before the first one, the settings that the maps given at the start are
    /// assumed to be baked with.
    asked: Option<(u64, BakeRequest)>,
    /// Number of the first request for the present scene; maps of earlier requests show another scene.
    first_request: u64,
    /// Why the last edit or comparison was refused.
    pub refusal: Option<String>,
    /// Statistics of the maps shown, for scales and legends.
    pub survey: MapSurvey,
    /// Counts the changes of the maps shown.
    maps_revision: u64,
    prober: Prober,
    sketcher: PreviewTask,
    /// The maps that the present ones are compared with.
    pub reference: Option<SavedMaps>,
    /// The light that the mouse drags.
    placing: picking::DraggedLight,
    /// Tasks that wait for the collision surfaces.
    pending_tasks: pending_tasks::PendingTasks,
    /// Plays the camera path; `None` if it is not being played.
    player: Option<Player>,
    /// Outcome of the last command of the camera path.
    pub film_message: Option<String>,
    /// The scene that was last probed.
    probed_scene: Option<Arc<Scene>>,
    /// Whether the exposure was restored from an earlier session.
    pub exposure_is_kept: bool,
    /// Saved state that was not restored.
    left_alone: saved_state::IgnoredState,
    /// Full path or name of the scene in the window.
    full_source: String,
    /// Opens, saves and watches scene files.
    pub files: Files,
    pub picture: PictureReport,
}

/// What the window reports about the rendering of its pictures.
#[derive(Clone, Debug, Default)]
pub struct PictureReport {
    /// Name of the graphics adapter.
    pub adapter: String,
    /// Whether the picture is drawn with chains, and why.
    pub chains: Option<EffectLine>,
    /// GPU times of the last pictures; `None` if the device cannot measure them.
    pub frame_times: Option<FrameTimes>,
    /// Whether the graphics device was lost and recreated a short while ago.
    pub lost_device: bool,
}

impl Model {
    /// Starts the baking thread, and a bake unless there are maps already. `wake` is called when a thread has news.
    ///
    /// # Errors
    /// The event log cannot be written; the system cannot create a thread.
    pub fn new(options: &ViewerOptions, wake: &Wake) -> Result<Self> {
        // Threads of the bake give way to the window, which would stutter otherwise.
        let scene = Arc::clone(&options.scene);
        let make_baker = |scene| Ok(Baker::new(scene)?.with_thread_start(background::give_way));
        let worker = Worker::spawn(make_baker, wake)?;

        // Maps given at the start count as those of request 0: they stay until something changes.
        let wanted = BakeRequest::new(Arc::clone(&scene), options.settings.clone());
        let mut model = Self {
            navigator: Navigator::new(&scene, options.camera.as_deref()),
            choices: Choices::new(options.settings.clone()),
            log: EventLog::open(options.event_log.as_deref())?,
            worker,
            exporter: Exporter::new(wake),
            surroundings: CollisionScene::new(wake),
            prober: Prober::new(wake),
            sketcher: PreviewTask::new("sketch", wake),
            reference: None,
            placing: picking::DraggedLight::default(),
            pending_tasks: pending_tasks::PendingTasks::default(),
            player: None,
            film_message: None,
            probed_scene: None,
            files: Files::new(&options.files, wake),
            state: BakeState::Idle,
            last: None,
            worth: None,
            given: options.maps.clone().unwrap_or_default(),
            bake_due: None,
            revision: 0,
            seen: 0,
            asked: options.maps.is_some().then_some((0, wanted)),
            first_request: 1,
            exposure_is_kept: false,
            left_alone: saved_state::IgnoredState::default(),
            full_source: String::new(),
            refusal: None,
            survey: MapSurvey::default(),
            maps_revision: 0,
            picture: PictureReport::default(),
            edits: EditedScene::new(scene),
            playback: Playback::default(),
        };

        // Saved state is restored before the first bake, which would use other settings otherwise.
        model.choices.display.exposure_stops = options.exposure_stops.unwrap_or(0.0);
        model.begin(options);
        if options.maps.is_none() {
            model.rebake();
        }
        Ok(model)
    }

    /// The collision surfaces of the shown scene; `None` until they are built.
    pub fn surfaces(&mut self) -> Option<Arc<Tracer>> {
        self.surroundings.of(self.edits.scene())
    }

    /// Changes how the camera moves.
    pub fn travel(&mut self, travel: NavigationMode) {
        let surfaces = self.surfaces();
        let solid = surfaces.as_deref().map(|tracer| tracer as &dyn Collider);
        self.navigator.set_travel(travel, solid);
        self.log.write("travel", json!({"way": travel.name()}));
    }

    /// Advances the scene's time, the camera path and the camera by a time [s].
    pub fn advance(&mut self, seconds: f64) {
        if self.playback.is_playing {
            self.playback.advance(seconds, self.edits.scene());
        }
        if self.play_on(seconds) || !self.navigator.is_moving() {
            return;
        }
        if self.navigator.travel() == NavigationMode::Walk {
            // The camera does not move before there is ground to walk on.
            if let Some(surfaces) = self.surfaces() {
                self.navigator.advance_among(seconds, &*surfaces);
            }
        } else {
            self.navigator.advance(seconds);
        }
    }

    /// The scene shown: edited, at the present moment of its animation.
    pub fn scene(&self) -> &Arc<Scene> {
        self.playback.shown(self.edits.scene())
    }

    pub fn edits(&self) -> &EditedScene {
        &self.edits
    }

    /// The scene as it was loaded.
    pub fn loaded(&self) -> &Arc<Scene> {
        self.edits.loaded()
    }

    /// When the next task is due that no event triggers.
    pub fn due(&self) -> Option<Instant> {
        let autosaver = self.files.autosaver.as_ref();
        let dues = [self.bake_due, autosaver.and_then(Autosaver::due)];
        dues.into_iter().flatten().min()
    }

    /// The maps shown, with all baked layers; empty before the first bake.
    pub fn maps(&self) -> &[IlluminationMap] {
        self.last.as_ref().map_or(&self.given, |last| &last.result.maps)
    }

    /// Probes the surface along a ray; `None` clears the probe.
    pub fn probe(&mut self, view_ray: Option<Ray>) {
        self.prober.ask(view_ray);
    }

    /// Result of the probe so far.
    pub fn probed(&self) -> Option<&Probed> {
        self.prober.shown()
    }

    /// The path preview, if it is drawn.
    pub fn sketch(&self) -> Option<&Arc<PathPreview>> {
        self.sketcher.made().map(|(_, sketch)| sketch)
    }

    /// Traces the path preview of the present scene while it is drawn.
    fn poll_sketch(&mut self) {
        if !self.choices.sketched.is_any() {
            return self.sketcher.forget();
        }
        let Some(tracer) = self.surroundings.of(self.edits.scene()) else {
            return;
        };
        let settings = &self.choices.settings;
        let limits = SketchLimits {
            max_depth: settings.depth(),
            branch_threshold: settings.path_threshold().max(SKETCHED_SHARE),
            cells: SKETCHED_CELLS,
        };
        if sketching::follow(&mut self.sketcher, &tracer, limits)
            && let Some((_, sketch)) = self.sketcher.made()
        {
            let (landings, patches) = (sketch.landings.len(), sketch.patches.len());
            let more = json!({"rays": sketch.rays, "landings": landings, "patches": patches});
            self.log.write("sketched", more);
        }
    }

    /// Continues the probe: as soon as the collision surfaces are built, and again when the scene or its maps change.
    fn poll_probe(&mut self, has_maps: bool) {
        let is_other = |scene: &Arc<Scene>| !Arc::ptr_eq(scene, self.edits.scene());
        let is_settled = has_maps && self.last.as_ref().is_some_and(|last| last.is_final);
        if is_settled || self.probed_scene.as_ref().is_some_and(is_other) {
            self.prober.ask_again();
        }
        if self.prober.is_due()
            && let Some(tracer) = self.surroundings.of(self.edits.scene())
        {
            let settings = &self.choices.settings;
            let limits = Limits {
                max_depth: settings.depth(),
                branch_threshold: settings.path_threshold(),
                most_rays: MAX_PROBE_RAYS,
            };
            let maps = self.last.as_ref().map_or(&self.given, |last| &last.result.maps);
            self.prober.look(&tracer, maps, limits);
            self.probed_scene = Some(Arc::clone(self.edits.scene()));
        }
        if self.prober.poll()
            && let Some(probed) = self.prober.shown()
        {
            self.log.write("probe", probed.to_json());
        }
    }

    /// Takes news from all threads; returns whether there are new maps to show.
    pub fn poll(&mut self) -> bool {
        if self.exporter.poll() {
            self.log.write_export(&self.exporter.state);
        }

        // Reads the state first: the next call, for which the thread wakes the window, takes maps that arrive in
        // between.
        let state = self.worker.state();
        let mut has_maps = false;
        let level = self.worker.take_level();

        // Maps of an earlier scene are dropped, as are coarse ones of a moment while time runs.
        let is_wanted = |level: &BakedLevel| {
            level.serial >= self.first_request && (level.is_final || !self.playback.is_playing)
        };
        if let Some(mut level) = level.filter(is_wanted) {
            self.take_moment(&mut level);
            has_maps = self.improves_on_what_is_shown(&level);
            let mut more = event_log::baked(&level);
            if level.is_final {
                self.log.write("done", more);
            } else {
                more["shown"] = json!(has_maps);
                self.log.write("level", more);
            }
            if has_maps {
                self.last = Some(Arc::new(level));
                // It was computed for other maps.
                self.worth = None;
            }
        }

        if let Some(worth) = self.worker.take_worth() {
            has_maps |= self.take_worth(worth);
        }

        // A bake that was cancelled or failed is logged once.
        if std::mem::discriminant(&state) != std::mem::discriminant(&self.state) {
            match &state {
                BakeState::Cancelled => self.log.write("cancelled", Value::Null),
                BakeState::Failed(sentence) => {
                    self.playback.stop();
                    self.log.write("failed", json!({"sentence": sentence}));
                }
                BakeState::Idle
                | BakeState::Baking { .. }
                | BakeState::Comparing { .. }
                | BakeState::Done => {}
            }
        }

        // What depends on scene and maps follows them: probe, path preview, pending tasks and comparison.
        self.state = state;
        self.poll_probe(has_maps);
        self.poll_sketch();
        self.poll_pending();
        if has_maps {
            self.maps_revision += 1;
            self.compare_again();
        }
        has_maps
    }

    /// Whether new maps should replace those shown. Coarse maps of a changed scene or changed settings do because the
    /// maps shown are wrong then; coarse maps of the same light only if they are more accurate than those shown.
    fn improves_on_what_is_shown(&self, new: &BakedLevel) -> bool {
        let Some(shown) = &self.last else {
            return true;
        };
        let is_next = new.is_final || new.serial == shown.serial;
        if is_next || !new.request.differs_in_accuracy_only(&shown.request) {
            return true;
        }
        let metric = new.request.settings.error_metric;
        match (
            new.result.estimated_error(metric),
            shown.result.estimated_error(metric),
        ) {
            (Some(new), Some(shown)) => new <= shown,
            (Some(_), None) => true,
            (None, Some(_)) => false,
            (None, None) => !shown.is_final,
        }
    }

    /// The request that matches the present scene and settings.
    fn wanted(&self) -> BakeRequest {
        let scene = self.playback.wanted(self.edits.scene());
        BakeRequest::new(Arc::clone(scene), self.choices.settings.clone())
    }

    /// Applies commands and bakes changes; returns the commands that the window has to carry out.
    ///
    /// A change is baked at once if the previous request has already shown maps: the picture then follows a dragged
    /// slider at the rate of first levels, and every request gets to show one. Otherwise the change waits for the
    /// first level, or until it has been left alone for [`QUIET`].
    pub fn act(&mut self, mut commands: Vec<Command>, now: Instant) -> Vec<Command> {
        // One slow frame may contain both the end of a drag and its undo: apply the changes first.
        commands.sort_by_key(|command| match command {
            Command::Choose(_) => 0,
            Command::Edit(_) => 1,
            _ => 2,
        });
        let of_window = commands.into_iter().filter_map(|command| self.apply(command));
        let of_window = of_window.collect();
        self.watch();
        if std::mem::replace(&mut self.seen, self.revision) != self.revision {
            self.bake_due = Some(now + QUIET);
        }
        if !self.choices.automatic || self.playback.is_playing {
            self.bake_due = None;
        }
        let is_ripe = self.bake_due.is_some() && self.has_answered();
        let has_rested = self.bake_due.take_if(|due| now >= *due).is_some();
        if (has_rested || is_ripe) && self.is_changed() {
            self.rebake();
        }
        self.play_moment();
        self.keep(now);
        of_window
    }

    /// Applies one command, or returns it if the window has to carry it out.
    pub fn apply(&mut self, command: Command) -> Option<Command> {
        match command {
            Command::Choose(choices) => self.choose(*choices),
            Command::Edit(edit) => drop(self.edit(&edit)),
            Command::Release => self.edits.release(),
            Command::Undo => self.step_history(true),
            Command::Redo => self.step_history(false),
            Command::Rebake => self.rebake(),
            Command::Cancel => self.cancel(),
            Command::EffectDifference(effect) => self.compare(effect),
            Command::Compare(command) => self.compare_with(&command),
            Command::Film(command) => self.film(&command),
            Command::Play(command) => self.set_time(command),
            Command::Export(export) => self.export(export),
            Command::ClearProbe => self.probe(None),
            Command::Brightest => self.seek(|pending_tasks| pending_tasks.brightest = true),
            Command::AddLight(light) => self.seek(|pending_tasks| pending_tasks.light = Some(light)),
            Command::Open(source) => self.open(&source),
            Command::Browse | Command::SaveScene | Command::SavePicture | Command::MeasureExposure => {
                return Some(command);
            }
        }
        None
    }

    /// Starts to export baked maps into the working folder.
    fn export(&mut self, export: Export) {
        let Some(last) = &self.last else {
            return;
        };
        let last = Arc::clone(last);
        self.exporter.start(export, last, working_folder());
        self.log.write_export(&self.exporter.state);
    }

    /// Whether the wanted bake differs from the last request.
    fn is_changed(&self) -> bool {
        self.asked
            .as_ref()
            .is_none_or(|(_, asked)| !asked.is_same(&self.wanted()))
    }

    /// Whether the last request has shown maps, or never will.
    fn has_answered(&self) -> bool {
        let is_shown = |serial: u64| self.last.as_ref().is_some_and(|last| last.serial == serial);
        !self.state.is_baking() || self.asked.as_ref().is_none_or(|(serial, _)| is_shown(*serial))
    }

    fn choose(&mut self, choices: Choices) {
        let before = std::mem::replace(&mut self.choices, choices);
        self.edits.note(&before, &self.choices);
        self.note_choices_since(before);
    }

    /// Schedules a bake if it depends on choices that differ from `before`.
    fn note_choices_since(&mut self, before: Choices) {
        self.revision += u64::from(before.automatic != self.choices.automatic);
        let wanted = self.wanted();
        if wanted.settings != BakeRequest::new(Arc::clone(&wanted.scene), before.settings).settings {
            self.log.write("settings", json!({"settings": wanted.settings}));
            self.revision += 1;
        }
    }

    /// Applies an edit to the scene; returns whether it was accepted.
    fn edit(&mut self, edit: &Edit) -> bool {
        self.log.write("edit", json!({"target": edit.target()}));
        let outcome = self.edits.edit(edit);
        self.revision += u64::from(outcome.is_ok());
        self.refusal = outcome.err().map(|error| error.to_string());
        self.stand_at_moment();
        self.refusal.is_none()
    }

    /// Undoes the last change, or redoes the last undone one.
    fn step_history(&mut self, is_back: bool) {
        self.refusal = None;
        let (before, scene) = (self.choices.clone(), Arc::clone(self.edits.scene()));
        let Some(text) = self.edits.step(is_back, &mut self.choices) else {
            return;
        };
        let event = if is_back { "undone" } else { "redone" };
        self.log.write(event, json!({"what": text}));
        self.note_choices_since(before);
        if !Arc::ptr_eq(&scene, self.edits.scene()) {
            self.revision += 1;
            self.stand_at_moment();
        }
    }

    /// Bakes with the panel's settings unless one of them is out of range; the panel reports that.
    pub fn rebake(&mut self) {
        let wanted = self.wanted();
        if wanted.settings.validate().is_err() {
            return;
        }
        self.settle();
        self.log.write("baking", json!({"settings": wanted.settings}));
        self.asked = Some((self.worker.request(wanted.clone()), wanted));
        self.state = self.worker.state();
    }

    /// Stops the bake and the playback; the maps shown stay.
    pub fn cancel(&mut self) {
        self.playback.stop();
        self.settle();
        self.worker.cancel();
    }

    /// Discards the pending change.
    fn settle(&mut self) {
        self.seen = self.revision;
        self.bake_due = None;
    }
}
