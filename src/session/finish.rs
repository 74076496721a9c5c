//! From levels of lights of unit strength to finished maps.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use glam::DVec2;
use rayon::prelude::*;

use super::caustic::{CausticOutcome, Stopped};
use super::direct_cache::DirectCache;
use super::forecast::ForecastReport;
use super::light_level::LightLevel;
use super::map_plan::MEMORY;
use super::map_size::{self, Wish};
use super::sizes::{BYTES_PER_TEXEL, MapSizes};
use super::{BakeResult, LightLayer, StopReason, Timings, map_plan};
use crate::error::Warning;
use crate::illumination::accumulator::FluxAccumulator;
use crate::illumination::gutter::fill_gutter;
use crate::illumination::lookup::bilinear;
use crate::illumination::resolution::variance_within;
use crate::illumination::smoothing::smooth;
use crate::illumination::tiles::{Tile, TileLayout};
use crate::illumination::visible::visible_error;
use crate::illumination::{Chart, IlluminationMap, Layer, Receiver, UvSet};
use crate::light_pass::accuracy;
use crate::light_pass::ledger::LightLedger;
use crate::light_pass::receiver_maps::ReceiverMap;
use crate::optics::{LinearSrgb, luminance};
use crate::plan::{self, Effect, EffectPlan};
use crate::scene::{Light, Scene};
use crate::settings::{BakeSettings, LayerKind, Sigma};

/// The finest level of a light, with the light's place in the scene.
pub(super) type Shown<'a> = (usize, &'a LightLevel);

/// All that finishing needs.
#[derive(Clone, Copy)]
pub(super) struct Finish<'a> {
    pub(super) scene: &'a Scene,
    pub(super) sizes: &'a MapSizes,
    pub(super) settings: &'a BakeSettings,
    pub(super) plan: &'a EffectPlan,
    /// Halvings of maps of direct light below the size that is asked for.
    pub(super) coarsening: u32,
}

/// Levels of all lights that have maps, in the scene's order.
pub(super) type Levels<'a> = [Shown<'a>];

/// Charts of all maps, by receiver.
pub(super) type Charts = BTreeMap<Receiver, Arc<Chart>>;

/// Light on one map.
type Lit<'a> = (&'a Light, &'a LightLevel, &'a ReceiverMap);

