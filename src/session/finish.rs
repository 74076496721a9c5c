//! From levels of lights of unit strength to finished maps.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::caustic::{CausticOutcome, Stopped};
use super::direct_cache::DirectCache;
use super::forecast::ForecastReport;
use super::light_level::LightLevel;
use super::sizes::{self, MapSizes};
use super::{BakeResult, LightLayer, StopReason, Timings};
use crate::error::Result;
use crate::illumination::accumulator::FluxAccumulator;
use crate::illumination::gutter::fill_gutter;
use crate::illumination::smoothing::smooth;
use crate::illumination::{Chart, IlluminationMap, Layer};
use crate::light_pass::accuracy;
use crate::light_pass::ledger::LightLedger;
use crate::light_pass::receiver_maps::ReceiverMap;
use crate::optics::LinearSrgb;
use crate::plan::{Effect, EffectPlan};
use crate::scene::{Light, Scene};
use crate::settings::{BakeSettings, Estimator, LayerKind, Sigma};

/// The finest level of a light, with the light's place in the scene.
pub(super) type Shown<'a> = (usize, &'a LightLevel);

/// All that finishing needs.
pub(super) struct Finish<'a> {
    pub(super) scene: &'a Scene,
    pub(super) sizes: &'a MapSizes,
    pub(super) settings: &'a BakeSettings,
    pub(super) plan: &'a EffectPlan,
}

/// Levels of all lights that have maps, in the scene's order.
pub(super) type Levels<'a> = [Shown<'a>];

/// Charts of all maps, by object.
pub(super) type Charts = BTreeMap<usize, Arc<Chart>>;

/// Light on one map.
type Lit<'a> = (&'a Light, &'a LightLevel, &'a ReceiverMap);

