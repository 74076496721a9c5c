//! Everything that the window shows and does, without the window.

mod comparing;
mod filming;
mod keeping;
mod opening;
mod picking;
mod seeking;

use std::borrow::Cow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::beside::Reference;
use super::debounce::Debounce;
use super::edits::{EditedScene, Part};
use super::event_log::{self, EventLog};
use super::exporting::{Export, Exporter};
use super::files::keeper::Keeper;
use super::files::{Files, working_folder};
use super::filming::Player;
use super::navigation::{Navigator, Travel};
use super::panel::{LayerShown, Panel, Quantity, Wishes};
use super::probe::{Probed, Prober};
use super::sketching::Sketcher;
use super::solid::{Solid, Surroundings};
use super::views::MapSurvey;
use super::worker::{BakeRequest, BakeState, BakedLevel, Worker, Worth};
use super::{ViewerOptions, difference_view, error_view, wavelength_view};
use crate::error::Result;
use crate::eye_pass::renderer::MapStyle;
use crate::geometry::Ray;
use crate::illumination::IlluminationMap;
use crate::light_pass::explain::Limits;
use crate::light_pass::sketch::{Sketch, SketchLimits};
use crate::scene::Scene;
use crate::session::BakeSession;
use crate::settings::LayerKind;
use crate::transport::Tracer;
use serde_json::{Value, json};

/// Rays that a probe may take for each place of a light.
const MOST_PROBE_RAYS: u64 = 3_000_000;

/// Cells of the lattice of rays that is drawn, for each light.
const SKETCHED_CELLS: usize = 3000;
/// Least share of a ray that is drawn [1].
const SKETCHED_SHARE: f64 = 0.05;

/// The state behind the window.
#[derive(Debug)]
pub struct Model {
    /// What is shown, with its history.
    edits: EditedScene,
    /// What the user can set.
    pub panel: Panel,
    /// From where it is seen.
    pub navigator: Navigator,
    /// What happened.
    pub log: EventLog,
    worker: Worker,
    /// Writes maps to files.
    pub exporter: Exporter,
    surroundings: Surroundings,
    state: BakeState,
    /// The maps that the picture shows.
    pub last: Option<Arc<BakedLevel>>,
    /// What an effect is worth to these maps, where that was asked for.
    pub worth: Option<Worth>,
    /// Maps that were baked before the start; until the first bake.
    pub given: Vec<IlluminationMap>,
    debounce: Debounce,
    /// As they were at the last look.
    seen: BakeRequest,
    was_automatic: bool,
    /// The last request with its number; before the first one what the given maps are taken to be baked with.
    asked: Option<(u64, BakeRequest)>,
    /// The first request for the scene in the window; maps of those before are of another.
    first_request: u64,
    /// Why the last edit was refused.
    pub refusal: Option<String>,
    /// What the maps that were shown last hold.
    survey: MapSurvey,
    prober: Prober,
    sketcher: Sketcher,
    reference: Option<Reference>,
    /// What is to be picked once surfaces are known.
    picking: Option<Ray>,
    /// The light in the mouse's hand.
    placing: picking::Placing,
    /// What waits for the surfaces of the scene.
    sought: seeking::Sought,
    /// The camera's path, while it is played.
    player: Option<Player>,
    /// What became of the last file of a path.
    film_told: Option<String>,
    /// The scene that was asked about.
    probed_scene: Option<Arc<Scene>>,
    /// Whether the exposure is that of an earlier time.
    exposure_is_kept: bool,
    /// What was kept of it and not taken over.
    left_alone: keeping::LeftAlone,
    /// The scene in the window by its full path.
    full_source: String,
    /// What is read from files, and from which.
    pub files: Files,
}

