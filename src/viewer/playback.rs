//! Playback of a moving scene: the requested moment, the moment shown, and the accuracy of the maps that follow.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

use glam::DVec2;

use crate::bake::Bake;
use crate::illumination::lookup::in_chart;
use crate::illumination::{Chart, IlluminationMap, Layer, Receiver};
use crate::scene::Scene;
use crate::settings::{BakeSettings, LayerKind, MapResolution};

/// Maps a second that moving light is to have.
const RATE_HZ: f64 = 12.0;
/// Error of the first maps of moving light, and the largest [1].
const FIRST_ERROR: f64 = 0.1;
const LARGEST_ERROR: f64 = 0.3;
/// Largest and smallest side of maps that follow [texels].
const LARGEST_SIDE: usize = 256;
const SMALLEST_SIDE: usize = 64;
/// Steps from one error to the next, and the share of the time below which a map is made more exact [1].
const ERROR_STEPS: (f64, f64) = (0.8, 3.0);
const SPARE: f64 = 0.5;
/// With maps slower than this share of what they may take, they get smaller [1]: four a second are enough.
const ENOUGH: f64 = 3.0;
/// Weight of the newest map in what is told of the rate [1].
const NEWEST: f64 = 0.2;
/// What the slider of a scene whose waves never end spans [s].
const WAVES_SPAN_S: f64 = 10.0;

/// A scene as it is at a moment.
#[derive(Clone, Debug)]
struct Moment {
    /// At rest, as it is edited.
    rest: Arc<Scene>,
    time_s: f64,
    scene: Arc<Scene>,
}

/// The clock of a scene, with the moments at both ends of a bake.
#[derive(Debug)]
pub struct Playback {
    /// Whether time goes on.
    pub is_playing: bool,
    /// Seconds of the scene in one second [1].
    pub speed: f64,
    /// The moment that is asked for [s]; 0 is the scene at rest.
    pub time_s: f64,
    asked: Option<Moment>,
    shown: Option<Moment>,
    error: f64,
    /// When the last maps came, and how many a second.
    learnt: Option<Instant>,
    rate_hz: Option<f64>,
    /// Texels along the longer side of maps that follow.
    side: usize,
    /// The last maps with all layers, at whatever moment.
    whole: Option<Arc<[IlluminationMap]>>,
    /// Their layers but the caustic, in charts of other sizes.
    resampled: HashMap<(Receiver, usize, usize), Vec<Layer>>,
}

impl Default for Playback {
    fn default() -> Self {
        Self {
            is_playing: false,
            speed: 1.0,
            time_s: 0.0,
            asked: None,
            shown: None,
            error: FIRST_ERROR,
            learnt: None,
            rate_hz: None,
            side: LARGEST_SIDE,
            whole: None,
            resampled: HashMap::new(),
        }
    }
}

impl Playback {
    /// From the first moment to the last that can be chosen [s].
    pub fn span_s(rest: &Scene) -> f64 {
        rest.clip.as_ref().map_or(WAVES_SPAN_S, |clip| clip.duration_s)
    }

    /// Lets time go on by so much [s of the clock]; behind the span it begins anew.
    pub fn advance(&mut self, seconds: f64, rest: &Scene) {
        self.time_s += seconds * self.speed;
        if rest.clip.is_some() {
            self.time_s %= Self::span_s(rest).max(f64::MIN_POSITIVE);
        }
    }

    /// Stands still at the moment that is shown.
    pub fn stop(&mut self) {
        (self.is_playing, self.learnt, self.rate_hz) = (false, None, None);
        self.time_s = self.shown.as_ref().map_or(0.0, |shown| shown.time_s);
        self.asked.clone_from(&self.shown);
    }

    /// The scene at the moment that is asked for.
    pub fn ask(&mut self, rest: &Arc<Scene>) -> Arc<Scene> {
        if self.time_s == 0.0 {
            self.asked = None;
            return Arc::clone(rest);
        }
        let known = self.asked.take().filter(|known| known.is(rest, self.time_s));
        let moment = known.unwrap_or_else(|| Moment::of(rest, self.time_s));
        let scene = Arc::clone(&moment.scene);
        self.asked = Some(moment);
        scene
    }

    /// The scene that is asked for, as it was last made.
    pub fn wanted<'a>(&'a self, rest: &'a Arc<Scene>) -> &'a Arc<Scene> {
        let known = self.asked.as_ref().filter(|known| known.is(rest, self.time_s));
        known.map_or(rest, |known| &known.scene)
    }

    /// The scene that is shown: at the moment of its maps.
    pub fn shown<'a>(&'a self, rest: &'a Arc<Scene>) -> &'a Arc<Scene> {
        let known = self.shown.as_ref().filter(|known| Arc::ptr_eq(&known.rest, rest));
        known.map_or(rest, |known| &known.scene)
    }

    /// What is shown stays at its moment though the scene was edited.
    pub fn follow(&mut self, rest: &Arc<Scene>) {
        if let Some(shown) = self
            .shown
            .as_mut()
            .filter(|shown| !Arc::ptr_eq(&shown.rest, rest))
        {
            *shown = Moment::of(rest, shown.time_s);
        }
    }

