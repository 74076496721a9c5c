//! Assembles the finished maps from the levels of the lights, which are stored at unit strength.

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use super::caustic::{CausticOutcome, Stopped};
use super::direct_cache::{DirectCache, DirectChart, DirectCharts};
use super::forecast::ForecastReport;
use super::light_level::LightLevel;
use super::map_plan::MEMORY;
use super::map_size::{self, SizeRequest};
use super::sizes::{ChartCache, MapMemory};
use super::{Bake, LightLayer, StopReason, map_plan};
use crate::effect::EffectSwitch;
use crate::error::Warning;
use crate::illumination::accumulator::FluxAccumulator;
use crate::illumination::gutter::fill_gutter;
use crate::illumination::map::estimated_relative_rmse;
use crate::illumination::resolution::variance_within;
use crate::illumination::smoothing::smooth;
use crate::illumination::visible::visible_error;
use crate::illumination::{Chart, IlluminationMap, Layer, Receiver};
use crate::light_pass::accuracy;
use crate::light_pass::ledger::LightLedger;
use crate::light_pass::receiver_maps::ReceiverMap;
use crate::optics::{LinearSrgb, luminance};
use crate::plan::{self, Effect, EffectPlan};
use crate::progress::Progress;
use crate::scene::{Light, Scene};
use crate::settings::{BakeSettings, LayerKind, Sigma};

/// Index of a light in the scene, and its finest level.
pub(super) type CompletedLevel<'a> = (usize, &'a LightLevel);

/// Inputs of the assembly.
#[derive(Clone, Copy)]
pub(super) struct MapAssembler<'a> {
    pub(super) scene: &'a Scene,
    pub(super) sizes: &'a ChartCache,
    pub(super) settings: &'a BakeSettings,
    pub(super) plan: &'a EffectPlan,
    pub(super) direct: DirectDetail,
}

/// How finely direct light is baked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DirectDetail {
    /// Not at all.
    Absent,
    /// For a first look, or because the visible error weighs caustics against it.
    Coarse,
    /// As the maps ask for.
    Full,
}

/// Halvings of coarse direct maps below the requested size.
const COARSE_HALVINGS: u32 = 2;

/// Fraction of the time limit after which direct light is not refined further.
const PART_OF_DIRECT: f64 = 0.5;

impl DirectDetail {
    /// What a bake needs.
    pub(super) fn of(plan: &EffectPlan, settings: &BakeSettings) -> Self {
        if plan.is_on(Effect::Direct) {
            Self::Full
        } else if plan::weighs_direct(settings, plan.is_on(Effect::LightPass)) {
            Self::Coarse
        } else {
            Self::Absent
        }
    }

    /// What a first look needs: nothing that it does not show.
    pub(super) fn of_first_look(self) -> Self {
        match self {
            Self::Full => Self::Coarse,
            Self::Coarse | Self::Absent => Self::Absent,
        }
    }

    /// The progress that its bake reports to: `shown`, or none where it only weighs the error or previews the layer.
    pub(super) fn progress(self, shown: &dyn Progress) -> &dyn Progress {
        match self {
            Self::Full => shown,
            Self::Coarse | Self::Absent => &(),
        }
    }

    /// Time until which direct light may be refined, since the bake began [s]: caustics and indirect light still wait.
    pub(super) fn limit_s(self, settings: &BakeSettings) -> Option<f64> {
        match self {
            // A few samples of each texel are enough.
            Self::Coarse => Some(0.0),
            Self::Full | Self::Absent => settings.max_time_s.map(|limit_s| PART_OF_DIRECT * limit_s),
        }
    }

    fn halvings(self) -> u32 {
        if self == Self::Coarse { COARSE_HALVINGS } else { 0 }
    }
}

/// Levels of all lights with maps, in scene order.
pub(super) type Levels<'a> = [CompletedLevel<'a>];

/// Charts of all maps, by receiver.
pub(super) type Charts = BTreeMap<Receiver, Arc<Chart>>;

/// Light of one level on one map.
type LitMap<'a> = (&'a Light, &'a LightLevel, &'a ReceiverMap);

