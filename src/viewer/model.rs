//! Everything that the window shows and does, without the window.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::Instant;

use super::ViewerOptions;
use super::debounce::Debounce;
use super::event_log::{Event, EventLog};
use super::navigation::Navigator;
use super::panel::{LayerShown, Panel, Wishes};
use super::worker::{BakeState, FinishedBake, Worker};
use crate::error::Result;
use crate::illumination::IlluminationMap;
use crate::scene::Scene;
use crate::session::BakeSession;
use crate::settings::{BakeSettings, LayerKind};

/// Rays of a bake for each of its draft, at least.
const DRAFT_SHARE: f64 = 32.0;
/// A draft of more rays would not come soon [rays/sr].
const FINEST_DRAFT_PER_SR: f64 = 4000.0;
/// A draft of fewer rays would show nothing; then there is none [rays/sr].
const COARSEST_DRAFT_PER_SR: f64 = 500.0;

/// The state behind the window.
#[derive(Debug)]
pub struct Model {
    /// What is shown.
    pub scene: Arc<Scene>,
    /// What the user can set.
    pub panel: Panel,
    /// From where it is seen.
    pub navigator: Navigator,
    /// What happened.
    pub log: EventLog,
    worker: Worker,
    state: BakeState,
    /// The bake that the picture shows.
    pub last: Option<FinishedBake>,
    /// Maps that were baked before the start; until the first bake.
    given: Vec<IlluminationMap>,
    debounce: Debounce,
    /// As the panel had them at the last look.
    seen: BakeSettings,
    was_automatic: bool,
    /// Whether the picture shows maps of another bake than the one that was asked for last.
    pub is_draft: bool,
    /// As the last bake was asked for.
    asked: Option<BakeSettings>,
}

impl Model {
    /// Starts the baking thread, and a bake unless there are maps. `wake` is called when the thread has news.
    ///
    /// # Errors
    /// The event log cannot be written; the system gives no thread.
    pub fn new(options: &ViewerOptions, wake: impl Fn() + Send + Sync + 'static) -> Result<Self> {
        let scene = Arc::clone(&options.scene);
        let of_worker = Arc::clone(&scene);
        let worker = Worker::spawn(move || BakeSession::new(Arc::clone(&of_worker)), wake)?;
        let mut model = Self {
            navigator: Navigator::new(&scene, options.camera.as_deref()),
            panel: Panel::new(options.settings.clone()),
            log: EventLog::open(options.event_log.as_deref())?,
            worker,
            state: BakeState::Idle,
            last: None,
            given: options.maps.clone().unwrap_or_default(),
            debounce: Debounce::default(),
            seen: options.settings.clone(),
            was_automatic: true,
            is_draft: false,
            asked: options.maps.is_some().then(|| options.settings.clone()),
            scene,
        };
        model.panel.display.exposure_stops = options.exposure_stops.unwrap_or(0.0);
        if options.maps.is_none() {
            model.first_bake();
        }
        Ok(model)
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

    /// The maps with the layers that the panel asks to be shown.
    pub fn shown_maps(&self) -> Cow<'_, [IlluminationMap]> {
        let LayerShown::Only(kind) = self.panel.display.layer else {
            return Cow::Borrowed(self.maps());
        };
        let with_kind = self.maps().iter().filter_map(|map| {
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

    /// Looks what the baking thread did; tells whether there are new maps.
    pub fn poll(&mut self) -> bool {
        // The state first: maps that come in between are taken by the next call, which the thread wakes.
        let state = self.worker.state();
        let finished = self.worker.take_finished();
        let has_maps = finished.is_some();
        if let Some(finished) = finished {
            self.is_draft = self.asked.as_ref() != Some(&finished.settings);
            self.log.write(&if self.is_draft {
                Event::Draft(&finished)
            } else {
                Event::Done(&finished)
            });
            self.last = Some(finished);
        }
        if std::mem::discriminant(&state) != std::mem::discriminant(&self.state) {
            match &state {
                BakeState::Cancelled => self.log.write(&Event::Cancelled),
                BakeState::Failed(sentence) => self.log.write(&Event::Failed(sentence)),
                BakeState::Idle | BakeState::Baking { .. } | BakeState::Done => {}
            }
        }
        self.state = state;
        has_maps
    }

    /// Does what was pressed, and bakes changed settings once they have come to rest.
    pub fn act(&mut self, wishes: Wishes, now: Instant) {
        if self.panel.settings != self.seen {
            self.seen = self.panel.settings.clone();
            self.log.write(&Event::SettingsChanged(&self.seen));
            self.debounce.change(now);
        }
        if self.panel.automatic && !self.was_automatic {
            self.debounce.change(now);
        }
        self.was_automatic = self.panel.automatic;
        if !self.panel.automatic {
            self.debounce.clear();
        }
        if wishes.cancel {
            self.cancel();
        }
        let is_changed = self.asked.as_ref() != Some(&self.panel.settings);
        if wishes.rebake || (self.debounce.is_due(now) && is_changed) {
            self.rebake();
        }
    }

    /// Something to see soon: a draft, and then what was asked for.
    fn first_bake(&mut self) {
        let wanted = self.panel.settings.clone();
        let draft = BakeSettings {
            density_per_sr: (wanted.density_per_sr / DRAFT_SHARE).min(FINEST_DRAFT_PER_SR),
            ..wanted.clone()
        };
        let steps = if draft.density_per_sr >= COARSEST_DRAFT_PER_SR {
            vec![draft, wanted]
        } else {
            vec![wanted]
        };
        self.bake(steps);
    }

    /// Bakes with the panel's settings, unless one of them is out of its range: the panel tells so.
    pub fn rebake(&mut self) {
        if self.panel.settings.validate().is_ok() {
            self.bake(vec![self.panel.settings.clone()]);
        }
    }

    fn bake(&mut self, steps: Vec<BakeSettings>) {
        self.debounce.clear();
        self.asked = steps.last().cloned();
        self.log.write(&Event::Baking {
            settings: &self.panel.settings,
        });
        self.worker.request_steps(steps);
        self.state = self.worker.state();
    }

    /// Stops the bake and keeps the maps that are shown.
    pub fn cancel(&mut self) {
        self.debounce.clear();
        self.worker.cancel();
    }
}