impl Finish<'_> {
    /// Puts everything together, but for layers that were baked only for others to gather from.
    pub(super) fn result(
        &self,
        (mut maps, mut light_layers): (Vec<IlluminationMap>, Vec<LightLayer>),
        levels: &Levels,
        outcome: &CausticOutcome,
    ) -> BakeResult {
        let is_shown = |kind: LayerKind| plan::is_wanted(self.settings, kind);
        for map in &mut maps {
            map.layers.retain(|layer| is_shown(layer.kind));
            map.estimated_relative_rmse = relative_rmse(std::slice::from_ref(map));
        }
        maps.retain(|map| !map.layers.is_empty());
        light_layers.retain(|part| is_shown(part.kind));
        let ledgers = levels.iter().map(|(light, level)| {
            let light = &self.scene.lights[*light];
            let ledger = level
                .ledger
                .report(&light.name, level.unit, level.strength(light));
            ledger.with_radiant(level.radiant, level.deposited_radiant_w(light))
        });
        let ledgers: Vec<LightLedger> = ledgers.collect();
        let given_up = given_up_share(&ledgers);
        let estimated_relative_rmse = relative_rmse(&maps).map(|rmse| rmse.hypot(given_up));
        let (estimated_visible, of_maps) = visible_error(&maps, given_up);
        for (map, error) in maps.iter_mut().zip(of_maps) {
            map.estimated_visible = error;
        }
        let metric = self.settings.error_metric;
        let estimated_error = metric.of(estimated_visible, estimated_relative_rmse);
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
        let mut warnings = outcome.warnings.clone();
        warnings.extend(beyond_single(&maps));
        BakeResult {
            estimated_relative_rmse,
            estimated_visible,
            band_layers: self.band_layers(&maps, levels),
            maps,
            light_layers,
            plan: self.plan.clone(),
            item_buffers: Vec::new(),
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
            timings_s: Timings::default(),
            cpu_s: Timings::default(),
            stop_reason,
            partial: stop_reason == StopReason::Cancelled,
            warnings,
        }
    }

    /// Caustic and direct light on all maps, all lights at their strengths, with the caustic's error; and each light's part
    /// where that is asked for.
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

    /// Charts of all maps: those that received flux, and every receiver that direct light may reach where that or
    /// indirect light is asked for; with a warning where the latter are coarser than they should be for want of memory.
    pub(super) fn charts(&self, levels: &Levels) -> (Charts, Option<Warning>) {
        let (mut charts, mut wishes) = (Charts::new(), BTreeMap::new());
        let is_everywhere = self.plan.is_on(Effect::Direct) || self.plan.is_on(Effect::Indirect);
        for receiver in Receiver::all(self.scene.objects.len()) {
            let lit = levels.iter().find_map(|(_, level)| level.maps.get(receiver));
            if let Some(map) = lit {
                charts.insert(receiver, map.chart.clone());
            } else if is_everywhere
                && self.sizes.may_see_lights(receiver)
                && let Some(size) = self.direct_size(receiver.object())
            {
                wishes.insert(receiver, Wish::dense(size));
            }
        }
        let caustic: u64 = charts.values().map(|chart| chart.texel_count() as u64).sum();
        let left = self
            .settings
            .memory_bytes
            .saturating_sub(caustic * BYTES_PER_TEXEL);
        let wished = map_size::fit(&wishes, u64::MAX);
        let sizes = map_size::fit(&wishes, left);
        for (&receiver, size) in &sizes {
            if let Some(chart) = self.sizes.chart_of(receiver, size) {
                charts.insert(receiver, chart);
            }
        }
        let warning = (sizes != wished).then(|| map_plan::scarce(&wished, &sizes, left));
        (charts, warning)
    }

    /// The charts that direct light is baked on: row by row, and no finer than it needs where a map is in tiles.
    pub(super) fn direct_charts(&self, charts: &Charts) -> Charts {
        let charts = charts.values();
        charts
            .filter_map(|chart| Some((chart.receiver, self.direct_chart(chart)?)))
            .collect()
    }

    fn direct_size(&self, object: usize) -> Option<(usize, usize)> {
        let size = self.sizes.direct_size(object, self.settings)?;
        Some(map_size::halved(size, self.coarsening))
    }

    fn direct_chart(&self, chart: &Arc<Chart>) -> Option<Arc<Chart>> {
        // Unwrapped charts lie elsewhere in maps of other sizes.
        let is_fixed = chart.uv_set == UvSet::Generated || self.coarsening == 0;
        if chart.layout.is_none() && is_fixed {
            return Some(Arc::clone(chart));
        }
        let (width, height) = (chart.width, chart.height);
        let least = self.direct_size(chart.object())?;
        let times = (width / least.0).min(height / least.1).checked_ilog2();
        let size = map_size::halved((width, height), times.unwrap_or(0));
        self.sizes.chart(chart.receiver, size)
    }

    fn map(&self, chart: &Arc<Chart>, levels: &Levels, direct: &DirectCache) -> IlluminationMap {
        let lit: Vec<Lit> = levels
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
        if self.plan.is_on(Effect::Direct) {
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

    /// E = ΣΦ/A per texel; nothing where the surface does not reach, but for the gutter.
    fn caustic_layer(&self, chart: &Chart, lit: &[Lit]) -> Layer {
        let fluxes: Vec<(FluxAccumulator, LinearSrgb)> = lit
            .iter()
            .map(|(light, level, map)| {
                let mut flux = map.flux();
                self.smooth(chart, level, &mut flux);
                (flux, level.strength(light) * level.unit.watts())
            })
            .collect();
        let mut irradiance: Vec<[f32; 3]> = (0..chart.texel_count())
            .into_par_iter()
            .map(|texel| {
                let area_m2 = chart.texel_area_m2(texel);
                if area_m2 <= 0.0 {
                    return [0.0; 3];
                }
                let sum = fluxes.iter().fold(LinearSrgb::BLACK, |sum, (flux, scale)| {
                    let counts = flux.texels()[texel].map(|count| count as f64);
                    sum + LinearSrgb::from(counts) * *scale
                });
                (sum / area_m2).to_array().map(single)
            })
            .collect();
        fill_gutter(chart, &mut irradiance);
        Layer {
            kind: LayerKind::Caustic,
            irradiance,
        }
    }

    /// Smooths light on a map by sigma, but for splats, whose kernels have it: the radius is that of the footprint which
    /// a ray at the nominal density has at the light's reach, however far the bake refines. Maps with gaps are left as
    /// they are: their borders are no mirrors.
    pub(super) fn smooth(&self, chart: &Chart, level: &LightLevel, flux: &mut FluxAccumulator) {
        if let (true, Sigma::Constant(sigma)) = (self.settings.estimator.refines(), self.settings.sigma)
            && chart.is_full()
        {
            let texel_m = (chart.area_m2() / (chart.width * chart.height) as f64).sqrt();
            let radius_m = level.reach_m / (std::f64::consts::PI * self.settings.density_per_sr).sqrt();
            smooth(flux, chart.layout.as_deref(), sigma.sqrt() * radius_m / texel_m);
        }
    }

    /// Each light's part of all layers, where that is asked for.
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
                    let layer = self.direct_of(chart, direct, light..light + 1)?;
                    Some(part(light, layer))
                }));
            }
        }
        layers
    }

    pub(super) fn direct_layer(&self, chart: &Arc<Chart>, direct: &DirectCache) -> Option<Layer> {
        self.direct_of(chart, direct, 0..self.scene.lights.len())
    }

    /// Direct light of some lights; `None` where that of one is not known.
    fn direct_of(&self, chart: &Arc<Chart>, direct: &DirectCache, lights: Range<usize>) -> Option<Layer> {
        let own = self.direct_chart(chart)?;
        let mut sums = vec![LinearSrgb::BLACK; own.texel_count()];
        for light in lights {
            let strength = self.scene.lights[light].strength();
            for (sum, unit) in sums.iter_mut().zip(direct.layer(light, &own)?) {
                *sum += LinearSrgb::from(unit.map(f64::from)) * strength;
            }
        }
        let irradiance: Vec<[f32; 3]> = sums.iter().map(|sum| sum.to_array().map(single)).collect();
        Some(Layer {
            kind: LayerKind::Direct,
            irradiance: match &chart.layout {
                Some(layout) => in_tiles(layout, &own, &irradiance),
                None if own.texel_count() < chart.texel_count() => finer(chart, &own, &irradiance),
                None => irradiance,
            },
        })
    }
}