    /// Shows the moment of maps that came.
    pub fn show(&mut self, scene: &Arc<Scene>) {
        let is_of_asked = |asked: &&Moment| Arc::ptr_eq(&asked.scene, scene);
        self.shown = self.asked.as_ref().filter(is_of_asked).cloned();
    }

    /// Settings of maps that follow the light: only what moves, as exact as the machine can do it in time.
    pub fn settings(&self, of_user: &BakeSettings, rest: &Scene) -> BakeSettings {
        let mut settings = of_user.clone();
        let moves_shadows = rest.clip.is_some();
        let follows = |layer: &LayerKind| match layer {
            LayerKind::Caustic => true,
            LayerKind::Direct => moves_shadows,
            LayerKind::Indirect => false,
        };
        settings.layers.retain(follows);
        if settings.layers.is_empty() {
            settings.layers.push(LayerKind::Caustic);
        }
        if let Some(finest) = settings.max_error {
            let error = self.error.max(finest);
            settings.max_error = Some(error);
            settings.density_per_sr = BakeSettings::starting_density_per_sr(error);
            let (width, height) = match of_user.map_resolution {
                MapResolution::Fixed { width, height } => (width, height),
                MapResolution::Auto => (self.side, self.side),
            };
            settings.map_resolution = MapResolution::Fixed {
                width: width.min(self.side),
                height: height.min(self.side),
            };
        }
        settings
    }

    /// Learns from maps that came now what the next ones can be; `seconds` is what they took.
    pub fn learn(&mut self, seconds: f64, now: Instant) {
        let share = seconds * RATE_HZ;
        if share > ENOUGH && self.error >= LARGEST_ERROR && self.side > SMALLEST_SIDE {
            self.side /= 2;
        }
        if share < SPARE && self.error < FIRST_ERROR && self.side < LARGEST_SIDE {
            self.side *= 2;
        }
        // Noise falls with the square root of the time that it is given.
        if !(SPARE..=1.0).contains(&share) {
            let step = share.sqrt().clamp(ERROR_STEPS.0, ERROR_STEPS.1);
            self.error = (self.error * step).min(LARGEST_ERROR);
        }
        if let Some(before) = self.learnt.replace(now) {
            let rate_hz = now.duration_since(before).as_secs_f64().max(1e-3).recip();
            let known = self.rate_hz.unwrap_or(rate_hz);
            self.rate_hz = Some(known + NEWEST * (rate_hz - known));
        }
    }

    /// Maps a second, the error that they aim at [1], and their largest side [texels]; `None` before the second.
    pub fn rate(&self) -> Option<(f64, f64, usize)> {
        self.rate_hz.map(|rate_hz| (rate_hz, self.error, self.side))
    }

    /// Keeps the layers of maps that were baked whole.
    pub fn keep(&mut self, maps: &[IlluminationMap]) {
        self.whole = Some(maps.into());
        self.resampled.clear();
    }

    /// Adds the layers that were not baked, as they last were.
    pub fn complete(&mut self, result: &mut Bake) {
        let Some(whole) = self.whole.clone() else { return };
        for whole in &*whole {
            let is_same = |map: &&mut IlluminationMap| map.chart.receiver == whole.chart.receiver;
            if let Some(map) = result.maps.iter_mut().find(is_same) {
                *map = map.dense().into_owned();
                let layers = self.resampled(whole, &map.chart);
                let is_missing = |layer: &&Layer| map.layer(layer.kind).is_none();
                let missing: Vec<Layer> = layers.iter().filter(is_missing).cloned().collect();
                map.layers.extend(missing);
            } else {
                let mut map = whole.clone();
                map.layers.retain(|layer| layer.kind != LayerKind::Caustic);
                result.maps.extend((!map.layers.is_empty()).then_some(map));
            }
        }
        result.maps.sort_by_key(|map| map.chart.receiver);
    }

    /// Layers of a map but its caustic, in the texels of another chart of the surface.
    fn resampled(&mut self, whole: &IlluminationMap, chart: &Chart) -> &[Layer] {
        let key = (chart.receiver, chart.width, chart.height);
        self.resampled.entry(key).or_insert_with(|| {
            let others = whole
                .layers
                .iter()
                .filter(|layer| layer.kind != LayerKind::Caustic);
            others.map(|layer| resampled(whole, layer, chart)).collect()
        })
    }
}

fn resampled(whole: &IlluminationMap, layer: &Layer, chart: &Chart) -> Layer {
    let size = DVec2::new(chart.width as f64, chart.height as f64);
    let texel = |index: usize| {
        let place = DVec2::new((index % chart.width) as f64, (index / chart.width) as f64);
        let light = in_chart(&whole.chart, &layer.irradiance, (place + 0.5) / size);
        [light.r, light.g, light.b].map(|channel| channel as f32)
    };
    Layer {
        kind: layer.kind,
        irradiance: (0..chart.width * chart.height).map(texel).collect(),
    }
}

impl Moment {
    fn of(rest: &Arc<Scene>, time_s: f64) -> Self {
        Self {
            rest: Arc::clone(rest),
            time_s,
            scene: Arc::new(rest.at(time_s)),
        }
    }

    fn is(&self, rest: &Arc<Scene>, time_s: f64) -> bool {
        Arc::ptr_eq(&self.rest, rest) && self.time_s == time_s
    }
}
