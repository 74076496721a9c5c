//! Everything that the window shows and does, without the window.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::Instant;

use super::debounce::Debounce;
use super::edits::EditedScene;
use super::event_log::{Event, EventLog};
use super::navigation::{Navigator, Travel};
use super::panel::{LayerShown, Panel, Quantity, Wishes};
use super::solid::{Solid, Surroundings};
use super::worker::{BakeRequest, BakeState, BakedLevel, Worker, Worth};
use super::{ViewerOptions, difference_view, error_view};
use crate::effect::Effect;
use crate::error::Result;
use crate::illumination::IlluminationMap;
use crate::illumination::difference::Difference;
use crate::scene::Scene;
use crate::session::BakeSession;
use crate::settings::LayerKind;
use crate::transport::Tracer;

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
    surroundings: Surroundings,
    state: BakeState,
    /// The maps that the picture shows.
    pub last: Option<Arc<BakedLevel>>,
    /// What an effect is worth to these maps, where that was asked for.
    pub worth: Option<Worth>,
    /// Maps that were baked before the start; until the first bake.
    given: Vec<IlluminationMap>,
    debounce: Debounce,
    /// As they were at the last look.
    seen: BakeRequest,
    was_automatic: bool,
    /// The last request with its number; before the first one what the given maps are taken to be baked with.
    asked: Option<(u64, BakeRequest)>,
    /// Why the last edit was refused.
    pub refusal: Option<String>,
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
            surroundings: Surroundings::new(wake),
            state: BakeState::Idle,
            last: None,
            worth: None,
            given: options.maps.clone().unwrap_or_default(),
            debounce: Debounce::default(),
            seen: wanted.clone(),
            was_automatic: true,
            asked: options.maps.is_some().then_some((0, wanted)),
            refusal: None,
            edits: EditedScene::new(scene),
        };
        model.panel.display.exposure_stops = options.exposure_stops.unwrap_or(0.0);
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
        self.log.write(&Event::Travel(travel.name()));
    }

    /// Moves the camera by some time [s].
    pub fn advance(&mut self, seconds: f64) {
        if !self.navigator.is_moving() {
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
        self.debounce.due()
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
            _ => Quantity::Light,
        }
    }

    /// What an effect adds to the maps that are shown or takes from them, where that was found.
    fn difference(&self) -> Option<&Difference> {
        self.worth.as_ref()?.difference.as_ref().ok()
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
        // Until the next maps come, an edit may have made a receiver clear, or a mirror.
        let receives = |map: &&IlluminationMap| {
            let scene = self.scene();
            let object = scene.objects.get(map.chart.object());
            object.is_none_or(|object| scene.materials[object.material].surface.is_receiver())
        };
        let in_colours = match self.quantity() {
            Quantity::Light => None,
            Quantity::Error => Some(error_view::maps(self.maps())),
            Quantity::Difference => self.difference().map(difference_view::maps),
        };
        if let Some(maps) = in_colours {
            return Cow::Owned(maps.into_iter().filter(|map| receives(&map)).collect());
        }
        let LayerShown::Only(kind) = self.panel.display.layer else {
            return if self.maps().iter().all(|map| receives(&map)) {
                Cow::Borrowed(self.maps())
            } else {
                Cow::Owned(self.maps().iter().filter(receives).cloned().collect())
            };
        };
        let with_kind = self.maps().iter().filter(receives).filter_map(|map| {
            let layer = map.layer(kind)?.clone();
            let chart = Arc::clone(&map.chart);
            Some(IlluminationMap {
                chart,
                layers: vec![layer],
                error: None,
                estimated_relative_rmse: None,
            })
        });
        Cow::Owned(with_kind.collect())
    }

    /// Looks what the baking thread did; tells whether there are new maps to be shown.
    pub fn poll(&mut self) -> bool {
        // The state first: maps that come in between are taken by the next call, which the thread wakes.
        let state = self.worker.state();
        let mut has_maps = false;
        if let Some(level) = self.worker.take_level() {
            has_maps = self.improves_on_what_is_shown(&level);
            self.log.write(&if level.is_final {
                Event::Done(&level)
            } else {
                Event::Level {
                    level: &level,
                    shown: has_maps,
                }
            });
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
                BakeState::Cancelled => self.log.write(&Event::Cancelled),
                BakeState::Failed(sentence) => self.log.write(&Event::Failed(sentence)),
                BakeState::Idle
                | BakeState::Baking { .. }
                | BakeState::Comparing { .. }
                | BakeState::Done => {}
            }
        }
        self.state = state;
        has_maps
    }

    /// Shows what an effect is worth; tells whether there is anything new to be shown.
    fn take_worth(&mut self, worth: Worth) -> bool {
        let is_of_shown = |last: &Arc<BakedLevel>| Arc::ptr_eq(last, &worth.with);
        if !self.last.as_ref().is_some_and(is_of_shown) {
            return false;
        }
        self.log.write(&Event::Compared(&worth));
        if worth.difference.is_ok() {
            self.panel.display.quantity = Quantity::Difference;
        }
        self.worth = Some(worth);
        true
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
        match (
            new.result.estimated_relative_rmse,
            shown.result.estimated_relative_rmse,
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
        let wanted = self.wanted();
        if wanted.settings != self.seen.settings {
            self.log.write(&Event::SettingsChanged(&wanted.settings));
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
        let is_ripe = self.debounce.due().is_some() && self.has_answered();
        let is_due = self.debounce.is_due(now) || is_ripe;
        if wishes.rebake || (is_due && self.is_changed()) {
            self.rebake();
        } else if let Some(effect) = wishes.worth {
            self.compare(effect);
        }
    }

    /// Finds what an effect is worth to the maps that are shown, once these are done.
    fn compare(&mut self, effect: Effect) {
        let Some(last) = self.last.as_ref().filter(|last| last.is_final) else {
            return;
        };
        if self.worker.compare(effect, Arc::clone(last)) {
            self.state = self.worker.state();
        }
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

    /// Edits the scene, or takes an edit back.
    fn edit(&mut self, wishes: &Wishes) {
        // A slow frame may bring both: the end of a drag, and the wish to take it back.
        let mut outcome = Ok(());
        if let Some(edit) = &wishes.edit {
            self.log.write(&Event::Edited(edit));
            outcome = self.edits.edit(edit);
        }
        if wishes.undo && outcome.is_ok() {
            outcome = self.edits.undo().map(|undone| {
                if undone {
                    self.log.write(&Event::Undone);
                }
            });
        }
        if wishes.edit.is_some() || wishes.undo {
            self.refusal = outcome.err().map(|error| error.to_string());
        }
        if !wishes.is_dragging {
            self.edits.release();
        }
    }

    /// Bakes with the panel's settings, unless one of them is out of its range: the panel tells so.
    pub fn rebake(&mut self) {
        let wanted = self.wanted();
        if wanted.settings.validate().is_err() {
            return;
        }
        self.debounce.clear();
        self.log.write(&Event::Baking {
            settings: &wanted.settings,
        });
        self.asked = Some((self.worker.request(wanted.clone()), wanted));
        self.state = self.worker.state();
    }

    /// Stops the bake and keeps the maps that are shown.
    pub fn cancel(&mut self) {
        self.debounce.clear();
        self.worker.cancel();
    }
}

/// Whether a scene is lit otherwise than before: a lamp is another one, or an object elsewhere.
fn is_other_light(before: &Arc<Scene>, now: &Arc<Scene>) -> bool {
    let meshes = |scene: &Arc<Scene>| -> Vec<_> {
        let objects = scene.objects.iter();
        objects.map(|object| Arc::as_ptr(&object.mesh)).collect()
    };
    !Arc::ptr_eq(before, now) && (before.lights != now.lights || meshes(before) != meshes(now))
}