impl Model {
    /// Starts the baking thread, and a bake unless there are maps. `wake` is called when the thread has news.
    ///
    /// # Errors
    /// The event log cannot be written; the system gives no thread.
    pub fn new(options: &ViewerOptions, wake: impl Fn() + Send + Sync + 'static) -> Result<Self> {
        let scene = Arc::clone(&options.scene);
        let wake: Arc<dyn Fn() + Send + Sync> = Arc::new(wake);
        let wake_too = Arc::clone(&wake);
        let worker = Worker::spawn(BakeSession::new, move || wake_too())?;
        let wanted = BakeRequest::new(Arc::clone(&scene), options.settings.clone());
        let mut model = Self {
            navigator: Navigator::new(&scene, options.camera.as_deref()),
            panel: Panel::new(options.settings.clone()),
            log: EventLog::open(options.event_log.as_deref())?,
            worker,
            exporter: Exporter::new(Arc::clone(&wake)),
            surroundings: Surroundings::new(Arc::clone(&wake)),
            prober: Prober::new(Arc::clone(&wake)),
            sketcher: Sketcher::new(Arc::clone(&wake)),
            reference: None,
            picking: None,
            placing: picking::Placing::default(),
            sought: seeking::Sought::default(),
            player: None,
            film_told: None,
            probed_scene: None,
            files: Files::new(&options.files, wake),
            state: BakeState::Idle,
            last: None,
            worth: None,
            given: options.maps.clone().unwrap_or_default(),
            debounce: Debounce::default(),
            seen: wanted.clone(),
            was_automatic: true,
            asked: options.maps.is_some().then_some((0, wanted)),
            first_request: 1,
            exposure_is_kept: false,
            left_alone: keeping::LeftAlone::default(),
            full_source: String::new(),
            refusal: None,
            survey: MapSurvey::default(),
            edits: EditedScene::new(scene),
        };
        model.panel.display.exposure_stops = options.exposure_stops.unwrap_or(0.0);
        model.begin(options);
        if options.maps.is_none() {
            model.rebake();
        }
        Ok(model)
    }

    /// The surfaces of what is shown, for whoever walks; `None` until they are found.
    pub fn surfaces(&mut self) -> Option<Arc<Tracer>> {
        self.surroundings.of(self.edits.scene())
    }

    /// Gets about in another way from now on.
    pub fn travel(&mut self, travel: Travel) {
        let surfaces = self.surfaces();
        let solid = surfaces.as_deref().map(|tracer| tracer as &dyn Solid);
        self.navigator.set_travel(travel, solid);
        self.log.write("travel", json!({"way": travel.name()}));
    }

    /// Moves the camera by some time [s].
    pub fn advance(&mut self, seconds: f64) {
        if self.play_on(seconds) || !self.navigator.is_moving() {
            return;
        }
        if self.navigator.travel() == Travel::Walk {
            // Stands until there is something to stand on.
            if let Some(surfaces) = self.surfaces() {
                self.navigator.advance_among(seconds, &*surfaces);
            }
        } else {
            self.navigator.advance(seconds);
        }
    }

    /// What is shown, as it is now.
    pub fn scene(&self) -> &Arc<Scene> {
        self.edits.scene()
    }

    /// The scene with its history.
    pub fn edits(&self) -> &EditedScene {
        &self.edits
    }

    /// Where the bake stood at the last [`poll`](Self::poll).
    pub fn state(&self) -> &BakeState {
        &self.state
    }

    /// When something is to be done though nothing happens.
    pub fn due(&self) -> Option<Instant> {
        let keeper = self.files.keeper.as_ref();
        let dues = [self.debounce.due(), keeper.and_then(Keeper::due)];
        dues.into_iter().flatten().min()
    }

    /// Maps with every layer that was baked; empty before the first bake.
    pub fn maps(&self) -> &[IlluminationMap] {
        self.last.as_ref().map_or(&self.given, |last| &last.result.maps)
    }

    /// Layers of the present maps.
    pub fn layers(&self) -> Vec<LayerKind> {
        let mut kinds: Vec<_> = self
            .maps()
            .iter()
            .flat_map(|map| &map.layers)
            .map(|layer| layer.kind)
            .collect();
        kinds.sort_unstable();
        kinds.dedup();
        kinds
    }

    /// What the picture shows: the light where the panel asks for what there is not.
    pub fn quantity(&self) -> Quantity {
        match self.panel.display.quantity {
            Quantity::Error if error_view::is_available(self.maps()) => Quantity::Error,
            Quantity::Difference if self.difference().is_some() => Quantity::Difference,
            Quantity::Error | Quantity::Difference => Quantity::Light,
            other => other,
        }
    }

    /// Whether direct light is to be traced and not looked up: it is shown, and its layer is not baked yet, or a light or
    /// an object was moved since.
    pub fn traces_lights(&self) -> bool {
        let shown = matches!(
            self.panel.display.layer,
            LayerShown::All | LayerShown::Only(LayerKind::Direct)
        );
        let Some(last) = self
            .last
            .as_ref()
            .filter(|_| shown && self.quantity() == Quantity::Light)
        else {
            return false;
        };
        let is_asked_for = last.request.settings.layers.contains(&LayerKind::Direct);
        if self.layers().contains(&LayerKind::Direct) {
            is_other_light(&last.request.scene, self.scene())
        } else {
            is_asked_for && !last.is_final
        }
    }