impl MapAssembler<'_> {
    /// Assembles the result, without layers that were baked only as sources of indirect light.
    pub(super) fn result(
        &self,
        (mut maps, mut light_layers): (Vec<IlluminationMap>, Vec<LightLayer>),
        levels: &Levels,
        outcome: &CausticOutcome,
    ) -> Bake {
        // The visible error is relative to the light of all layers, so that it is estimated before some of them are
        // dropped.
        let is_shown = |kind: LayerKind| plan::is_wanted(self.settings, kind);
        let ledgers = self.ledgers(levels);
        let truncated = truncated_share(&ledgers);
        let estimated_visible = self.estimate_visible(&mut maps, truncated);

        // Layers that were sources of indirect light or a backdrop of the error alone are not delivered.
        for map in &mut maps {
            map.layers.retain(|layer| is_shown(layer.kind));
            map.estimated_relative_rmse = estimated_relative_rmse(std::slice::from_ref(map));
        }
        maps.retain(|map| !map.layers.is_empty());
        light_layers.retain(|part| is_shown(part.kind));

        // The errors of texels do not know of truncated light: its share adds in squares.
        let estimated_relative_rmse = estimated_relative_rmse(&maps).map(|rmse| rmse.hypot(truncated));
        let metric = self.settings.error_metric;
        let estimated_error = metric.of(estimated_visible, estimated_relative_rmse);

        // A target that is missed although refinement ended is due to texels that memory made too large.
        let is_scarce = outcome.warnings.iter().any(|warning| warning.location == MEMORY);
        let target = self.settings.max_error.unwrap_or(f64::INFINITY);
        let stop_reason = match outcome.stopped {
            Some(Stopped::Cancelled) => StopReason::Cancelled,
            Some(Stopped::Time) => StopReason::MaxTime,
            Some(Stopped::Target) if is_scarce && estimated_error > Some(target) => StopReason::Memory,
            Some(Stopped::Target) => StopReason::MaxError,
            None if self.plan.is_on(Effect::LightPass) || self.plan.is_on(Effect::Direct) => {
                StopReason::Density
            }
            None => StopReason::NothingToDo,
        };

        // Clipped texels and an empty caustic layer look like proper maps, so that warnings tell of them.
        let mut warnings = outcome.warnings.clone();
        warnings.extend(beyond_single(&maps));
        warnings.extend(self.empty_layer());
        Bake {
            estimated_relative_rmse,
            estimated_visible,
            band_layers: self.band_layers(&maps, levels),
            maps,
            light_layers,
            plan: self.plan.clone(),
            ledgers,
            counts: outcome.counts,
            course: outcome.course.clone(),
            forecast: outcome.forecast.and_then(|(made_at, expected)| {
                let actual = *outcome.course.last()?;
                Some(ForecastReport {
                    made_at,
                    expected,
                    actual,
                })
            }),
            stop_reason,
            partial: stop_reason == StopReason::Cancelled,
            warnings,
            ..Bake::default()
        }
    }

    /// Energy of the caustic layer, light by light.
    fn ledgers(&self, levels: &Levels) -> Vec<LightLedger> {
        let ledgers = levels.iter().map(|(light, level)| {
            let light = &self.scene.lights[*light];
            let ledger = level
                .ledger
                .report(&light.name, level.unit, level.strength(light));
            LightLedger {
                carried_w: level.carried_w(ledger.energy_w.deposited, light),
                ..ledger.with_radiant(level.radiant, level.deposited_radiant_w(light))
            }
        });
        ledgers.collect()
    }

    /// The visible error of all maps and of each, beside the light of all layers; `None` if direct light is not known.
    fn estimate_visible(&self, maps: &mut [IlluminationMap], truncated: f64) -> Option<f64> {
        let is_off = self.settings.effects.get(Effect::Direct) == EffectSwitch::Off;
        if self.direct == DirectDetail::Absent && !is_off {
            return None;
        }
        let is_traced =
            |kind: &LayerKind| *kind != LayerKind::Direct && plan::is_wanted(self.settings, *kind);
        let traced: Vec<LayerKind> = LayerKind::ALL.into_iter().filter(is_traced).collect();
        let (all, of_maps) = visible_error(maps, &traced, truncated);
        for (map, error) in maps.iter_mut().zip(of_maps) {
            map.estimated_visible = error;
        }
        all
    }

    /// The warning that the caustic layer is empty, where other layers fill the maps.
    fn empty_layer(&self) -> Option<Warning> {
        let mut effects = self.plan.effects.iter();
        let pass = effects.find(|line| line.effect == Effect::LightPass)?;
        let is_wanted = self.settings.layers.len() > 1 && self.settings.layers.contains(&LayerKind::Caustic);
        (is_wanted && !pass.on && pass.switch == EffectSwitch::Auto).then(|| {
            Warning::new(
                "caustic layer",
                format!("is empty: {}", pass.reason),
                "leave it out of --layers, or make a lit surface clear or smooth",
            )
        })
    }

    /// Caustic and direct layers of all maps, with all lights at their strengths and the error of the caustic layer;
    /// and each light's part if requested.
    pub(super) fn maps(
        &self,
        levels: &Levels,
        charts: &Charts,
        direct: &DirectCache,
    ) -> (Vec<IlluminationMap>, Vec<LightLayer>) {
        let maps = charts
            .values()
            .map(|chart| self.map(chart, levels, direct))
            .collect();
        (maps, self.light_layers(charts, levels, direct))
    }

    /// Charts of all maps: those that received flux and, if direct or indirect light is requested, every receiver that
    /// a light may reach; with a warning if the memory limit makes the latter coarser.
    pub(super) fn charts(&self, levels: &Levels) -> (Charts, Option<Warning>) {
        // Lit receivers keep the chart that their flux was deposited on. The others get one where direct or indirect
        // light may fall on them.
        let (mut charts, mut wishes) = (Charts::new(), BTreeMap::new());
        let is_everywhere = self.direct != DirectDetail::Absent || self.plan.is_on(Effect::Indirect);
        for receiver in Receiver::all(self.scene.objects.len()) {
            let lit = levels.iter().find_map(|(_, level)| level.maps.get(receiver));
            if let Some(map) = lit {
                charts.insert(receiver, map.chart.clone());
            } else if is_everywhere
                && self.sizes.may_see_lights(receiver)
                && let Some(wish) = self.direct_wish(receiver)
            {
                wishes.insert(receiver, wish);
            }
        }

        // These others share the memory that lit maps and the cache of direct light leave.
        let lights = |receiver: Receiver| {
            levels
                .iter()
                .filter(move |(_, level)| level.maps.get(receiver).is_some())
        };
        let lights = charts
            .keys()
            .map(|&receiver| (receiver, lights(receiver).count() as u64));
        let memory = &MapMemory::finished(lights.collect());
        let texels = charts
            .iter()
            .map(|(&receiver, chart)| (receiver, chart.texel_count() as u64));
        let taken = memory.bytes(texels) + self.settings.direct_bytes();
        let left = self.settings.memory_bytes.saturating_sub(taken);

        // If it is short, they are made coarser together. Coarse direct maps only weigh the error or stand in for the
        // first look, so that no one is warned.
        let requested = map_size::requested(&wishes);
        let sizes = map_size::fit(&wishes, (left, memory));
        for (&receiver, size) in &sizes {
            if let Some(chart) = self.sizes.chart_of(receiver, size) {
                charts.insert(receiver, chart);
            }
        }
        let is_shown = self.direct != DirectDetail::Coarse;
        let warning = (is_shown && sizes != requested)
            .then(|| map_plan::memory_warning(&requested, &sizes, (left, memory)));
        (charts, warning)
    }

    /// The charts that direct light is baked on: not tiled, and no finer than needed.
    pub(super) fn direct_charts(&self, charts: &Charts) -> DirectCharts {
        let charts = charts.values();
        charts
            .filter_map(|chart| Some((chart.receiver, self.direct_chart(chart)?)))
            .collect()
    }

    /// Size request of a map with direct and indirect light only.
    fn direct_wish(&self, receiver: Receiver) -> Option<SizeRequest> {
        if self.direct == DirectDetail::Coarse {
            return self.direct_size(receiver.object()).map(SizeRequest::dense);
        }
        self.sizes.direct_wish(receiver, self.settings)
    }

    fn direct_size(&self, object: usize) -> Option<(usize, usize)> {
        let size = self.sizes.direct_size(object, self.settings)?;
        Some(map_size::halved(size, self.direct.halvings()))
    }

    fn direct_chart(&self, chart: &Arc<Chart>) -> Option<DirectChart> {
        let doublings = match self.direct {
            DirectDetail::Full => self.sizes.border_doublings(chart.receiver, self.settings),
            DirectDetail::Coarse | DirectDetail::Absent => 0,
        };
        let is_coarse = self.direct == DirectDetail::Coarse;
        if chart.layout.is_none() && !is_coarse && doublings == 0 {
            return Some(DirectChart {
                map: Arc::clone(chart),
                own: Arc::clone(chart),
                smaller: None,
            });
        }
        let size = (chart.width, chart.height);
        let times = self.sizes.direct_halvings(chart.object(), size, self.settings) + self.direct.halvings();
        let of_size = |times: u32| self.sizes.chart(chart.receiver, map_size::halved(size, times));
        let finer = times.min(doublings);
        Some(DirectChart {
            map: Arc::clone(chart),
            own: of_size(times)?,
            smaller: (finer > 0).then(|| of_size(times - finer)).flatten(),
        })
    }

    fn map(&self, chart: &Arc<Chart>, levels: &Levels, direct: &DirectCache) -> IlluminationMap {
        let lit: Vec<LitMap> = levels
            .iter()
            .filter_map(|(light, level)| {
                let map = level.maps.get(chart.receiver)?;
                Some((&self.scene.lights[*light], *level, map))
            })
            .collect();
        let mut layers = Vec::new();
        if !lit.is_empty() {
            layers.push(self.caustic_layer(chart, &lit));
        }
        if self.direct != DirectDetail::Absent {
            layers.extend(self.direct_layer(chart, direct));
        }
        let is_shown = plan::is_wanted(self.settings, LayerKind::Caustic);
        let error = is_shown.then(|| error_of(chart, &lit)).flatten();
        let error = error.map(|error| with_resolution(chart, &lit, &layers, error));
        IlluminationMap {
            chart: Arc::clone(chart),
            layers,
            error,
            estimated_relative_rmse: None,
            estimated_visible: None,
        }
    }

    /// E = ΣΦ/A per texel; 0 where the texel holds no surface, except in the gutter.
    fn caustic_layer(&self, chart: &Chart, lit: &[LitMap]) -> Layer {
        let mut sums = vec![LinearSrgb::BLACK; chart.texel_count()];
        for (light, level, map) in lit {
            let mut flux = map.flux().into_owned();
            self.smooth(chart, level, &mut flux);
            let scale = level.strength(light) * level.unit.watts();
            let texels = sums.par_iter_mut().zip(flux.texels());
            texels.for_each(|(sum, counts)| {
                *sum += LinearSrgb::from(counts.map(|count| count as f64)) * scale;
            });
        }
        let mean = |(texel, sum): (usize, &LinearSrgb)| chart.per_area(texel, *sum).to_array().map(single);
        let mut irradiance: Vec<[f32; 3]> = sums.par_iter().enumerate().map(mean).collect();
        fill_gutter(chart, &mut irradiance);
        Layer {
            kind: LayerKind::Caustic,
            irradiance,
        }
    }

    /// Smooths flux on a map by sigma; splats have it in their kernels. The radius is that of a ray's footprint at
    /// nominal density and at the light's reach, whatever the refinement. Maps with gaps are not smoothed: the filter
    /// mirrors at the borders of the map, not at those of charts.
    pub(super) fn smooth(&self, chart: &Chart, level: &LightLevel, flux: &mut FluxAccumulator) {
        if let (true, Sigma::Constant(sigma)) = (self.settings.estimator.refines(), self.settings.sigma)
            && chart.is_full()
        {
            let texel_m = (chart.area_m2() / (chart.width * chart.height) as f64).sqrt();
            let radius_m = level.reach_m / (std::f64::consts::PI * self.settings.density_per_sr).sqrt();
            smooth(flux, chart.layout.as_deref(), sigma.sqrt() * radius_m / texel_m);
        }
    }

    /// Each light's part of all layers, if requested.
    fn light_layers(&self, charts: &Charts, levels: &Levels, direct: &DirectCache) -> Vec<LightLayer> {
        let mut layers = Vec::new();
        if !self.settings.per_light {
            return layers;
        }
        for (&receiver, chart) in charts {
            let part = |light: usize, layer: Layer| LightLayer {
                receiver,
                light,
                kind: layer.kind,
                irradiance: layer.irradiance,
            };
            for (light, level) in levels {
                if let Some(map) = level.maps.get(receiver) {
                    let lit = [(&self.scene.lights[*light], *level, map)];
                    layers.push(part(*light, self.caustic_layer(chart, &lit)));
                }
            }
            if self.plan.is_on(Effect::Direct) {
                let lights = 0..self.scene.lights.len();
                layers.extend(lights.filter_map(|light| {
                    let irradiance = direct.of_light(light, &self.direct_chart(chart)?, self.scene)?;
                    let kind = LayerKind::Direct;
                    Some(part(light, Layer { kind, irradiance }))
                }));
            }
        }
        layers
    }

    pub(super) fn direct_layer(&self, chart: &Arc<Chart>, direct: &DirectCache) -> Option<Layer> {
        Some(Layer {
            kind: LayerKind::Direct,
            irradiance: direct.together(&self.direct_chart(chart)?, &self.scene.lights)?,
        })
    }
}