/// In the precision of maps; what is beyond its range is the most that it holds, and is named by [`beyond_single`].
fn single(value: f64) -> f32 {
    value.min(f64::from(f32::MAX)) as f32
}

/// Says where light is too strong for maps.
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
                "{texels} texels are brighter than {:.1e} W/m², the most that a map holds; they hold that",
                f32::MAX
            ),
            "make the lights weaker",
        )
    })
}

/// Values of a chart at the middle of each texel of a finer one.
fn finer(chart: &Chart, own: &Chart, values: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let size = DVec2::new(chart.width as f64, chart.height as f64);
    let middle = |texel: usize| {
        let corner = DVec2::new((texel % chart.width) as f64, (texel / chart.width) as f64);
        (corner + 0.5) / size
    };
    (0..chart.texel_count())
        .map(|texel| bilinear(values, own.width, own.height, middle(texel)))
        .map(|value| value.to_array().map(single))
        .collect()
}

/// Values of a chart at the middle of each texel of a map in tiles, means where the texels are larger than the chart's.
fn in_tiles(layout: &TileLayout, own: &Chart, values: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let size = {
        let (width, height) = layout.size();
        DVec2::new(width as f64, height as f64)
    };
    let own_size = DVec2::new(own.width as f64, own.height as f64);
    let value = |tile: &Tile, texel: usize| {
        let across = tile.size.0;
        let side = f64::from(1_u32 << tile.level);
        let low = DVec2::new((texel % across) as f64, (texel / across) as f64) * side
            + DVec2::new(tile.origin.0 as f64, tile.origin.1 as f64);
        let times = (DVec2::splat(side) * own_size / size).ceil().max(DVec2::ONE);
        let mut sum = LinearSrgb::BLACK;
        for row in 0..times.y as usize {
            for column in 0..times.x as usize {
                let part = (DVec2::new(column as f64, row as f64) + 0.5) / times;
                sum += bilinear(values, own.width, own.height, (low + part * side) / size);
            }
        }
        (sum / (times.x * times.y)).to_array().map(single)
    };
    layout
        .tiles()
        .flat_map(|tile| (0..tile.texels.len()).map(move |texel| (tile.clone(), texel)))
        .map(|(tile, texel)| value(&tile, texel))
        .collect()
}