    /// The maps without their direct light.
    pub fn maps_without_direct(&self) -> Vec<IlluminationMap> {
        let mut maps = self.shown_maps().into_owned();
        for map in &mut maps {
            map.layers.retain(|layer| layer.kind != LayerKind::Direct);
        }
        maps.retain(|map| !map.layers.is_empty());
        maps
    }

    /// The maps as the panel asks them to be shown: some layers, the errors, or what an effect is worth.
    pub fn shown_maps(&self) -> Cow<'_, [IlluminationMap]> {
        self.as_shown(self.maps())
    }

    /// Some maps of the scene as the panel asks them to be shown.
    fn as_shown<'a>(&self, maps: &'a [IlluminationMap]) -> Cow<'a, [IlluminationMap]> {
        self.with_quantity(maps, self.quantity())
    }

    /// Some maps of the scene, of the layer that the panel asks for, with a quantity in them.
    fn with_quantity<'a>(
        &self,
        maps: &'a [IlluminationMap],
        quantity: Quantity,
    ) -> Cow<'a, [IlluminationMap]> {
        // Until the next maps come, an edit may have made a receiver clear, or a mirror.
        let receives = |map: &&IlluminationMap| {
            let scene = self.scene();
            let object = scene.objects.get(map.chart.object());
            object.is_none_or(|object| scene.materials[object.material].surface.is_receiver())
        };
        let in_colours = match quantity {
            Quantity::Wavelength => Some(wavelength_view::maps(&self.with_quantity(maps, Quantity::Light))),
            Quantity::Error => Some(error_view::maps(maps)),
            Quantity::Difference => self.difference().map(difference_view::maps),
            _ => None,
        };
        if let Some(maps) = in_colours {
            return Cow::Owned(maps.into_iter().filter(|map| receives(&map)).collect());
        }
        let LayerShown::Only(kind) = self.panel.display.layer else {
            return if maps.iter().all(|map| receives(&map)) {
                Cow::Borrowed(maps)
            } else {
                Cow::Owned(maps.iter().filter(receives).cloned().collect())
            };
        };
        let with_kind = maps.iter().filter(receives).filter_map(|map| {
            let irradiance = map.layer(kind)?.irradiance.clone();
            Some(IlluminationMap::of_layer(
                Arc::clone(&map.chart),
                kind,
                irradiance,
            ))
        });
        Cow::Owned(with_kind.collect())
    }

    /// The maps' light, whatever the picture shows in its place.
    fn lit_maps(&self) -> Cow<'_, [IlluminationMap]> {
        self.with_quantity(self.maps(), Quantity::Light)
    }

    /// Maps as they are to be shown next, looked at as a whole, with what their values stand for.
    pub fn maps_to_show(&mut self, without_direct: bool) -> (Vec<IlluminationMap>, MapStyle) {
        let maps = if without_direct {
            self.maps_without_direct()
        } else {
            self.shown_maps().into_owned()
        };
        self.survey = MapSurvey::of(&maps);
        (maps, self.map_style())
    }

    /// What the values of the maps that are shown stand for.
    pub fn map_style(&self) -> MapStyle {
        let quantity = self.quantity();
        let choice = &self.panel.display.scale;
        quantity.map_style(self.survey.scale(quantity, choice))
    }

    /// What the maps that were shown last hold.
    pub fn survey(&self) -> &MapSurvey {
        &self.survey
    }

    /// Asks what lights the surface along a ray; forgets what was asked without one.
    pub fn probe(&mut self, gaze: Option<Ray>) {
        self.prober.ask(gaze);
    }

    /// What is known of the point that was asked about.
    pub fn probed(&self) -> Option<&Probed> {
        self.prober.shown()
    }

    /// How light runs, where that is drawn.
    pub fn sketch(&self) -> Option<&Arc<Sketch>> {
        self.sketcher.shown()
    }

    /// Follows the light through the scene as it is now, while that is drawn.
    fn poll_sketch(&mut self) {
        if !self.panel.sketched.is_any() {
            return self.sketcher.forget();
        }
        let Some(tracer) = self.surroundings.of(self.edits.scene()) else {
            return;
        };
        let settings = &self.panel.settings;
        let limits = SketchLimits {
            max_depth: settings.depth(),
            branch_threshold: settings.path_threshold().max(SKETCHED_SHARE),
            cells: SKETCHED_CELLS,
        };
        if self.sketcher.follow(&tracer, limits)
            && let Some(sketch) = self.sketcher.shown()
        {
            let (landings, patches) = (sketch.landings.len(), sketch.patches.len());
            let more = json!({"rays": sketch.rays, "landings": landings, "patches": patches});
            self.log.write("sketched", more);
        }
    }

    /// Gets on with what was asked about: as soon as the surfaces of the scene are known, and again when it or its maps
    /// are others.
    fn poll_probe(&mut self, has_maps: bool) {
        let is_other = |scene: &Arc<Scene>| !Arc::ptr_eq(scene, self.edits.scene());
        let is_settled = has_maps && self.last.as_ref().is_some_and(|last| last.is_final);
        if is_settled || self.probed_scene.as_ref().is_some_and(is_other) {
            self.prober.ask_again();
        }
        if self.prober.is_due()
            && let Some(tracer) = self.surroundings.of(self.edits.scene())
        {
            let settings = &self.panel.settings;
            let limits = Limits {
                max_depth: settings.depth(),
                branch_threshold: settings.path_threshold(),
                most_rays: MOST_PROBE_RAYS,
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

    /// Looks what the baking thread did; tells whether there are new maps to be shown.
    pub fn poll(&mut self) -> bool {
        if self.exporter.poll() {
            self.log.write_export(self.exporter.state());
        }
        // The state first: maps that come in between are taken by the next call, which the thread wakes.
        let state = self.worker.state();
        let mut has_maps = false;
        let level = self.worker.take_level();
        if let Some(level) = level.filter(|level| level.serial >= self.first_request) {
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
                // It was found on other maps.
                self.worth = None;
            }
        }
        if let Some(worth) = self.worker.take_worth() {
            has_maps |= self.take_worth(worth);
        }
        if std::mem::discriminant(&state) != std::mem::discriminant(&self.state) {
            match &state {
                BakeState::Cancelled => self.log.write("cancelled", Value::Null),
                BakeState::Failed(sentence) => self.log.write("failed", json!({"sentence": sentence})),
                BakeState::Idle
                | BakeState::Baking { .. }
                | BakeState::Comparing { .. }
                | BakeState::Done => {}
            }
        }
        self.state = state;
        self.poll_probe(has_maps);
        self.poll_sketch();
        self.poll_pick();
        self.poll_sought();
        if has_maps {
            self.compare_again();
        }
        has_maps
    }

    /// Whether maps are to replace those that are shown. Coarse maps of other light do, since what is shown is wrong
    /// then; coarse maps of the same light only where they are better than what is shown.
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

    /// What the panel asks for now.
    fn wanted(&self) -> BakeRequest {
        BakeRequest::new(Arc::clone(self.edits.scene()), self.panel.settings.clone())
    }

    /// Does what was pressed, and bakes what was changed.
    ///
    /// A change is baked at once where the request before it has shown something: while a slider is dragged, the
    /// picture follows at the pace of first levels, and no request is stopped before it had one. Where nothing was
    /// shown yet, the change waits for that, or until it has come to rest.
    pub fn act(&mut self, wishes: &Wishes, now: Instant) {
        self.edit(wishes);
        if wishes.new_light.is_some() || wishes.brightest {
            self.sought.light = wishes.new_light.or(self.sought.light);
            self.sought.brightest |= wishes.brightest;
            self.poll_sought();
        }
        if let Some(source) = &wishes.open {
            self.open(source);
        }
        self.watch();
        let wanted = self.wanted();
        if wanted.settings != self.seen.settings {
            self.log.write("settings", json!({"settings": wanted.settings}));
        }
        if !wanted.is_same(&self.seen) || (self.panel.automatic && !self.was_automatic) {
            self.debounce.change(now);
        }
        self.seen = wanted;
        self.was_automatic = self.panel.automatic;
        if !self.panel.automatic {
            self.debounce.clear();
        }
        if wishes.cancel {
            self.cancel();
        }
        if let Some(wish) = &wishes.film {
            self.film(wish);
        }
        if let Some(export) = &wishes.export {
            self.export(export);
        }
        let is_ripe = self.debounce.due().is_some() && self.has_answered();
        let is_due = self.debounce.is_due(now) || is_ripe;
        if wishes.rebake || (is_due && self.is_changed()) {
            self.rebake();
        } else if let Some(effect) = wishes.worth {
            self.compare(effect);
        }
        self.keep(now);
    }

    /// Has maps written that were baked here, into the working folder.
    fn export(&mut self, export: &Export) {
        let Some(last) = &self.last else {
            return;
        };
        let last = Arc::clone(last);
        self.exporter.start(export.clone(), last, working_folder());
        self.log.write_export(self.exporter.state());
    }

    /// Whether something else is wanted than what was asked for last.
    fn is_changed(&self) -> bool {
        self.asked
            .as_ref()
            .is_none_or(|(_, asked)| !asked.is_same(&self.seen))
    }

    /// Whether the last request has shown maps, or will not any more.
    fn has_answered(&self) -> bool {
        let is_shown = |serial: u64| self.last.as_ref().is_some_and(|last| last.serial == serial);
        !self.state.is_baking() || self.asked.as_ref().is_none_or(|(serial, _)| is_shown(*serial))
    }

    /// Edits the scene, notes what the panel changed, or takes a change back.
    fn edit(&mut self, wishes: &Wishes) {
        if let Some(wish) = &wishes.compare {
            self.compare_with(wish);
        }
        if wishes.clear_probe {
            self.probe(None);
        }
        if let Some((settings, display)) = wishes.changed.as_deref() {
            self.edits.note_settings(settings, &self.panel.settings);
            self.edits.note_display(*display, self.panel.display);
        }
        if let Some(film) = &wishes.changed_film {
            self.edits.note_film(film, &self.panel.film);
        }
        if wishes.changed_automatic {
            self.edits.note_automatic(self.panel.automatic);
        }
        // A slow frame may bring both: the end of a drag, and the wish to take it back.
        let mut outcome = Ok(());
        if let Some(edit) = &wishes.edit {
            self.log.write("edit", json!({"target": edit.target()}));
            outcome = self.edits.edit(edit);
        }
        if outcome.is_ok() && (wishes.undo || wishes.redo) {
            self.turn_back(wishes.undo);
        }
        if wishes.edit.is_some() || wishes.undo || wishes.redo {
            self.refusal = outcome.err().map(|error| error.to_string());
        }
        if !wishes.is_dragging {
            self.edits.release();
        }
    }

    /// Takes the last change back, or does again what was taken back.
    fn turn_back(&mut self, is_back: bool) {
        let Some((text, [from, to])) = self.edits.turn(is_back) else {
            return;
        };
        match (from, to) {
            (_, Part::Settings(settings)) => self.panel.settings = *settings,
            (Part::Display(from), Part::Display(to)) => self.panel.display.restore(&from, &to),
            (_, Part::Film(film)) => self.panel.film = *film,
            (_, Part::Automatic(automatic)) => self.panel.automatic = automatic,
            // The scene, which is changed already.
            _ => {}
        }
        let event = if is_back { "undone" } else { "redone" };
        self.log.write(event, json!({"what": text}));
    }

    /// Bakes with the panel's settings, unless one of them is out of its range: the panel tells so.
    pub fn rebake(&mut self) {
        let wanted = self.wanted();
        if wanted.settings.validate().is_err() {
            return;
        }
        self.debounce.clear();
        self.log.write("baking", json!({"settings": wanted.settings}));
        self.asked = Some((self.worker.request(wanted.clone()), wanted));
        self.state = self.worker.state();
    }

    /// Lets the bake wait for so long.
    pub fn hold_bake(&self, time: Duration) {
        self.worker.hold(time);
    }

    /// Lets the bake go on for so long without showing what it has.
    pub fn look_away(&self, time: Duration) {
        self.worker.look_away(time);
    }

    /// Stops the bake and keeps the maps that are shown.
    pub fn cancel(&mut self) {
        self.debounce.clear();
        self.worker.cancel();
    }
}

/// Whether a scene is lit otherwise than before: a lamp is another one, or an object elsewhere.
fn is_other_light(before: &Arc<Scene>, now: &Arc<Scene>) -> bool {
    let (was, is) = (&before.objects, &now.objects);
    let stand_alike = || was.len() == is.len() && was.iter().zip(is).all(|(was, is)| was.stands_as(is));
    !Arc::ptr_eq(before, now) && (before.lights != now.lights || !stand_alike())
}