/// Converts to the precision of maps, clamped to `f32::MAX`; [`beyond_single`] reports clamped texels.
pub(super) fn single(value: f64) -> f32 {
    value.min(f64::from(f32::MAX)) as f32
}

/// The warning about clamped texels.
fn beyond_single(maps: &[IlluminationMap]) -> Option<Warning> {
    let values = maps
        .iter()
        .flat_map(|map| &map.layers)
        .flat_map(|layer| &layer.irradiance);
    let texels = values.filter(|texel| texel.contains(&f32::MAX)).count();
    (texels > 0).then(|| {
        Warning::new(
            "maps",
            format!(
                "{texels} texels are brighter than {:.1e} W/m², the most that a map holds; they were clipped to it",
                f32::MAX
            ),
            "make the lights weaker",
        )
    })
}

/// The error including detail lost in texels that are larger than requested.
fn with_resolution(chart: &Chart, lit: &[LitMap], layers: &[Layer], error: Vec<f32>) -> Vec<f32> {
    let halved = lit
        .iter()
        .find_map(|(_, level, _)| level.key.sizes.get(&chart.receiver))
        .map_or(0, |size| size.halved);
    let is_coarser = halved > 0
        || chart
            .layout
            .as_ref()
            .is_some_and(|layout| layout.tiles().any(|tile| tile.lost > 0));
    let caustic = layers.iter().find(|layer| layer.kind == LayerKind::Caustic);
    let Some(caustic) = caustic.filter(|_| is_coarser) else {
        return error;
    };
    let values: Vec<f64> = caustic.irradiance.iter().map(luminance).collect();
    let variances = variance_within(chart, &values, halved);
    let both = |(error, variance): (f32, f64)| single((f64::from(error).powi(2) + variance).sqrt());
    error.into_iter().zip(variances).map(both).collect()
}

/// Truncated share of the light of all maps.
fn truncated_share(ledgers: &[LightLedger]) -> f64 {
    let (mut lost_w, mut deposited_w) = (0.0, 0.0);
    for ledger in ledgers {
        let share = accuracy::truncated_share(&ledger.energy_w);
        lost_w += share * ledger.energy_w.deposited;
        deposited_w += ledger.energy_w.deposited;
    }
    if deposited_w > 0.0 {
        lost_w / deposited_w
    } else {
        0.0
    }
}

/// Error of each texel's luminance over all lights [W/m²]; `None` if one is unknown or there is no light.
fn error_of(chart: &Chart, lit: &[LitMap]) -> Option<Vec<f32>> {
    let mut squares = vec![0.0; chart.texel_count()];
    for (light, level, _) in lit {
        let strength = light.strength().luminance();
        let error = level.error.as_ref()?;
        for (square, texel) in squares.iter_mut().zip(error.maps.get(&chart.receiver)?) {
            *square += (f64::from(*texel) * strength).powi(2);
        }
    }
    let root = |square: &f64| single(square.sqrt());
    (!lit.is_empty()).then(|| squares.iter().map(root).collect())
}