/// The error with what texels larger than they should be leave out.
fn with_resolution(chart: &Chart, lit: &[Lit], layers: &[Layer], error: Vec<f32>) -> Vec<f32> {
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

/// Share of all light that no map shows though it should.
fn given_up_share(ledgers: &[LightLedger]) -> f64 {
    let (mut lost_w, mut deposited_w) = (0.0, 0.0);
    for ledger in ledgers {
        let share = accuracy::given_up_share(&ledger.energy_w);
        lost_w += share * ledger.energy_w.deposited;
        deposited_w += ledger.energy_w.deposited;
    }
    if deposited_w > 0.0 {
        lost_w / deposited_w
    } else {
        0.0
    }
}

/// Error of each texel's luminance [W/m²], of all lights together; `None` where one is not known.
fn error_of(chart: &Chart, lit: &[Lit]) -> Option<Vec<f32>> {
    let mut squares = vec![0.0; chart.texel_count()];
    for (light, level, _) in lit {
        let strength = light.strength().luminance();
        let error = &level.error.as_ref()?.estimate;
        for (square, texel) in squares.iter_mut().zip(&error.maps.get(&chart.receiver)?.texels) {
            *square += (texel * strength) * (texel * strength);
        }
    }
    let root = |square: &f64| single(square.sqrt());
    (!lit.is_empty()).then(|| squares.iter().map(root).collect())
}

/// Root mean square of the error over the mean irradiance of the caustic and indirect layers, whose error it is, by area;
/// `None` where the error of a map is not known, or no light arrived.
fn relative_rmse(maps: &[IlluminationMap]) -> Option<f64> {
    let (mut squares, mut flux_w, mut area_m2) = (0.0, 0.0, 0.0);
    for map in maps {
        let estimated = [LayerKind::Caustic, LayerKind::Indirect];
        let layers: Vec<&Layer> = estimated.iter().filter_map(|&kind| map.layer(kind)).collect();
        if layers.is_empty() {
            continue;
        }
        for (texel, error) in map.error.as_ref()?.iter().enumerate() {
            let texel_m2 = map.chart.texel_area_m2(texel);
            squares += f64::from(*error) * f64::from(*error) * texel_m2;
            for layer in &layers {
                flux_w += luminance(&layer.irradiance[texel]) * texel_m2;
            }
            area_m2 += texel_m2;
        }
    }
    (flux_w > 0.0).then(|| (squares * area_m2).sqrt() / flux_w)
}