impl Finish<'_> {
    /// Sums all lights at their strengths and puts everything together.
    pub(super) fn run(
        &self,
        levels: &Levels,
        charts: &Charts,
        direct: &DirectCache,
        outcome: &CausticOutcome,
    ) -> BakeResult {
        let maps: Vec<IlluminationMap> = charts
            .values()
            .map(|chart| self.map(chart, levels, direct))
            .collect();
        let stop_reason = match outcome.stopped {
            Some(Stopped::Cancelled) => StopReason::Cancelled,
            Some(Stopped::Time) => StopReason::MaxTime,
            Some(Stopped::Target) => StopReason::MaxError,
            None if self.plan.is_on(Effect::LightPass) || self.plan.is_on(Effect::Direct) => {
                StopReason::Density
            }
            None => StopReason::NothingToDo,
        };
        let ledgers = levels.iter().map(|(light, level)| {
            let light = &self.scene.lights[*light];
            level.ledger.report(&light.name, level.unit, light.strength())
        });
        let ledgers: Vec<LightLedger> = ledgers.collect();
        let given_up = given_up_share(&ledgers);
        BakeResult {
            estimated_relative_rmse: relative_rmse(&maps).map(|rmse| rmse.hypot(given_up)),
            maps,
            light_layers: self.light_layers(charts, levels, direct),
            plan: self.plan.clone(),
            effects: Vec::new(),
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
            warnings: outcome.warnings.clone(),
        }
    }

    /// Charts of all maps, by object: those that received flux, and every receiver where direct light is asked for.
    ///
    /// # Errors
    /// Maps that do not fit into memory.
    pub(super) fn charts(&self, levels: &Levels) -> Result<Charts> {
        let mut charts = BTreeMap::new();
        let mut texels = 0;
        for object in 0..self.scene.objects.len() {
            let lit = levels.iter().find_map(|(_, level)| level.maps.get(object));
            let is_receiver = self.scene.material_of(object).surface.is_receiver();
            let chart = if let Some(map) = lit {
                Some(map.chart.clone())
            } else if self.plan.is_on(Effect::Direct) && is_receiver {
                let size = self.sizes.direct_size(object, self.settings);
                texels += size.map_or(0, |(width, height)| width as u64 * height as u64);
                sizes::check_memory(texels, self.settings)?;
                size.and_then(|size| self.sizes.chart(object, size))
            } else {
                None
            };
            if let Some(chart) = chart {
                texels += (chart.width * chart.height) as u64;
                charts.insert(object, chart);
            }
        }
        Ok(charts)
    }

    fn map(&self, chart: &Arc<Chart>, levels: &Levels, direct: &DirectCache) -> IlluminationMap {
        let lit: Vec<Lit> = levels
            .iter()
            .filter_map(|(light, level)| {
                let map = level.maps.get(chart.object)?;
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
        let error = error_of(chart, &lit);
        let mut map = IlluminationMap {
            chart: Arc::clone(chart),
            layers,
            error,
            estimated_relative_rmse: None,
        };
        map.estimated_relative_rmse = relative_rmse(std::slice::from_ref(&map));
        map
    }

    /// E = ΣΦ/A per texel; nothing where the surface does not reach, but for the gutter.
    fn caustic_layer(&self, chart: &Chart, lit: &[Lit]) -> Layer {
        let fluxes: Vec<(FluxAccumulator, LinearSrgb)> = lit
            .iter()
            .map(|(light, level, map)| {
                let mut flux = map.flux();
                self.smooth(chart, &mut flux);
                (flux, light.strength() * level.unit.watts())
            })
            .collect();
        let mut irradiance: Vec<[f32; 3]> = (0..chart.width * chart.height)
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
                (sum / area_m2).to_array().map(|channel| channel as f32)
            })
            .collect();
        fill_gutter(chart, &mut irradiance);
        Layer {
            kind: LayerKind::Caustic,
            irradiance,
        }
    }

    /// Smooths a map of the wavefront by sigma; maps with gaps are left as they are: their borders are no mirrors.
    fn smooth(&self, chart: &Chart, flux: &mut FluxAccumulator) {
        if let (Estimator::Wavefront, Sigma::Constant(sigma)) = (self.settings.estimator, self.settings.sigma)
            && chart.texel_areas_m2.len() == 1
        {
            // A texel is a footprint of its own area: a disc of radius 1/√π.
            smooth(flux, (sigma / std::f64::consts::PI).sqrt());
        }
    }

    /// Each light's part of all layers, where that is asked for.
    fn light_layers(&self, charts: &Charts, levels: &Levels, direct: &DirectCache) -> Vec<LightLayer> {
        let mut layers = Vec::new();
        if !self.settings.per_light {
            return layers;
        }
        for (&object, chart) in charts {
            let part = |light: usize, layer: Layer| LightLayer {
                object,
                light,
                kind: layer.kind,
                irradiance: layer.irradiance,
            };
            for (light, level) in levels {
                if let Some(map) = level.maps.get(object) {
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

    fn direct_layer(&self, chart: &Chart, direct: &DirectCache) -> Option<Layer> {
        self.direct_of(chart, direct, 0..self.scene.lights.len())
    }

    /// Direct light of some lights; `None` where that of one is not known.
    fn direct_of(&self, chart: &Chart, direct: &DirectCache, lights: Range<usize>) -> Option<Layer> {
        let mut sums = vec![LinearSrgb::BLACK; chart.width * chart.height];
        for light in lights {
            let strength = self.scene.lights[light].strength();
            for (sum, unit) in sums.iter_mut().zip(direct.layer(light, chart)?) {
                *sum += LinearSrgb::from(unit.map(f64::from)) * strength;
            }
        }
        Some(Layer {
            kind: LayerKind::Direct,
            irradiance: sums
                .iter()
                .map(|sum| sum.to_array().map(|channel| channel as f32))
                .collect(),
        })
    }
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
    let mut squares = vec![0.0; chart.width * chart.height];
    for (light, level, _) in lit {
        let strength = light.strength().luminance();
        let error = &level.error.as_ref()?.estimate;
        for (square, texel) in squares.iter_mut().zip(&error.maps.get(&chart.object)?.texels) {
            *square += (texel * strength) * (texel * strength);
        }
    }
    let root = |square: &f64| square.sqrt() as f32;
    (!lit.is_empty()).then(|| squares.iter().map(root).collect())
}

/// Root mean square of the error over the mean irradiance of the caustic layer, by area; `None` where the error of a
/// map is not known, or no light arrived.
fn relative_rmse(maps: &[IlluminationMap]) -> Option<f64> {
    let (mut squares, mut flux_w, mut area_m2) = (0.0, 0.0, 0.0);
    for map in maps {
        let Some(layer) = map.layer(LayerKind::Caustic) else {
            continue;
        };
        for (texel, error) in map.error.as_ref()?.iter().enumerate() {
            let texel_m2 = map.chart.texel_area_m2(texel);
            let irradiance = LinearSrgb::from(layer.irradiance[texel].map(f64::from));
            squares += f64::from(*error) * f64::from(*error) * texel_m2;
            flux_w += irradiance.luminance() * texel_m2;
            area_m2 += texel_m2;
        }
    }
    (flux_w > 0.0).then(|| (squares * area_m2).sqrt() / flux_w)
}
